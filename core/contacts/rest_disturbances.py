"""Disturbances of an arm at rest: the steps of its standing joints that belong together and are no contact."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from collaudit.core.data.detection_result import DisturbedJoint, RestDisturbance
from collaudit.core.detection.rest_steps import RestStep
from collaudit.core.findings import Finding
from collaudit.core.findings.finding_kinds import Severity

#: Steps closer than this are one disturbance; contacts this close are the same event, s.
_TOGETHER_S, _NEAR_CONTACT_S = 0.7, 0.5
_LISTED = 5


def rest_disturbances(
    steps: Sequence[RestStep], names: Sequence[str], contacts: Sequence[tuple[float, float]]
) -> tuple[RestDisturbance, ...]:
    """Disturbances of standing joints that are no contact already, in order of time.

    Args:
        steps: of single joints.
        names: of the joints, base to tip.
        contacts: start and end of those that were found, s.
    """
    apart = [
        step
        for step in steps
        if not any(
            step.onset_s < end + _NEAR_CONTACT_S and start - _NEAR_CONTACT_S < step.end_s for start, end in contacts
        )
    ]
    return tuple(_grouped(apart, names))


def _grouped(found: Sequence[RestStep], names: Sequence[str]) -> list[RestDisturbance]:
    """Disturbances of joints that overlap in time are one."""
    groups: list[tuple[float, float, list[DisturbedJoint]]] = []
    for step in sorted(found, key=lambda step: (step.onset_s, names.index(step.joint.joint))):
        a, b, one = step.onset_s, step.end_s, step.joint
        if groups and a <= groups[-1][1] + _TOGETHER_S:
            first, last, members = groups[-1]
            groups[-1] = (first, max(last, b), [*members, one])
        else:
            groups.append((a, b, [one]))
    return [RestDisturbance(a, b, tuple(_largest(members, names))) for a, b, members in groups]


def _largest(members: Sequence[DisturbedJoint], names: Sequence[str]) -> list[DisturbedJoint]:
    """The largest step of each joint, base to tip."""
    by_joint: Mapping[str, list[DisturbedJoint]] = {n: [m for m in members if m.joint == n] for n in names}
    return [max(its, key=lambda m: abs(m.torque_step_nm)) for its in by_joint.values() if its]


def disturbance_findings(found: Sequence[RestDisturbance], allowed: int) -> list[Finding]:
    """One finding on all of them; an error, with which no log passes, where there are more than are allowed.

    Args:
        found: of one log.
        allowed: how many a log may have.
    """
    if not found:
        return []
    listed = "; ".join(_words(one) for one in found[:_LISTED])
    more = f"; and {len(found) - _LISTED} more" if len(found) > _LISTED else ""
    once = "once" if len(found) == 1 else f"{len(found)} times"
    text = (
        f"Standing joints were pushed or released {once}, too weakly to alarm ({listed}{more}): the joint gave way and "
        "its drive pushed back. Friction hides how strong it was."
    )
    severity: Severity = "warning" if len(found) <= allowed else "error"
    return [Finding("disturbed-at-rest", severity, text, start_s=found[0].onset_s, end_s=found[-1].end_s)]


def _words(one: RestDisturbance) -> str:
    steps = ", ".join(f"{joint.joint} by {abs(joint.torque_step_nm):.2g} N·m" for joint in one.joints)
    return f"{one.onset_s:.2f} s: {steps}"
