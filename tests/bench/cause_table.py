"""Which cause is named first when a log of another day has one, two or none.

    python tests/bench/cause_table.py --data DIR [--arms paper6,seven,ur10_robot.urdf] [--seeds 4] [--work DIR]

A log of two minutes of a fitted arm on another day (``simulated_days.py``), spoilt by one cause of random size.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from changed_logs import judged, prepared
from rule_table import pushes_of
from simulated_days import Arm, arm_of, day

from collaudit.core.data.audit_result import Cause, FrictionFile
from collaudit.core.data.joint_log import JointLog
from collaudit.core.fitting import fit_logs
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.robot.pinocchio_model import point_mass_parameters, rotation_rpy

FITTED_S, JUDGED_S = 180.0, 120.0
Made = tuple[JointLog, str, str]


def loaded(arm: Arm, mass_kg: float, com_m: FloatArray) -> Arm:
    """The arm with so much more at its tool."""
    turn, place, body = arm.robot.in_joint(None)
    ten = arm.robot.inertial_parameters
    ten[10 * body : 10 * body + 10] += np.sign(mass_kg) * point_mass_parameters(
        abs(mass_kg), abs(mass_kg) * (turn @ com_m + place)
    )
    return replace(arm, robot=arm.robot.with_inertials(ten, arm.robot.armature))


def tilted(arm: Arm, rpy_deg: FloatArray) -> Arm:
    """The arm on a base that is turned."""
    bodies = arm.robot.inertial_bodies().under_gravity(rotation_rpy(rpy_deg).T @ np.array([0.0, 0.0, -9.81]))
    return replace(arm, robot=replace(arm.robot, bodies=bodies))


def rubbed(arm: Arm, factor: FloatArray) -> Arm:
    """The arm with so many times its friction, (j,)."""
    return replace(arm, coulomb_nm=factor * arm.coulomb_nm, viscous_nm_s=factor * arm.viscous_nm_s,
                   extra_nm=factor * arm.extra_nm)  # fmt: skip


def with_effort(log: JointLog, change: Callable[[FloatArray], FloatArray]) -> JointLog:
    """The log with another effort."""
    assert log.effort is not None
    return replace(log, effort=change(log.effort.copy()))


def cases(arm: Arm, seed: int) -> Iterator[Made]:
    """Logs, what was done to each, and the code of the cause that is right."""
    rng = np.random.default_rng([seed, 77])
    j, count = int(rng.integers(len(arm.coulomb_nm))), len(arm.coulomb_nm)

    def log(changed: Arm) -> JointLog:
        return day(changed, 1000 * seed + 5, JUDGED_S)

    mass = float(np.exp(rng.uniform(np.log(0.3), np.log(5.0))))
    yield log(loaded(arm, mass, rng.uniform((-0.05, -0.05, 0.0), (0.05, 0.05, 0.1)))), f"{mass:.2f} kg", "tool"
    tilt = rng.uniform(-25.0, 25.0, 3) * [1.0, 1.0, 0.0]
    yield log(tilted(arm, tilt)), f"tilt {tilt[0]:.0f} {tilt[1]:.0f}", "mounting"
    factor = np.ones(count)
    factor[j] = rng.uniform(1.6, 2.2)
    yield log(rubbed(arm, factor)), f"friction of {j} x {factor[j]:.2f}", "friction"
    yield log(rubbed(arm, np.full(count, 1.6))), "friction x 1.6", "friction"
    scale = float(rng.choice([0.6, 0.75, 1.3, 1.6]))
    yield with_effort(log(arm), lambda x: x * np.where(np.arange(count) == j, scale, 1.0)), f"{j} x {scale}", "scale"
    yield with_effort(log(arm), lambda x: scale * x), f"all x {scale}", "scale"
    zero = float(rng.choice([-1.0, 1.0])) * (0.5 + 0.3 * arm.coulomb_nm[j])
    yield with_effort(log(arm), lambda x: x + np.where(np.arange(count) == j, zero, 0.0)), f"{j} + {zero:.2f}", "zero"
    late = int(rng.integers(2, 6))
    yield with_effort(log(arm), lambda x: np.vstack([x[:1].repeat(late, 0), x[:-late]])), f"{10 * late} ms", "delay"
    k = int((j + 1 + rng.integers(count - 1)) % count)
    order = list(range(count))
    order[j], order[k] = k, j
    yield with_effort(log(arm), lambda x: x[:, order]), f"{j} and {k} exchanged", "swapped"
    yield with_effort(log(arm), lambda x: x * np.where(np.arange(count) == j, -1.0, 1.0)), f"{j} inverted", "scale"
    yield log(arm), "clean", ""
    yield day(arm, 1000 * seed + 6, JUDGED_S, [p for p in pushes_of(seed) if p.start_s < JUDGED_S - 1]), "pushes", ""


def fitted(arm: Arm, seed: int) -> FrictionFile:
    ready = prepared(day(arm, seed, FITTED_S, first=True), arm.described)
    return fit_logs([ready], arm.described.config, arm.described.provenance(None, ready.robot.sha256))


def spoken(causes: tuple[Cause, ...]) -> Cause | None:
    return next((cause for cause in causes if cause.speaks), None)


def main() -> None:
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("--data", type=Path, required=True)
    asked.add_argument("--work", type=Path, default=Path("build/causes"))
    asked.add_argument("--arms", default="paper6,seven,ur10_robot.urdf")
    asked.add_argument("--seeds", type=int, default=2)
    asked.add_argument("--seed", type=int, default=901)
    given = asked.parse_args()
    count: dict[str, Counter[str]] = {}
    for name in given.arms.split(","):
        arm = arm_of(name, given.work, given.data / "urdf")
        for seed in range(given.seed, given.seed + given.seeds):
            friction = fitted(arm, seed)
            for log, what, right in cases(arm, seed):
                result = judged(log, arm.described, friction).result
                one = spoken(result.causes)
                named = "none" if one is None else "first" if one.code == right else "wrong"
                if right and result.verdict == "pass":
                    named = "passes"
                elif named == "none" and any(
                    x.effect in ("not-judged-joint", "not-judged-log") for x in result.findings
                ):
                    named = "finding"
                count.setdefault(right or what, Counter())[named] += 1
                told = "; ".join(
                    f"{x.code}{list(x.joints) if len(x.joints) < 3 else ''} {x.share:.2f}" for x in result.causes[:3]
                )
                print(f"{name} {seed} {what}: {result.verdict}, {len(result.contacts)} contacts, {named}: {told}",
                      "|", "" if one is None else f"{one.text} -> {one.line}", flush=True)  # fmt: skip
    heads = ("first", "wrong", "none", "finding", "passes")
    print("| cause | tried | named first | named wrong | none | a finding speaks | passes |")
    print("|---|---|---|---|---|---|---|")
    for what, its in count.items():
        print(f"| {what} | {its.total()} | {' | '.join(str(its[head]) for head in heads)} |")


if __name__ == "__main__":
    main()
