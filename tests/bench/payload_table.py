"""Payloads: fitted with one, judged with another, stated for the fitted log, the judged one, both or neither.

    python tests/bench/payload_table.py --data DIR [--arms paper6,seven,ur10_robot.urdf] [--payloads 3] [--work DIR]

Payloads are 0.2 to 5 kg, off the flange's axis. A log that is judged is of another day (``simulated_days.py``): clean,
with pushes of 100 N at the tool, or with somebody who leans on it throughout.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from cause_table import loaded, spoken
from changed_logs import fitted, judged
from same_log_table import force, found
from simulated_days import Arm, Push, arm_of, day

from collaudit.core.config import LoadedConfig
from collaudit.core.numeric.arrays import FloatArray

FITTED_S, JUDGED_S, PUSH_N, LEAN_N = 150.0, 90.0, 100.0, 30.0


def payload(rng: np.random.Generator) -> tuple[float, FloatArray]:
    """Mass, kg, and its place in the tool's axes, m."""
    mass = float(np.exp(rng.uniform(np.log(0.2), np.log(5.0))))
    return mass, np.round(rng.uniform((-0.05, -0.05, 0.0), (0.05, 0.05, 0.1)), 4)


def stated(arm: Arm, mass_kg: float | str, com_m: Sequence[float] | FloatArray) -> LoadedConfig:
    """The arm's settings with this tool, in the frame in which ``loaded`` has it."""
    config, frame = arm.described.config, arm.robot.tool_frame
    tool = config.robot.tool.changed({"frame": frame, "mass_kg": mass_kg, "com_m": tuple(float(x) for x in com_m)})
    return replace(arm.described, config=config.changed({"robot": config.robot.changed({"tool": tool})}))


def measure(arm: Arm, seed: int, count: Counter[str]) -> None:
    """One pair of payloads: every statement, and what is pushed and leaned on."""
    rng = np.random.default_rng([seed, 623])
    a, b = payload(rng), payload(rng)
    first, second = loaded(arm, *a), loaded(arm, *b)
    other = 1000 * seed + 7
    clean = day(second, other, JUDGED_S)
    for in_fit in (True, False):
        fit_settings = stated(arm, *a) if in_fit else arm.described
        friction = fitted([day(first, seed, FITTED_S, first=True)], fit_settings)
        for in_log in (True, False):
            settings = stated(arm, *b) if in_log else arm.described
            result = judged(clean, settings, friction).result
            # without a statement in the fit, its corrections hold a: what is right for the judged log is b - a
            more = (0.0 if in_log else b[0]) - (0.0 if in_fit else a[0])
            cause = spoken(result.causes)
            tool = cause if cause is not None and cause.code == "tool" else None
            inside = tool is not None and tool.ci95[0][0] <= more <= tool.ci95[0][1]
            kind = f"{'fit' if in_fit else '-'},{'log' if in_log else '-'}"
            count.update({
                f"{kind}: logs": 1, f"{kind}: contacts": len(result.contacts), f"{kind}: {result.verdict}": 1,
                f"{kind}: tool named": int(tool is not None), f"{kind}: mass within": int(inside),
            })  # fmt: skip
            said = "" if cause is None else f"{cause.code}: {cause.text}"
            print(f"{arm.name} {seed} {a[0]:.2f} -> {b[0]:.2f} kg, stated {kind:8s} {result.verdict:10s} "
                  f"{len(result.contacts)} contacts; more {more:.2f}; {said}", flush=True)  # fmt: skip
            if in_fit and in_log:
                at = np.arange(8.0, JUDGED_S - 5.0, 9.0)
                pushes = [Push(float(t), force(rng, PUSH_N)) for t in at]
                pushed = judged(day(second, other, JUDGED_S, pushes), settings, friction)
                count.update({"pushes": len(pushes), "pushes found": found(pushed, pushes)})
                lean = [Push(0.0, force(rng, LEAN_N), JUDGED_S)]
                leaned = judged(day(second, other, JUDGED_S, lean), settings, friction).result
                named = spoken(leaned.causes)
                count.update({"leans": 1, "leans that pass": int(leaned.verdict == "pass"),
                              "leans called a payload": int(named is not None and named.code == "tool")})  # fmt: skip
                print(f"  pushes found {found(pushed, pushes)} of {len(pushes)}; lean: {leaned.verdict}, "
                      f"{'' if named is None else named.text}", flush=True)  # fmt: skip


def main() -> None:
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("--data", type=Path, required=True)
    asked.add_argument("--work", type=Path, default=Path("build/payloads"))
    asked.add_argument("--arms", default="paper6,seven,ur10_robot.urdf")
    asked.add_argument("--payloads", type=int, default=3)
    asked.add_argument("--seed", type=int, default=31)
    given = asked.parse_args()
    for name in given.arms.split(","):
        arm, count = arm_of(name, given.work, given.data / "urdf"), Counter[str]()
        for seed in range(given.seed, given.seed + given.payloads):
            measure(arm, seed, count)
        print(name, dict(count), flush=True)


if __name__ == "__main__":
    main()
