"""Sensitivity over time as text: what would have been noticed on each joint, and along the arm."""

from __future__ import annotations

from collections.abc import Sequence

from collaudit.core.data.audit_result import AuditResult
from collaudit.core.data.sensitivity_result import ForceSensitivity, JointSensitivity, TimeShares
from collaudit.core.dataclass import dataclass
from collaudit.reports.values.numbers import apart, duration, percent, significant, stated
from collaudit.reports.values.rows import NONE
from collaudit.reports.values.words import reason_text, torque_unit

#: Shares of the time that tables show.
SHOWN = (0.5, 0.95)


@dataclass(frozen=True, slots=True)
class SensitivityRow:
    """What would have been noticed on one joint.

    ``detectable``, ``hidden`` and ``not_judged`` are shares of the time to judge; ``half``, ``most`` and ``always``
    the torques that would have alarmed in half, in 95 % and in all of the time in which anything can be told.
    """

    joint: str
    asked: str
    detectable: str
    in_motion: str
    hidden: str
    not_judged: str
    half: str
    most: str
    always: str
    reasons: tuple[tuple[str, str], ...]


@dataclass(frozen=True, slots=True)
class ForceRow:
    """What force would have been noticed at a place, from 95 % and from half of the directions."""

    place: str
    joints: str
    most: str
    typical: str


def sensitivity_row(joint: str, result: AuditResult) -> SensitivityRow | None:
    """A joint's sensitivity as text; None for joints that were not watched and for files of earlier versions."""
    s = None if result.sensitivity is None else result.sensitivity.joints.get(joint)
    if s is None:
        return None
    unit = torque_unit(result, joint)
    levels = {level.share: level.torque_nm for level in s.levels}
    half, most, always = (
        NONE if value is None else f"{_beside(value, s.observable_nm)} {unit}"
        for value in (*(levels.get(share) for share in SHOWN), s.largest_nm)
    )
    return SensitivityRow(
        joint=joint,
        asked=f"{stated(s.observable_nm) if s.observable_stated else significant(s.observable_nm)} {unit}",
        detectable=_share(s.all.detectable_s, s.all),
        in_motion=_share(s.motion.detectable_s, s.motion),
        hidden=_share(s.all.hidden_s, s.all),
        not_judged=_share(s.all.not_judged_s, s.all),
        half=half,
        most=most,
        always=always,
        reasons=_reasons(joint, result),
    )


def sensitivity_rows(result: AuditResult) -> list[SensitivityRow]:
    """The watched joints' sensitivity as text."""
    made = (sensitivity_row(joint, result) for joint in result.coverage.joints)
    return [row for row in made if row is not None]


def force_rows(result: AuditResult) -> list[ForceRow]:
    """What force would have been noticed along the arm, base to tool."""
    places: Sequence[ForceSensitivity] = () if result.sensitivity is None else result.sensitivity.arm
    out = []
    for place in places:
        level = next((level for level in place.levels if level.share == SHOWN[1]), None)
        most, typical = (None, None) if level is None else (level.force_n, level.typical_n)
        out.append(ForceRow(place.place, ", ".join(place.joints), _newtons(most), _newtons(typical)))
    return out


def joint_time(result: AuditResult) -> TimeShares | None:
    """Time of all watched joints together; None for files of earlier versions and where nothing was watched.

    Time in which one of them was not watched, as under force control, counts as not judged here.
    """
    joints: dict[str, JointSensitivity] = {} if result.sensitivity is None else dict(result.sensitivity.joints)
    if not joints:
        return None
    times = [joint.all for joint in joints.values()]
    away = sum(result.coverage.joints[joint].not_judged_s.get("not-watched", 0.0) for joint in joints)
    return TimeShares(
        sum(t.time_s for t in times) + away,
        sum(t.detectable_s for t in times),
        sum(t.hidden_s for t in times),
        sum(t.not_judged_s for t in times) + away,
    )


def _beside(value: float, limit: float) -> str:
    """A torque in three digits, or as many as it takes to differ from what was asked for."""
    text = significant(value)
    return apart([value, limit], 1)[0] if text == significant(limit) and value != limit else text


def _reasons(joint: str, result: AuditResult) -> tuple[tuple[str, str], ...]:
    found = sorted(result.coverage.joints[joint].not_judged_s.items(), key=lambda item: (-item[1], item[0]))
    return tuple((reason_text(code), duration(seconds)) for code, seconds in found if seconds > 0)


def _share(part: float, time: TimeShares) -> str:
    return percent(part / time.time_s) if time.time_s > 0 else NONE


def _newtons(force: float | None) -> str:
    return "no force alarms" if force is None else f"{force:.0f} N" if force >= 1000 else f"{significant(force)} N"
