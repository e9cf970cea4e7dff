"""The (gamma, n) planes of several logs as one: alarms and clean hours add up, on the rules that all grids share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from collaudit.core.data.rule_study_result import JointPlane, PlanePoint, RuleStudy
from collaudit.core.rule_study.joint_plane import alarm_rates
from collaudit.core.rule_study.plane_frontier import frontier


def pooled_planes(studies: Sequence[RuleStudy], longest_delay_s: float | None = None) -> dict[str, JointPlane]:
    """One plane for each joint of several logs.

    Alarms are exact, as they are in the plane of each log. Torque and delay are those of the log that needs most.

    Args:
        studies: of the logs.
        longest_delay_s: as of :func:`plane_frontier.frontier`.

    Returns:
        Joints whose grids share thresholds and persistences; a configured rule stands where all logs have the same.
    """
    joints = dict.fromkeys(joint for study in studies for joint in study.joints)
    by_joint = {joint: [study.joints[joint] for study in studies if joint in study.joints] for joint in joints}
    found = {joint: _pooled(planes, longest_delay_s) for joint, planes in by_joint.items()}
    return {joint: plane for joint, plane in found.items() if plane is not None}


def _pooled(planes: Sequence[JointPlane], longest_delay_s: float | None) -> JointPlane | None:
    if len(planes) == 1:
        return planes[0]
    gammas = sorted(set(planes[0].gamma_nm).intersection(*(plane.gamma_nm for plane in planes[1:])))
    counts = sorted(set(planes[0].n).intersection(*(plane.n for plane in planes[1:])))
    if not gammas or not counts:
        return None
    cut = [_cut(plane, gammas, counts) for plane in planes]
    rows, columns = range(len(gammas)), range(len(counts))
    pooled = JointPlane(
        gamma_nm=tuple(gammas),
        n=tuple(counts),
        clean_hours=sum(plane.clean_hours for plane in cut),
        alarms=tuple(tuple(sum(plane.alarms[g][c] for plane in cut) for c in columns) for g in rows),
        torque_nm=tuple(tuple(_most([plane.torque_nm[g][c] for plane in cut]) for c in columns) for g in rows),
        delay_s=tuple(tuple(_most([plane.delay_s[g][c] for plane in cut]) for c in columns) for g in rows),
        moments=sum(plane.moments for plane in cut),
        configured=None,
        chosen=None,
        frontier=(),
    )
    return replace(pooled, frontier=frontier(pooled, longest_delay_s), configured=_configured(planes))


def _cut(plane: JointPlane, gammas: Sequence[float], counts: Sequence[int]) -> JointPlane:
    """The plane on some of its rules."""
    rows, columns = [plane.gamma_nm.index(g) for g in gammas], [plane.n.index(n) for n in counts]
    return replace(
        plane,
        alarms=tuple(tuple(plane.alarms[g][c] for c in columns) for g in rows),
        torque_nm=tuple(tuple(plane.torque_nm[g][c] for c in columns) for g in rows),
        delay_s=tuple(tuple(plane.delay_s[g][c] for c in columns) for g in rows),
    )


def _most(values: Sequence[float | None]) -> float | None:
    """The largest; None where one is not known."""
    known = [value for value in values if value is not None]
    return max(known) if len(known) == len(values) else None


def _configured(planes: Sequence[JointPlane]) -> PlanePoint | None:
    """The rule that is set over all logs; None where they differ in it."""
    points = [plane.configured for plane in planes if plane.configured is not None]
    if len(points) < len(planes) or len({(point.gamma_nm, point.n) for point in points}) > 1:
        return None
    alarms, hours = sum(point.alarms for point in points), sum(plane.clean_hours for plane in planes)
    rate, upper = alarm_rates(np.array([alarms]), hours)
    known = hours > 0
    return replace(
        points[0],
        alarms=alarms,
        alarms_per_hour=float(rate[0]) if known else None,
        alarms_per_hour_upper95=float(upper[0]) if known else None,
        torque_nm=_most([point.torque_nm for point in points]),
        delay_s=_most([point.delay_s for point in points]),
    )
