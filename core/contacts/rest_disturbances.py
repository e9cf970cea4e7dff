"""Disturbances of an arm at rest: the steps of its standing joints that belong together and are no contact."""

from __future__ import annotations

from collections.abc import Sequence

from collaudit.core.data.detection_result import RestDisturbance
from collaudit.core.detection.rest_steps import RestStep
from collaudit.core.findings import Finding
from collaudit.core.findings.finding_kinds import Severity

#: Steps closer than this are one disturbance; contacts this close are the same event, s.
_TOGETHER_S, _NEAR_CONTACT_S = 0.7, 0.5
_LISTED = 5


def rest_disturbances(
    steps: Sequence[RestStep], names: Sequence[str], contacts: Sequence[tuple[float, float]]
) -> tuple[RestDisturbance, ...]:
    """Disturbances of standing joints that are no contact already, in order of time: steps that overlap are one.

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
    groups: list[list[RestStep]] = []
    for step in sorted(apart, key=lambda step: (step.onset_s, names.index(step.joint.joint))):
        if groups and step.onset_s <= max(one.end_s for one in groups[-1]) + _TOGETHER_S:
            groups[-1].append(step)
        else:
            groups.append([step])
    found = []
    for group in groups:
        its = ([one.joint for one in group if one.joint.joint == name] for name in names)
        largest = tuple(max(one, key=lambda joint: abs(joint.torque_step_nm)) for one in its if one)
        found.append(RestDisturbance(group[0].onset_s, max(one.end_s for one in group), largest))
    return tuple(found)


def disturbance_findings(found: Sequence[RestDisturbance], allowed: int) -> list[Finding]:
    """One finding on all of them; an error, with which no log passes, where there are more than are allowed.

    Args:
        found: of one log.
        allowed: how many a log may have.
    """
    if not found:
        return []
    steps = [", ".join(f"{j.joint} by {abs(j.torque_step_nm):.2g} N·m" for j in one.joints) for one in found[:_LISTED]]
    listed = "; ".join(f"{one.onset_s:.2f} s: {text}" for one, text in zip(found, steps, strict=False))
    more = f"; and {len(found) - _LISTED} more" if len(found) > _LISTED else ""
    once = "once" if len(found) == 1 else f"{len(found)} times"
    text = (
        f"Standing joints were pushed or released {once}, too weakly to alarm ({listed}{more}): the joint gave way and "
        "its drive pushed back. Friction hides how strong it was."
    )
    severity: Severity = "warning" if len(found) <= allowed else "error"
    return [Finding("disturbed-at-rest", severity, text, start_s=found[0].onset_s, end_s=found[-1].end_s)]
