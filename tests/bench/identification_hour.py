"""How long everything ``fit`` identifies takes on an hour of seven joints at 500 Hz: ``python identification_hour.py``.

Prints each stage's seconds of processor time (an idle machine takes no longer by the clock), and what thinning the
samples costs: intervals of what was identified from as many samples as usual and five times as many. Linear algebra
runs on one thread, as in the command.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import json
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar
from unittest import mock

import numpy as np

sys.path.insert(0, str(Path(__file__).parent.with_name("helpers")))
from identified import identify

from collaudit.core.config.schema import Config
from collaudit.core.data.identification_result import Identified
from collaudit.core.data.joint_log import JointLog, LogSource
from collaudit.core.friction.joint_fits import fit_joints
from collaudit.core.identification import motion_sums
from collaudit.core.identification.channel_audit import audit_channels
from collaudit.core.prepare.calibration import Calibration
from collaudit.core.prepare.preparation import calibrated, prepare
from collaudit.core.recommend.fitted_thresholds import settled_motion
from collaudit.core.robot.robot_model import RobotModel
from collaudit.fixtures.arms import robot_named

T = TypeVar("T")


def hour(robot: RobotModel, seconds: float = 3600.0) -> JointLog:
    """Smooth motion of all joints, friction and noise: 1.8 million samples."""
    t = np.arange(0, seconds, 0.002)
    rng = np.random.default_rng(0)
    q, v, a = (np.zeros((t.size, 7)) for _ in range(3))
    for j in range(7):
        for w in (0.4 + 0.07 * j, 1.1 + 0.11 * j):
            size, p = 0.5 / (1 + w), rng.uniform(0, 6)
            q[:, j] += size * np.sin(w * t + p)
            v[:, j] += size * w * np.cos(w * t + p)
            a[:, j] -= size * w * w * np.sin(w * t + p)
    effort = robot.inverse_dynamics(q, v, a) + 3 * np.sign(v) + 2 * v + 0.3 * rng.standard_normal(v.shape)
    source = LogSource("hour", "0" * 64, "test", None, "column", "/t")
    return JointLog(t, robot.joint_names, q, v, effort, "Nm", None, source)


def staged(log: JointLog, robot: RobotModel, config: Config) -> tuple[dict[str, float], Identified]:
    """Processor seconds (all threads) of each stage of ``fit`` after the log is read, and what was identified."""
    took: dict[str, float] = {}

    def timed(name: str, work: Callable[[], T]) -> T:
        start = time.process_time()
        out = work()
        took[name] = time.process_time() - start
        return out

    prepared = timed("conditioning, model torque", lambda: prepare(log, robot, config))
    found = timed("gains, inertials, tool", lambda: identify([prepared], config))
    assert found is not None
    seen = timed("model torque as identified", lambda: calibrated(prepared, Calibration(found), config))
    fits = timed("friction", lambda: fit_joints([seen], config))
    assert all(fit.model for fit in fits.values())
    timed("audit of channels", lambda: audit_channels(prepared, config))
    timed("warm-up, ripple, load", lambda: settled_motion([seen], fits))
    return took, found


def growth(few: Identified, many: Identified) -> tuple[float, float]:
    """Median and largest ratio of the intervals of base parameters that the data determine."""
    wide = {b.name: (b.ci95[1] or 0.0) - (b.ci95[0] or 0.0) for b in many.base_parameters}
    ratio = [((b.ci95[1] or 0.0) - (b.ci95[0] or 0.0)) / wide[b.name] for b in few.base_parameters if b.from_data > 0.5]
    return float(np.median(ratio)), float(np.max(ratio))


def main() -> None:
    """Print the stages, then the loss; with ``--json`` as last line a dictionary of them."""
    arm = robot_named("seven").model()
    config = Config.of({"fit": {"estimate": ["friction", "gain", "inertials", "tool"]}})
    log = hour(arm)
    start = time.perf_counter()
    took, found = staged(log, arm, config)
    wall = time.perf_counter() - start
    for name, seconds in took.items():
        print(f"{name:28} {seconds:6.1f} s")
    print(f"{'in all':28} {sum(took.values()):6.1f} s of processor time, {wall:.1f} s by the clock")
    print(found.loss)
    with mock.patch.object(motion_sums, "_MOST_ROWS", 5 * motion_sums._MOST_ROWS):
        median, most = growth(found, identify([prepare(log, arm, config)], config) or found)
    print(
        f"against five times the samples, intervals are wider by {100 * (median - 1):.0f} % (at most {most:.2f} times)"
    )
    if "--json" in sys.argv:
        print(json.dumps({**took, "loss": median}))


if __name__ == "__main__":
    main()
