"""What the comparison of cycles is worth: clean hours, pushes by size and in every cycle, changes of a program.

    python tests/bench/cycles_table.py --data DIR --work build/cycles [--hours 10 | --pairs 50] [--arms LIST]

Programs of ``simulated_days.py`` with 20 to 200 cycles in a log, overrides and waits; torque that no rigid body has, of
10 to 30 % of what the bodies take; ripple, friction of the day that warms up, a zero that drifts. The fit is of another
day, in motion that does not repeat. A run goes on where it was ended; ``--tables`` prints what is kept.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from changed_logs import judged, prepared
from simulated_days import Arm, Program, arm_of, day

from collaudit.core import api
from collaudit.core.causes.program_change import compare_programs
from collaudit.core.data.audit_result import Audit, Collision, FrictionFile
from collaudit.core.data.joint_log import JointLog
from collaudit.core.fitting import fit_logs

ARMS = ("paper6", "ur10_robot.urdf")
ERRORS = (0.1, 0.2, 0.3)
FITTED_S, LOG_S, CYCLES = 600.0, 1200.0, (20, 50, 100, 200)
#: Pushes on one joint, times its ordinary γ, of so many seconds.
SIZES, PUSH_S = (0.3, 0.5, 0.75, 1.0, 1.5), 0.2
#: Pushes in every cycle, on the second joint.
EVERY = (0.5, 1.5)
#: Logs of an arm and error that are pushed.
PUSHED = 2
#: Logs that are compared: length and cycle, s.
PAIR_S, CYCLE_S = 400.0, 12.0
CHANGES = ("none", "speed", "load", "path", "friction")


def fitted(arm: Arm) -> FrictionFile:
    """Of a day whose motion does not repeat."""
    ready = prepared(day(arm, 1, FITTED_S, first=True), arm.described)
    return fit_logs([ready], arm.described.config, arm.described.provenance(None, ready.robot.sha256))


def programs(seed: int) -> Program:
    """One of several kinds: at full speed, with overrides, with waits; 20 to 200 cycles in a log."""
    cycles = CYCLES[seed % len(CYCLES)]
    kinds = (((1.0,), 0.0), ((0.5, 0.75, 1.0), 0.0), ((1.0,), 1.0), ((0.6, 1.0, 1.0), 0.5))
    overrides, wait_s = kinds[(seed + seed // len(CYCLES)) % len(kinds)]
    return Program(LOG_S / cycles * float(np.mean(overrides)), seed, overrides, min(wait_s, 0.1 * LOG_S / cycles))


def pushed(log: JointLog, torques: list[tuple[float, int, float]]) -> JointLog:
    """The log with torques on joints: start, s, column, N·m."""
    assert log.effort is not None
    effort = log.effort.copy()
    for start, j, torque_nm in torques:
        effort[(log.time_s >= start) & (log.time_s < start + PUSH_S), j] += torque_nm
    return replace(log, effort=effort)


def measured(arm: Arm, friction: FrictionFile, seed: int) -> dict[str, Any]:
    """One clean log, and the same with pushes, judged with and without cycles."""
    log = day(arm, 1000 + seed, LOG_S, program=programs(seed))
    clean = judged(log, arm.described, friction)
    facts, gamma = clean.result.cycles, clean.result.rule.gamma_nm
    out: dict[str, Any] = {"hours": clean.result.log.duration_s / 3600.0, "verdict": clean.result.verdict,
                           "contacts": [[alarm.spoke, alarm.joint] for alarm in clean.result.collisions]}  # fmt: skip
    if facts is None:
        return out
    if seed >= PUSHED:
        return out | {"cycles": len(facts.starts_s), "spread": facts.spread_share,
                      "ratio": {joint: level / gamma[joint] for joint, level in facts.gamma_nm.items()}}  # fmt: skip
    out |= {"cycles": len(facts.starts_s), "compared": facts.compared, "spread": facts.spread_share,
            "ratio": {joint: level / gamma[joint] for joint, level in facts.gamma_nm.items()}}  # fmt: skip
    rng = np.random.default_rng([seed, 8])
    names = list(clean.signals.joint_names)
    torques, asked = [], []
    for start in np.arange(20.0, LOG_S - 20.0, 4.0) + rng.uniform(0.0, 2.0):
        j, size = int(rng.integers(len(names))), float(rng.choice(SIZES))
        if names[j] in gamma and _moves(clean, start, j):
            torques.append((float(start), j, size * gamma[names[j]] * float(rng.choice([-1.0, 1.0]))))
            asked.append(size)
    both = judged(pushed(log, torques), arm.described, friction).result
    alone = [alarm for alarm in both.collisions if alarm.spoke != "cycle"]
    out["pushes"] = [
        [size, *(any(a.joint == names[j] and _meets(a, at) for a in alarms) for alarms in (alone, both.collisions))]
        for size, (at, j, _) in zip(asked, torques, strict=True)
    ]
    out["every"] = {}
    for size in EVERY:
        begins = [at + 0.3 * (b - at) for at, b in pairwise(facts.starts_s)]
        starts = [(at, 1, size * gamma[names[1]]) for at in begins if _moves(clean, at, 1)]
        result = judged(pushed(log, starts), arm.described, friction).result
        found = sum(any(_meets(alarm, at) for alarm in result.collisions) for at, _, _ in starts)
        said = result.cycles is not None and any("part of the reference" in text for text in result.cycles.unseen)
        out["every"][str(size)] = [found, len(starts), said]
    return out


def _meets(alarm: Collision, start: float) -> bool:
    return alarm.onset_s < start + PUSH_S and alarm.onset_s + alarm.duration_s > start


def _moves(audit: Audit, start: float, j: int) -> bool:
    """Whether the joint moves and has a reference about a push."""
    signals = audit.signals
    rows = (signals.time_s >= start - 0.1) & (signals.time_s < start + PUSH_S + 0.1)
    assert signals.cycles is not None
    return bool((signals.state[rows, j] == 0).all() and np.isfinite(signals.cycles.torque_nm[rows, j]).all())


def compared(name: str, work: Path, urdfs: Path, pairs: int) -> dict[str, Any]:
    """Pairs of logs of one program: unchanged, and with each change, and what is said to have changed."""
    arm = replace(arm_of(name, work, urdfs), unmodelled=0.2)
    friction, robot = fitted(arm), api.load_robot(arm.described, arm.robot.joint_names)

    def log(seed: int, arm: Arm = arm, **program: Any) -> Audit:
        its = replace(Program(CYCLE_S, seed // 1000), **program)
        return judged(day(arm, seed, PAIR_S, first=True, program=its), arm.described, friction)

    heavier = replace(arm_of(name, work, urdfs, 0.3), unmodelled=0.2)
    out: dict[str, Any] = {kind: [] for kind in CHANGES}
    for pair in range(pairs):
        seed, j = 1000 * (1 + pair), pair % len(arm.speed_rad_s)
        goals = arm.middle_rad + np.random.default_rng([seed // 1000, 61]).uniform(-1.0, 1.0, (5, arm.middle_rad.size))
        aside = np.abs(arm.robot.torque_per_newton(goals[1:2], arm.robot.tool_frame)[0].sum(axis=0))
        worn = np.ones(arm.speed_rad_s.size)
        worn[j] = 1.1
        changed = {
            "none": lambda seed=seed: log(seed + 2),
            "speed": lambda seed=seed: log(seed + 3, cycle_s=CYCLE_S / 1.05),
            "load": lambda seed=seed: log(seed + 4, heavier),
            "path": lambda seed=seed, aside=aside: log(seed + 5, aside_rad=0.005 / float(np.linalg.norm(aside))),
            "friction": lambda seed=seed, worn=worn: log(seed + 6, replace(arm, friction=worn)),
        }
        before = log(seed + 1)
        for kind in CHANGES if pair < pairs // 4 else ("none",):
            found = compare_programs(before, changed[kind](), robot)
            named = [[one.quantity, one.joint, one.value] for one in found.changes if one.changed]
            expected = [["friction", arm.robot.joint_names[j]]] if kind == "friction" else [[kind, None]]
            right = [one[:2] for one in named] == ([] if kind == "none" else expected)
            out[kind].append([right, named, found.reason])
    return out


def tables(kept: dict[str, Any]) -> Iterator[str]:
    """Clean hours and thresholds; pushes by size."""
    yield (
        "| arm, model error | logs | cycles | h | alarms by the model | by cycles "
        "| γ of cycles over γ, joints: median, 90 % | spread left |"
    )
    yield "|---|---|---|---|---|---|---|---|"
    for head in dict.fromkeys(name.rpartition(",")[0] for name in kept):
        rows = [one for name, one in kept.items() if name.rpartition(",")[0] == head]
        ratios = [x for one in rows for x in one.get("ratio", {}).values()]
        spreads = [x for one in rows for x in one.get("spread", {}).values()]
        spoke = [alarm[0] for one in rows for alarm in one["contacts"]]
        yield (
            f"| {head} | {len(rows)} | {sum(one.get('cycles', 0) for one in rows)} "
            f"| {sum(one['hours'] for one in rows):.1f} "
            f"| {sum(x != 'cycle' for x in spoke)} | {spoke.count('cycle')} "
            f"| {np.median(ratios):.2f}, {np.quantile(ratios, 0.9):.2f} | {np.median(spreads):.2f} |"
        )
    yield ""
    yield "| push, times γ | pushes | found by the model alone | by both |"
    yield "|---|---|---|---|"
    every = [push for one in kept.values() for push in one.get("pushes", [])]
    for size in SIZES:
        its = [push for push in every if push[0] == size]
        if its:
            alone, both = (100 * np.mean([push[k] for push in its]) for k in (1, 2))
            yield f"| {size:g} | {len(its)} | {alone:.0f} % | {both:.0f} % |"
    yield ""
    yield "| push in every cycle, times γ | found | said to be unseen by cycles |"
    yield "|---|---|---|"
    for size in map(str, EVERY):
        its = [one["every"][size] for one in kept.values() if "every" in one]
        if its:
            found, count, said = (sum(x[k] for x in its) for k in range(3))
            yield f"| {size} | {found} of {count} | {said} of {len(its)} logs |"


def change_tables(kept: dict[str, Any]) -> Iterator[str]:
    """How often each change is named, and what else is."""
    yield "| change | pairs | named, and nothing else | named | something else said |"
    yield "|---|---|---|---|---|"
    for kind in CHANGES:
        rows = [one for arm in kept.values() for one in arm[kind]]
        named = sum(any(found[0] == kind for found in one[1]) for one in rows)
        others = sum(any(found[0] != kind for found in one[1]) for one in rows)
        yield f"| {kind} | {len(rows)} | {sum(one[0] for one in rows)} | {named} | {others} |"


def main() -> None:
    """Measure what is not kept yet, and print the tables."""
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("--data", type=Path, required=True)
    asked.add_argument("--work", type=Path, default=Path("build/cycles"))
    asked.add_argument("--arms", default=",".join(ARMS))
    asked.add_argument("--hours", type=float, default=2.0, help="of all together")
    asked.add_argument("--pairs", type=int, default=0, help="of unchanged logs of each arm, in place of hours")
    asked.add_argument("--tables", action="store_true")
    given = asked.parse_args()
    given.work.mkdir(parents=True, exist_ok=True)
    file = given.work / "cycles_table.json"
    kept: dict[str, Any] = json.loads(file.read_text(encoding="utf-8")) if file.exists() else {}
    names = given.arms.split(",")
    if given.pairs:
        pairs = {name: compared(name, given.work, given.data / "urdf", given.pairs) for name in names}
        (given.work / "changes.json").write_text(json.dumps(pairs), encoding="utf-8")
        print("\n".join(change_tables(pairs)))
        return
    logs = round(given.hours * 3600.0 / LOG_S / len(names) / len(ERRORS))
    for name in () if given.tables else names:
        for error in ERRORS:
            arm, friction = replace(arm_of(name, given.work, given.data / "urdf"), unmodelled=error), None
            for seed in range(max(1, logs)):
                key = f"{name.removesuffix('_robot.urdf')} {error:g}, {seed}"
                if key not in kept:
                    friction = friction or fitted(arm)
                    kept[key] = measured(arm, friction, seed)
                    file.write_text(json.dumps(kept), encoding="utf-8")
    print("\n".join(tables(kept)))


if __name__ == "__main__":
    main()
