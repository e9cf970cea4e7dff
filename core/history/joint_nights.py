"""Each joint's nights: what the logs of a night say of it together."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from collaudit.core.history.night_change import Change, change_of
from collaudit.core.history.night_row import NightRow


@dataclass(frozen=True, slots=True)
class JointNight:
    """One joint in one night.

    Attributes:
        night: ISO date.
        logs: of the robot that night in which the joint stands; ``tested`` of them.
        judged_s: judged time, s.
        level_nm, friction_nm: means over the logs, each by its judged time; None without any.
        gamma_nm: highest threshold; None without one.
        contacts, near_misses: counts.
    """

    night: str
    logs: int
    tested: int
    judged_s: float
    level_nm: float | None
    gamma_nm: float | None
    friction_nm: float | None
    contacts: int
    near_misses: int


@dataclass(frozen=True, slots=True)
class JointNights:
    """The nights of one joint of one robot, in their order.

    Attributes:
        robot, joint: names.
        nights: those in which a log has the joint.
        friction, level: whether they changed, by the logs of each night as replicates.
    """

    robot: str
    joint: str
    nights: tuple[JointNight, ...]
    friction: Change
    level: Change


def joint_nights(rows: Iterable[NightRow]) -> list[JointNights]:
    """The nights of every joint, by robot and joint.

    Args:
        rows: that count, each log once.
    """
    found: dict[tuple[str, str], dict[str, list[NightRow]]] = {}
    last: dict[str, str] = {}
    for row in rows:
        last[row.robot] = max(row.night, last.get(row.robot, ""))
        if row.joint is not None:
            found.setdefault((row.robot, row.joint), {}).setdefault(row.night, []).append(row)
    return [
        JointNights(
            robot,
            joint,
            tuple(_night(night, own) for night, own in sorted(nights.items())),
            friction=_change({night: [row.friction_nm for row in own] for night, own in nights.items()}, last[robot]),
            level=_change({night: [row.level_nm for row in own] for night, own in nights.items()}, last[robot]),
        )
        for (robot, joint), nights in sorted(found.items())
    ]


def _change(values: Mapping[str, Sequence[float | None]], last: str) -> Change:
    known = [(night, [value for value in of_logs if value is not None]) for night, of_logs in sorted(values.items())]
    return change_of([(night, of_logs) for night, of_logs in known if of_logs], last)


def _night(night: str, rows: Sequence[NightRow]) -> JointNight:
    return JointNight(
        night=night,
        logs=len(rows),
        tested=sum(row.tested for row in rows),
        judged_s=sum(row.judged_s for row in rows),
        level_nm=_mean([(row.level_nm, row.judged_s) for row in rows]),
        gamma_nm=max((row.gamma_nm for row in rows if row.gamma_nm is not None), default=None),
        friction_nm=_mean([(row.friction_nm, row.judged_s) for row in rows]),
        contacts=sum(len(row.contacts) for row in rows),
        near_misses=sum(row.near_misses for row in rows),
    )


def _mean(values: Sequence[tuple[float | None, float]]) -> float | None:
    known = [(value, weight) for value, weight in values if value is not None and weight > 0.0]
    total = sum(weight for _, weight in known)
    return sum(value * weight for value, weight in known) / total if known else None
