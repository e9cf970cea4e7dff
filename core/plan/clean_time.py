"""Clean hours: how long the arm must move without contact for thresholds at a rate of false alarms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf

import numpy as np

from collaudit.core.data.audit_result import Audit, FrictionFile
from collaudit.core.data.plan_result import CleanTime
from collaudit.core.recommend.arm_evidence import gather_evidence
from collaudit.core.recommend.joint_thresholds import REACH, joint_evidence, threshold_with_hours
from collaudit.core.recommend.tail_fit import JointTail

_STEPS = 48  # hours that are looked at, from those at hand to a hundred times those that support the rate


def clean_times(
    names: Sequence[str], audits: Sequence[Audit], friction: FrictionFile | None, per_hour: float, more_h: float,
    gamma_nm: float | None,
) -> dict[str, CleanTime]:  # fmt: skip
    """Clean hours of every joint.

    Args:
        names: joints.
        audits: judged logs, whose clean residuals tell thresholds.
        friction: of earlier logs; its clean time counts where there are no audits.
        per_hour: false alarms of the arm that are accepted.
        more_h: clean hours that the planned motion adds.
        gamma_nm: threshold asked for, N·m.
    """
    enough = 1.0 / (REACH * per_hour)
    tails, hours = _tails(audits) if audits else ({}, _fitted_hours(friction))
    out = {}
    for name in names:
        tail, known = tails.get(name), hours.get(name, 0.0)
        now, after = ((None, None) if tail is None else (
            threshold_with_hours(tail, per_hour, len(tails), tail.hours),
            threshold_with_hours(tail, per_hour, len(tails), tail.hours + more_h),
        ))  # fmt: skip
        needed = None if tail is None or gamma_nm is None else _hours_for(tail, per_hour, len(tails), gamma_nm)
        out[name] = CleanTime(known, enough, now, after, needed)
    return out


def _tails(audits: Sequence[Audit]) -> tuple[dict[str, JointTail], dict[str, float]]:
    evidence = gather_evidence(audits)
    persistence = max(audit.result.rule.persistence_s for audit in audits)
    found = {joint: joint_evidence(evidence, joint, persistence) for joint in evidence.joints}
    tails = {joint: one.tail for joint, one in found.items() if one.tail is not None}
    return tails, {joint: one.peaks.hours for joint, one in found.items()}


def _fitted_hours(friction: FrictionFile | None) -> Mapping[str, float]:
    return {} if friction is None or friction.thresholds is None else {
        name: joint.hours for name, joint in friction.thresholds.joints.items()
    }  # fmt: skip


def _hours_for(tail: JointTail, per_hour: float, joints: int, gamma_nm: float) -> float | None:
    """The fewest hours, at hand or more, whose threshold is no higher; None where none of them is enough."""
    most = max(100.0 / (REACH * per_hour), 2.0 * tail.hours)
    for hours in np.geomspace(tail.hours, most, _STEPS):
        if (threshold_with_hours(tail, per_hour, joints, float(hours)) or inf) <= gamma_nm:
            return float(hours)
    return None
