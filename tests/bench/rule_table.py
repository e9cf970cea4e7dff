"""What automatic thresholds are worth on days that the fit has not seen: clean motion, and pushes at the tool.

    python tests/bench/rule_table.py --data DIR --work build/rule [--days 4] [--hours 1] [--arms paper6,seven]

A row is an arm and the length of its fit. Fitted is one day, judged are others (``simulated_days.py``). A run goes on
where it was ended; ``--tables`` prints the tables of what is kept.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from changed_logs import judged, prepared
from simulated_days import Arm, Push, arm_of, day

from collaudit.core.data.audit_result import Audit, FrictionFile
from collaudit.core.data.signals import State
from collaudit.core.fitting import fit_logs
from collaudit.core.numeric.arrays import whole_window_minima
from collaudit.core.numeric.null_tail import ZERO_DOUBT_NM, block_peaks

ARMS = ("paper6", "seven", "ur10_robot.urdf", "panda.urdf")
FITTED_S = (30.0, 100.0, 300.0, 1200.0)
#: One clean log, and one with pushes, s; N at the tool, and how often.
CLEAN_S, LOG_S, PUSH_N, EVERY_S = 1200.0, 600.0, 25.0, 3.0


def measured(arm: Arm, seconds: float, seed: int, logs: int) -> dict[str, Any]:
    """One fit, and the days judged with it."""
    ready = prepared(day(arm, seed, seconds, first=True), arm.described)
    origin = arm.described.provenance(None, ready.robot.sha256)
    friction = fit_logs([ready], arm.described.config, origin)
    clean = [judged(day(arm, 1000 * seed + k, CLEAN_S), arm.described, friction) for k in range(1, logs + 1)]
    pushes = pushes_of(seed)
    pushed = judged(day(arm, 1000 * seed, LOG_S, pushes), arm.described, friction).result
    alarms = [(c.onset_s, c.onset_s + c.duration_s, c.detected_s) for c in pushed.collisions]
    delays = [_delay(alarms, push) for push in pushes]
    return {
        "hours": sum(one.result.log.duration_s for one in clean) / 3600.0,
        "contacts": [len(one.result.contacts) for one in clean],
        "near_misses": sum(len(one.result.near_misses) for one in clean),
        "verdicts": [one.result.verdict for one in clean],
        "times": [x for one in clean for x in reached(one, friction)],
        "times_motion": _times(clean[0]),
        "noticed_n": _noticed(clean[0]),
        "claimed": sum(one.levels[-1].false_alarms_ci95[1] for one in (friction.thresholds.joints.values()
                       if friction.thresholds else ()) if one.levels),
        "pushes": len(pushes), "found": sum(delay is not None for delay in delays),
    }  # fmt: skip


def pushes_of(seed: int) -> list[Push]:
    """Pushes from any direction, at any moment."""
    rng = np.random.default_rng([seed, 7])
    direction = rng.normal(size=(round(LOG_S / EVERY_S) - 2, 3))
    direction *= PUSH_N / np.linalg.norm(direction, axis=1)[:, None]
    return [
        Push(EVERY_S * (k + 1) + float(rng.uniform(0.0, 1.0)), (float(f[0]), float(f[1]), float(f[2])))
        for k, f in enumerate(direction)
    ]


def _delay(alarms: list[tuple[float, float, float]], push: Push) -> float | None:
    stop = push.start_s + push.lasts_s
    hits = [seen for a, b, seen in alarms if a < stop and b > push.start_s]
    return min(hits) - push.start_s if hits else None


def reached(audit: Audit, friction: FrictionFile) -> Iterator[float]:
    """By joint how many times the level that the fit told (its margin not counted) its motion reaches."""
    assert friction.thresholds is not None
    signals, n, period_s = audit.signals, audit.result.rule.n, audit.result.log.sample_period_s
    for j, joint in enumerate(signals.joint_names):
        known = friction.thresholds.joints.get(joint)
        if known is None or not known.levels:
            continue
        moving = signals.state[:, j] == State.JUDGED
        size = np.where(moving, np.abs(signals.residual_nm[:, j]), 0.0)
        peaks = block_peaks(whole_window_minima(size, n), moving, period_s)
        if peaks.size:
            level = known.levels[-1]
            yield float(peaks.max()) * level.margin / (level.gamma_nm - ZERO_DOUBT_NM)


def _times(audit: Audit) -> float:
    rule = audit.result.rule
    return float(np.median([rule.gamma_nm[joint] / level for joint, level in rule.motion_nm.items()] or [np.nan]))


def _noticed(audit: Audit) -> float | None:
    found = audit.result.sensitivity
    tools = [] if found is None or found.time is None else [f for f in found.forces if f.place == "tool"]
    return tools[0].at(found.time.share) if tools and found is not None and found.time is not None else None


def tables(kept: dict[str, Any]) -> Iterator[str]:
    """Clean motion and pushes; what other days reach."""
    yield (
        "| arm | fit, s | fits | h judged | contacts | an hour claimed, at most | logs that pass | near misses an hour "
        "| × motion | alarms from, N | 25 N found |"
    )
    yield "|---|---|---|---|---|---|---|---|---|---|---|"
    for arm in ARMS:
        for seconds in FITTED_S:
            rows = [one for name, one in kept.items() if name.startswith(f"{arm}, {seconds:g} s")]
            if not rows:
                continue
            hours, verdicts = sum(one["hours"] for one in rows), [v for one in rows for v in one["verdicts"]]
            force = [one["noticed_n"] for one in rows if one["noticed_n"] is not None]
            yield (
                f"| {arm.removesuffix('.urdf')} | {seconds:g} | {len(rows)} | {hours:.1f} "
                f"| {sum(sum(one['contacts']) for one in rows)} | {np.mean([one['claimed'] for one in rows]):.2g} "
                f"| {verdicts.count('pass')} of {len(verdicts)} "
                f"| {sum(one['near_misses'] for one in rows) / hours:.1f} "
                f"| {np.median([one['times_motion'] for one in rows]):.1f} "
                f"| {np.median(force) if force else np.nan:.1f} "
                f"| {sum(one['found'] for one in rows)} of {sum(one['pushes'] for one in rows)} |"
            )
    yield ""
    yield "| fit, s | joints of other days | half reach, times the level | 90 % | 95 % | 99 % | most |"
    yield "|---|---|---|---|---|---|---|"
    for seconds in FITTED_S:
        times = [x for name, one in kept.items() if f", {seconds:g} s" in name for x in one["times"]]
        if times:
            shares = " | ".join(f"{x:.2f}" for x in np.quantile(times, (0.5, 0.9, 0.95, 0.99, 1.0)))
            yield f"| {seconds:g} | {len(times)} | {shares} |"


def main() -> None:
    """Measure what is not kept yet, and print the tables."""
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("--data", type=Path, required=True)
    asked.add_argument("--work", type=Path, default=Path("build/rule"))
    asked.add_argument("--arms", default=",".join(ARMS))
    asked.add_argument("--lengths", default=",".join(f"{x:g}" for x in FITTED_S))
    asked.add_argument("--days", type=int, default=2)
    asked.add_argument("--seed", type=int, default=1, help="of the first day")
    asked.add_argument("--hours", type=float, default=0.5, help="judged for each fit")
    asked.add_argument("--tables", action="store_true")
    given = asked.parse_args()
    given.work.mkdir(parents=True, exist_ok=True)
    file = given.work / "rule_table.json"
    kept: dict[str, Any] = json.loads(file.read_text(encoding="utf-8")) if file.exists() else {}
    logs = max(1, round(given.hours * 3600.0 / CLEAN_S))
    for seed in range(given.seed, given.seed + given.days):
        for seconds in map(float, given.lengths.split(",")):
            for name in given.arms.split(","):
                key = f"{name}, {seconds:g} s, {seed}"
                if not given.tables and key not in kept:
                    arm = arm_of(name, given.work, given.data / "urdf")
                    kept[key] = measured(arm, seconds, seed, logs)
                    file.write_text(json.dumps(kept), encoding="utf-8")
    print("\n".join(tables(kept)))


if __name__ == "__main__":
    main()
