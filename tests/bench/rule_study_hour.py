"""How long the grids of a rule study take for an hour of seven joints at 500 Hz, in processor time of one thread.

``python tests/bench/rule_study_hour.py`` prints the seconds of the alarms on 100 × 50 rules for each of seven joints,
and with torque on the same grid.
"""

from __future__ import annotations

import time

import numpy as np

from collaudit.core.numeric.arrays import Span
from collaudit.core.numeric.filters import low_pass
from collaudit.core.rule_study.joint_plane import AddedTorque, JointSeries, alarm_grid, joint_plane
from collaudit.core.rule_study.shown_torque import Windows

SAMPLES, JOINTS, PERIOD_S = 1_800_000, 7, 0.002


def added(residual: np.ndarray, moments: int, length: int, rng: np.random.Generator) -> AddedTorque:
    """A step of a torque at so many moments of a residual."""
    starts = rng.integers(0, residual.size - length, moments)
    around = residual[starts[:, None] + np.arange(length)][None]
    zero, true = np.zeros_like(around), np.ones(around.shape, dtype=bool)
    unit = np.zeros((1, 1, length))
    unit[..., 60 : length - 60] = 1.0
    return AddedTorque(Windows(around, zero, zero, zero, true, ~true), unit)


def main() -> None:
    """Print both times."""
    rng = np.random.default_rng(1)
    alarms = whole = 0.0
    for _ in range(JOINTS):
        residual = low_pass(rng.normal(size=SAMPLES), [Span(0, SAMPLES)], PERIOD_S, 20.0)
        residual *= (0.4 + 0.3 * np.sin(np.arange(SAMPLES) / 9000.0)) / residual.std()
        joint = JointSeries(residual, np.zeros(SAMPLES), np.ones(SAMPLES, dtype=bool), PERIOD_S, 100)
        push = added(residual, 160, 170, rng)
        start = time.process_time()
        plane = joint_plane(joint, 4.0, 13, push)
        whole += time.process_time() - start
        start = time.process_time()
        again = alarm_grid(joint.excess(), np.array(plane.gamma_nm), np.array(plane.n), 100)
        alarms += time.process_time() - start
        assert again.tolist() == [list(row) for row in plane.alarms]
    print(f"{JOINTS} joints, {SAMPLES} samples: alarms {alarms:.1f} s, with torque {whole:.1f} s")


if __name__ == "__main__":
    main()
