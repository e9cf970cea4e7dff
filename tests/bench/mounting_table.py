"""Mountings at random, stated nowhere: is gravity's direction told, and is no sign advised?

    python tests/bench/mounting_table.py --data DIR [--arms paper6,seven,ur10_robot.urdf] [--mountings 20] [--work DIR]

A log of a minute (``simulated_days.py``) of an arm whose base is turned at random, judged with the base as described;
its tool and rotors are described nowhere either. The first two are the description's own base and one tilted by 3°.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from cause_table import tilted
from changed_logs import prepared
from simulated_days import Arm, arm_of, day

from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.prepare.mounting import mounting
from collaudit.core.robot.pinocchio_model import rotation_rpy

SECONDS = 60.0


def between_deg(a: FloatArray, b: FloatArray) -> float:
    """Angle between two directions."""
    return float(np.degrees(np.arccos(np.clip(a @ b / np.linalg.norm(a) / np.linalg.norm(b), -1.0, 1.0))))


def measure(arm: Arm, rpy_deg: FloatArray, seed: int) -> tuple[float, float | None, bool]:
    """True tilt, error of the direction where one is told, and whether a sign is advised."""
    ready = prepared(day(tilted(arm, rpy_deg), seed, SECONDS, first=True), arm.described)
    stated = arm.described.config.robot.base_rpy_deg
    as_stated, true = (rotation_rpy(rpy).T @ np.array([0.0, 0.0, -9.81]) for rpy in (np.array(stated), rpy_deg))
    found = mounting(ready.start.series, ready.start.robot.under_gravity(as_stated))
    signs = any(finding.code == "effort-sign-inverted" for finding in ready.findings)
    off = None if found is None else between_deg(found.gravity_m_s2, true)
    print(f"{arm.name} {seed} {rpy_deg.round(1)}: true {between_deg(true, as_stated):.1f}°, "
          f"{'not told' if found is None else f'told {found.tilt_deg:.1f} ± {found.half_deg:.1f}°, off {off:.2f}°'}, "
          f"{sorted({f.code for f in ready.findings if f.severity != 'info'})}", flush=True)  # fmt: skip
    return between_deg(true, as_stated), off, signs


def main() -> None:
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("--data", type=Path, required=True)
    asked.add_argument("--work", type=Path, default=Path("build/mountings"))
    asked.add_argument("--arms", default="paper6,seven,ur10_robot.urdf")
    asked.add_argument("--mountings", type=int, default=20)
    asked.add_argument("--seed", type=int, default=50)
    given = asked.parse_args()
    for name in given.arms.split(","):
        arm, rng = arm_of(name, given.work, given.data / "urdf"), np.random.default_rng(given.seed)
        own = np.array(arm.described.config.robot.base_rpy_deg)
        turns = [own, own + np.array([3.0, 0.0, 0.0]), *rng.uniform(-180.0, 180.0, (given.mountings, 3))]
        rows = [measure(arm, rpy, given.seed + k) for k, rpy in enumerate(turns)]
        errors = [off for _, off, _ in rows[1:] if off is not None]
        own_base = "not told" if rows[0][1] is None else "WRONG"
        print(f"| {name} | own base: {own_base} | told {len(errors)} of {len(rows) - 1} | worst {max(errors):.2f}° "
              f"| signs advised {sum(signs for *_, signs in rows)} |", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
