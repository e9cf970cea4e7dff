"""Each joint's nights: what the logs of a night say of it together, and whether a value changed over the nights."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import sqrt
from typing import Literal

import numpy as np
from scipy.special import stdtrit as student_quantile

from collaudit.core.history.night_row import NightRow

ChangeState = Literal["changed", "no change shown", "too few", "not tested"]
#: From so many nights on their scatter is known; of fewer only that of the logs within a night is.
_NIGHTS = 4


@dataclass(frozen=True, slots=True)
class Change:
    """A value over nights, as it divides best into before and after.

    Attributes:
        state: ``changed``: the intervals of before and after do not meet; ``no change shown``: they do; ``too few``
            nights or logs for an interval; ``not tested``: not in the last night of the robot.
        since: first night of after, ISO date; None unless changed.
        before, now: mean and the two ends of its interval (95 % over all divisions together); None where not known.
    """

    state: ChangeState
    since: str | None = None
    before: tuple[float, float, float] | None = None
    now: tuple[float, float, float] | None = None


def change_of(nights: Sequence[tuple[str, Sequence[float]]], last: str) -> Change:
    """Whether, and since when, a value is another.

    Of every division of the nights into before and after the one counts whose means differ most in their standard
    errors. A night's mean scatters with what nights differ by and, of n logs, a share 1/n of what its logs differ by.

    Args:
        nights: ISO date and the value in each log, in order; nights without any are left out.
        last: the last night of the robot.
    """
    if not nights or nights[-1][0] != last:
        return Change("not tested")
    means = np.array([np.mean(values) for _, values in nights])
    free = sum(len(values) - 1 for _, values in nights)
    within = sum(float(np.var(values)) * len(values) for _, values in nights) / free if free else 0.0
    of_logs = within * float(np.mean([1.0 / len(values) for _, values in nights]))
    freedom = means.size - 2 if means.size >= _NIGHTS else free
    if means.size < 2 or freedom < 1:
        return Change("too few")
    best: tuple[float, Change] | None = None
    reach = float(student_quantile(freedom, 1.0 - 0.025 / (means.size - 1)))
    for first in range(1, means.size):
        sides = (means[:first], means[first:])
        of_nights = sum(float(np.var(side)) * side.size for side in sides) / max(means.size - 2, 1)
        spread = max(of_logs, of_nights) if means.size >= _NIGHTS else of_logs
        before, now = (_bounds(side, reach * sqrt(spread / side.size)) for side in sides)
        apart = abs(now[0] - before[0]) / max(sqrt(spread * (1.0 / first + 1.0 / (means.size - first))), 1e-12)
        changed = now[1] > before[2] or now[2] < before[1]
        found = Change("changed" if changed else "no change shown", nights[first][0] if changed else None, before, now)
        if best is None or apart > best[0]:
            best = apart, found
    return Change("too few") if best is None else best[1]


def _bounds(values: np.ndarray, half_width: float) -> tuple[float, float, float]:
    mean = float(np.mean(values))
    return mean, mean - half_width, mean + half_width


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
