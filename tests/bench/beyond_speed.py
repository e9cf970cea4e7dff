"""Pushes on joints that move faster than friction was fitted: found, raised above them, blind, or silently missed.

    python tests/bench/beyond_speed.py LOGS DOCS SEED...

LOGS: as of ``detection_table.py``; DOCS: the page with the table ("-": none). Friction is fitted anew to the points
slower than each of some speeds, and ``free-hits`` is judged by it. A push counts once for each joint that it
brings above γ for n samples while the joint moves more than 5 % faster than that.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from detection_runs import Bench, bench, friction_of, simulated
from tables import put

from collaudit.core.data.audit_result import Collision, FrictionFile, NearMiss
from collaudit.core.data.signals import State
from collaudit.core.friction.friction_fitting import fit_friction
from collaudit.core.friction.law_candidates import FrictionUnits
from collaudit.core.scoring.detection_score import TrueEvent, read_truth, true_events

CUTS_RAD_S = (0.9, 0.6, 0.3, 0.15)
_FAST, _HIDDEN = 1.05, 0.3
#: What may become of a push; the last must not be.
OUTCOMES = ("alarm", "threshold raised", "not judged", "range of friction", "near miss", "silent")


def slower(friction: FrictionFile, cut_rad_s: float) -> FrictionFile:
    """Friction as it would be known had nothing moved faster."""
    units = FrictionUnits.of("revolute", "Nm")
    joints = {
        name: fit_friction([p for p in fit.points if p.speed_rad_s <= cut_rad_s], units)
        for name, fit in friction.joints.items()
    }
    return replace(friction, joints=joints)


def outcomes(made: Bench, cut_rad_s: float) -> Iterator[str]:
    """What became of each push on each joint that was too fast."""
    run = made.judged("direct", False)
    series, rule = made.prepared.judged_series, made.inputs.rule
    limit = run.gamma_nm + run.residual.uncertainty_nm
    for event in true_events(read_truth(made.truth), series.joint_names):
        a, b = np.searchsorted(series.time_s, [event.onset_s, event.end_s])
        for joint in event.required:
            j = series.joint_names.index(joint)
            if np.median(np.abs(series.velocity_rad_s[a:b, j])) <= _FAST * cut_rad_s:
                continue
            state = run.detected.state[a:b, j]
            if _told(event, joint, run.detected.collisions):
                yield "alarm"
            elif np.mean(state > State.FRICTION_INTERVAL) > _HIDDEN:
                yield "not judged"
            elif np.mean(state == State.FRICTION_INTERVAL) > _HIDDEN:
                yield "range of friction"
            elif np.median(limit[a:b, j]) > _FAST * rule.gamma_nm[joint]:
                yield "threshold raised"
            else:
                yield "near miss" if _told(event, joint, run.detected.near_misses) else "silent"


def _told(event: TrueEvent, joint: str, found: Sequence[Collision | NearMiss]) -> bool:
    return any(one.joint == joint and event.covers(one.onset_s) for one in found)


def false_alarms(made: Bench) -> int:
    """Alarms that belong to no push."""
    known = true_events(read_truth(made.truth), made.prepared.judged_series.joint_names)
    run = made.judged("direct", False)
    return sum(not any(event.covers(c.onset_s) for event in known) for c in run.detected.collisions)


def table(logs: Path, seeds: Sequence[int]) -> Iterator[str]:
    """The table of docs/evidence.md."""
    yield "| arm | friction known up to, rad/s | " + " | ".join(OUTCOMES) + " | false alarms |"
    yield "|---|---|" + "---|" * (len(OUTCOMES) + 1)
    for arm in ("paper6", "seven"):
        friction = friction_of(logs, arm)
        made = [bench(simulated(logs, arm, "free-hits", seed), friction) for seed in seeds]
        for cut in CUTS_RAD_S:
            cold = [one.with_friction(slower(friction, cut)) for one in made]
            found = Counter(what for one in cold for what in outcomes(one, cut))
            false = sum(false_alarms(one) for one in cold)
            yield f"| {arm} | {cut} | " + " | ".join(str(found[what]) for what in OUTCOMES) + f" | {false} |"


if __name__ == "__main__":
    lines = []
    for line in table(Path(sys.argv[1]), [int(seed) for seed in sys.argv[3:]]):
        print(line, flush=True)
        lines.append(line)
    if sys.argv[2] != "-":
        put(Path(sys.argv[2]), "beyond", lines)
