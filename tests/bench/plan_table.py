"""What planned motions deliver on simulated arms: python tests/bench/plan_table.py --data DIR [--seeds 3] -o T.md

For every arm and seed: an earlier log (fast strokes of every joint), a plan from its fit, the planned motion simulated
with another seed, and a fit of both logs. Besides, without a simulation, what the information says of a plain sum of
sines and of D-optimal motions that ignore what is known, as long as the plan's; the latter also where the earlier log
holds the default sweep of every other joint (--known).
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from plan_arm import ARMS, PERIOD_S, arm_named, of_arrays, short_run, write_run
from plan_uninformed import uninformed_ratios

from collaudit.core import api
from collaudit.core.config import LoadedConfig
from collaudit.core.data.audit_result import FrictionFile, Provenance
from collaudit.core.friction.law_candidates import parameter_symbol
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.plan import excitation as ex
from collaudit.core.plan.excitation import Unknowns, unknowns_of
from collaudit.core.plan.moves import MoveCheck
from collaudit.core.plan.planning import Plan, PlanRequest, make_plan, move_check
from collaudit.core.plan.prediction import delivered
from collaudit.fixtures import experiments
from collaudit.fixtures.simulated_robot import FixtureRobot
from collaudit.reports.files.run_files import write_friction

NONE = Provenance("0", {})
SYMBOLS = ("A", "B", "C", "D")
#: Harmonics of the plain sum of sines: the usual five (Swevers et al., IEEE Trans. Robotics and Automation 13, 1997).
HARMONICS = 5


def open_parameters(friction: FrictionFile) -> set[tuple[str, str]]:
    """Parameters of joints whose law is not determined, named as those of eq. (11)."""
    return {(joint, symbol) for joint, fit in friction.joints.items() if not fit.identifiable for symbol in SYMBOLS}


def one(arm: FixtureRobot, seed: int, minutes: float, folder: Path) -> dict[str, object]:
    """All numbers of one arm and seed."""
    log, settings = write_run(arm, short_run(arm), 10 * seed + 1, folder / "earlier.mcap")
    before = api.fit([(log,)], settings)
    begun = time.process_time()
    plan = make_plan(settings, before, [], PlanRequest(minutes=minutes, seed=seed), NONE)
    took = time.process_time() - begun
    planned, _ = write_run(arm, of_arrays(*plan.motion.sampled(PERIOD_S)[1:]), 10 * seed + 2, folder / "planned.mcap")
    after = api.fit([(log,), (planned,)], settings)
    write_friction(folder / "friction.json", after)
    were, are = open_parameters(before), open_parameters(after)
    ratios = [d.delivered / d.predicted for d in delivered(plan.file, after)
              if d.parameter in SYMBOLS and d.delivered and d.predicted]  # fmt: skip
    return {
        "arm": arm.name, "seed": seed, "plan_cpu_s": took, "duration_s": plan.file.duration_s,
        "open": len(were), "determined": len(were - are), "ratios": ratios,
        "covered": covered(arm, after), "half": half_widths(after),
        "sweep_s": max(s.end_s for s in plan.file.sweeps),
        "others": beside_others(settings, before, plan, seed),
        "naive": uninformed_ratios(move_check(settings, before, 1.0)[0], arm, before, plan),
        "together": uninformed_ratios(move_check(settings, before, 1.0)[0], arm, before, plan, together=True),
    }  # fmt: skip


def half_widths(friction: FrictionFile) -> dict[str, float | None]:
    """Relative half widths by joint and symbol; None where open."""
    out: dict[str, float | None] = {}
    for joint, fit in friction.joints.items():
        for key, bounds in fit.ci95.items():
            symbol, closed = parameter_symbol(key), bounds is not None and None not in bounds
            size = abs(fit.parameters[key])
            out[f"{joint} {symbol}"] = 0.5 * (bounds[1] - bounds[0]) / size if closed and bounds and size else None
    return out


def covered(arm: FixtureRobot, friction: FrictionFile) -> list[bool]:
    """Whether intervals hold the truth, where both directions have one."""
    out = []
    for joint, law in zip(arm.joints, arm.friction, strict=True):
        fit = friction.joints[joint]
        truth = law.parameters()
        if truth is None or fit.model != "static-lugre":
            continue
        for key, value in truth.items():
            low, high = fit.ci95[key] or (None, None)
            if low is not None and high is not None:
                out.append(bool(low <= value <= high))
    return out


def beside_others(settings: LoadedConfig, before: FrictionFile, plan: Plan, seed: int) -> dict[str, list[float]]:
    """Half widths of a sum of sines and of an uninformed D-optimal motion over those of the plan, by parameter."""
    if plan.file.exciting_s is None:
        return {}
    check, robot = move_check(settings, before, 1.0)
    unknowns = unknowns_of(robot, settings.config, before, check.limits.torque)
    seconds = plan.file.exciting_s[1] - plan.file.exciting_s[0]
    joints = np.arange(len(robot.joint_names))
    own = plan.moves[-plan.file.exciting_moves :]
    ours = unknowns.prior() + sum(ex.information_of(check, unknowns, part) for part in own)
    flat = replace(unknowns, earlier=-0.999 * np.eye(unknowns.scale.size))  # next to nothing is known
    naive = ex.excite(check, flat, joints, seconds, seed).information + unknowns.prior() - flat.prior()
    sines = unknowns.prior() + sine_information(check, unknowns, seconds, np.random.default_rng(seed))
    mine = unknowns.half_widths(ours)
    first = unknowns.half_widths(unknowns.prior())
    told = mine < 0.9 * first  # parameters that some motion can tell
    return {
        "sines": (unknowns.half_widths(sines) / mine)[told].tolist(),
        "uninformed": (unknowns.half_widths(naive) / mine)[told].tolist(),
    }


def sine_information(check: MoveCheck, unknowns: Unknowns, seconds: float, rng: np.random.Generator) -> FloatArray:
    """Of random sums of sines, scaled into the limits: the first that is free, or with ever smaller amplitudes."""
    limits, count = check.limits, len(check.limits.low)
    t = np.arange(0.0, seconds, 0.05)
    w = 2.0 * np.pi * np.arange(1, HARMONICS + 1) * max(1, round(seconds / 10.0)) / seconds
    share = 1.0
    while share > 0.05:
        a, b = rng.normal(size=(2, HARMONICS, count))
        s, c = np.sin(np.outer(t, w)), np.cos(np.outer(t, w))
        q, v, acc = s @ a + (c - 1) @ b, (c * w) @ a - (s * w) @ b, -(s * w**2) @ a - (c * w**2) @ b
        room = np.minimum(limits.high - limits.start, limits.start - limits.low)
        scale = share * np.min([np.minimum(room, 1.5) / np.abs(q).max(0), limits.speed / np.abs(v).max(0),
                                limits.acceleration / np.abs(acc).max(0)], axis=0)  # fmt: skip
        q, v, acc = limits.start + q * scale, v * scale, acc * scale
        torque = np.abs(check.torque_nm(q, v, acc)) <= limits.torque
        if torque.all() and check.shapes.touching(q) is None:
            return unknowns.information(check.robot, q, v, acc, 0.05 / ex.INDEPENDENT_S)
        share *= 0.95
    return np.zeros_like(unknowns.prior())


def default_times(arm: FixtureRobot, seed: int, folder: Path) -> tuple[dict[str, float | None], float]:
    """Relative half widths of the default sweep (30 speeds of every joint), and the time that it takes."""
    motion = experiments.friction(arm, tuple(range(len(arm.joints))), experiments.FRICTION_SPEEDS)
    log, settings = write_run(arm, motion, 10 * seed + 3, folder / "default.mcap")
    return half_widths(api.fit([(log,)], settings)), len(motion.position) * PERIOD_S


def time_share(found: dict[str, object], default: tuple[dict[str, float | None], float]) -> float:
    """Time for equal half widths of every joint's widest parameter, the plan's over the default's.

    Variance falls with time; what is asked for, 2 % say, cancels. The plan sweeps all joints at once: it takes as
    long as the joint that is last to be there. The default sweep does one joint after the other.
    """
    mine, took, (other, seconds) = found["half"], found["sweep_s"], default
    assert isinstance(mine, dict) and isinstance(took, float)
    joints = sorted({key.split()[0] for key in other})
    last = default_s = 0.0
    for joint in joints:
        pairs = [(mine.get(f"{joint} {s}"), other.get(f"{joint} {s}")) for s in SYMBOLS]
        if all(a and b for a, b in pairs):
            last = max(last, *(a**2 for a, _ in pairs))
            default_s += seconds / len(joints) * max(b for _, b in pairs) ** 2
    return took * last / default_s


def with_known(arm: FixtureRobot, seed: int, minutes: float, folder: Path) -> dict[str, list[float]]:
    """:func:`uninformed_ratios` where earlier logs determine every other joint."""
    log, settings = write_run(arm, short_run(arm), 10 * seed + 1, folder / "earlier.mcap")
    joints = tuple(range(0, len(arm.joints), 2))
    swept = experiments.friction(arm, joints, experiments.FRICTION_SPEEDS)
    half, _ = write_run(arm, swept, 10 * seed + 5, folder / "half.mcap")
    before = api.fit([(log,), (half,)], settings)
    plan = make_plan(settings, before, [], PlanRequest(minutes=minutes, seed=seed), NONE)
    return uninformed_ratios(move_check(settings, before, 1.0)[0], arm, before, plan)


def table(rows: Sequence[dict[str, object]]) -> str:
    """Lines of Markdown."""
    lines = [
        "| arm | seed | motion | planning, CPU | open → determined | half widths ≤ 1.3 × predicted (and ≥ 1/1.3) "
        "| intervals hold the truth | time beside the default sweep | inertials: sum of sines | uninformed D-optimal "
        "| friction, uninformed D-optimal, one joint at a time: A, B, C, D | all joints at once "
        "| one at a time, every other joint known |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for r in rows:
        ratios, hold = np.array(r["ratios"]), r["covered"]
        others, share = r["others"], r.get("share")
        assert isinstance(others, dict) and isinstance(hold, list)
        lines.append(
            f"| {r['arm']} | {r['seed']} | {r['duration_s']:.0f} s | {r['plan_cpu_s']:.1f} s | {r['open']} → "
            f"{r['determined']} | {np.mean(ratios <= 1.3):.0%} of {ratios.size} "
            f"({np.mean((ratios <= 1.3) & (ratios >= 1 / 1.3)):.0%}; median {np.median(ratios):.2f}) | "
            f"{sum(hold)} of {len(hold)} | {f'{share:.2f}' if isinstance(share, float) else 'not run'} | "
            + " | ".join(f"{np.median(others[k]):.2f}" if others.get(k) else "–" for k in ("sines", "uninformed"))
            + f" | {_by_symbol(r['naive'])} | {_by_symbol(r.get('together'))} | {_by_symbol(r.get('known'))} |"
        )
    return "\n".join(lines) + "\n"


def _by_symbol(ratios: object) -> str:
    return ", ".join(f"{np.median(ratios[s]):.2f}" for s in SYMBOLS) if isinstance(ratios, dict) else "not run"


def main() -> None:
    """Run the campaign; finished rows are kept beside the output."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--arms", default=",".join(ARMS))
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--first", type=int, default=2)
    parser.add_argument("--minutes", type=float, default=6.0)
    parser.add_argument("--default", action="store_true", help="also simulate and fit the default sweep")
    parser.add_argument("--known", action="store_true", help="also plan where every other joint is known")
    parser.add_argument("--work", type=Path, default=Path("build/plan-bench"))
    parser.add_argument("-o", "--output", type=Path)
    given = parser.parse_args()
    rows = []
    for name in given.arms.split(","):
        arm = arm_named(name, given.data)
        for seed in range(given.first, given.first + given.seeds):
            folder = given.work / f"{name}-{seed}"
            kept = folder / "row.json"
            if not kept.exists():
                row = one(arm, seed, given.minutes, folder)
                if given.default:
                    row["share"] = time_share(row, default_times(arm, seed, folder))
                if given.known:
                    row["known"] = with_known(arm, seed, given.minutes, folder)
                kept.write_text(json.dumps(row))
            rows.append(json.loads(kept.read_text()))
            print(table(rows[-1:]).splitlines()[-1], flush=True)
    if given.output is not None:
        given.output.write_text(table(rows), encoding="utf-8")


if __name__ == "__main__":
    main()
