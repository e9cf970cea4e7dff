"""One row of the table of nights: a joint in one log of a robot, as judged. What a store keeps (schema 4).

Also what the logs of a night say of a joint together, and whether a value changed over nights.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import sqrt
from typing import Literal

import numpy as np
from scipy.special import stdtrit as student_quantile

from collaudit.core.data.audit_result import AuditResult
from collaudit.core.data.friction_result import FrictionFit
from collaudit.core.friction.friction_model import FrictionModel

STORE_SCHEMA = 4
NightFrom = Literal["stated", "log", "audit"]


@dataclass(frozen=True, slots=True)
class JointContact:
    """A contact in which a joint alarmed.

    Attributes:
        number: of the contact in its log, from 1: rows of several joints share it.
        onset_s: s from the log's first sample.
        peak_nm: highest residual of the joint.
        place_m: (x, y, z) of the tool at the peak, in the base; None where it is not known.
        state: of the contact that night.
    """

    number: int
    onset_s: float
    peak_nm: float
    place_m: tuple[float, float, float] | None
    state: str


@dataclass(frozen=True, slots=True)
class NightRow:
    """One joint in one log; a log that could not be judged at all has one row, without a joint.

    Attributes:
        robot: whose log it is.
        night: ISO date that the log counts to; ``night_from``: stated, of the log's first stamp (UTC), or of the audit,
            where the log tells no date.
        log, log_sha256: name and hash; the hash is None where the log could not be read.
        start: ISO 8601 UTC or None.
        verdict, why: of the log, and the reasons in one text.
        joint: its name, None for a log without judged joints.
        tested: whether any of the joint's time was judged: without, no contact says nothing.
        judged_s: so much of it, s.
        level_nm: mean size of the residual away from events; None where nothing was judged.
        gamma_nm: threshold in usual motion, None without one.
        friction_nm: at the middle of the speeds that its law was measured at, as the residual followed it (the law's
            value times the level of friction in this log); None without a law.
        near_misses: of the joint.
        contacts: in which the joint alarmed.
        config_sha256, friction_sha256: what it was judged with; None for friction fitted on the log itself.
        collaudit: version.
    """

    robot: str
    night: str
    night_from: NightFrom
    log: str
    log_sha256: str | None
    start: str | None
    verdict: str
    why: str
    joint: str | None
    tested: bool
    judged_s: float
    level_nm: float | None
    gamma_nm: float | None
    friction_nm: float | None
    near_misses: int
    contacts: tuple[JointContact, ...]
    config_sha256: str | None
    friction_sha256: str | None
    collaudit: str

    @property
    def identity(self) -> tuple[str, str]:
        """Rows with this alike are of the same log: those of the later audit count."""
        return self.robot, self.log_sha256 or f"{self.night} {self.log}"


def rows_of_result(result: AuditResult, robot: str, night: str, night_from: NightFrom) -> tuple[NightRow, ...]:
    """What a store keeps of an audit, a row a joint.

    Args:
        result: of the audit.
        robot: whose log it is.
        night, night_from: the night it counts to, and who says so.
    """
    return tuple(_row(result, joint, robot, night, night_from) for joint in (*result.coverage.joints,) or (None,))


def _row(result: AuditResult, joint: str | None, robot: str, night: str, night_from: NightFrom) -> NightRow:
    coverage = None if joint is None else result.coverage.joints[joint]
    stats = None if joint is None else result.residual.get(joint)
    judged_s = coverage.judged_s if coverage is not None and coverage.watched else 0.0
    return NightRow(
        robot=robot,
        night=night,
        night_from=night_from,
        log=result.log.name,
        log_sha256=result.log.sha256,
        start=result.log.start,
        verdict=result.verdict,
        why="; ".join(result.reasons),
        joint=joint,
        tested=judged_s > 0.0,
        judged_s=judged_s,
        level_nm=None if stats is None else stats.clean_mean_abs_nm,
        gamma_nm=None if joint is None else result.rule.gamma_nm.get(joint),
        friction_nm=None if joint is None else _friction_nm(result, joint),
        near_misses=sum(near.joint == joint for near in result.near_misses),
        contacts=tuple(
            JointContact(
                number,
                contact.onset_s,
                contact.peak_nm.get(joint, 0.0),
                None if contact.scene is None else contact.scene.points_m[-1],
                contact.state,
            )
            for number, contact in enumerate(result.contacts, 1)
            if joint is not None and joint in contact.joints
        ),
        config_sha256=result.provenance.config_sha256,
        friction_sha256=result.provenance.friction_sha256,
        collaudit=result.provenance.collaudit,
    )


def _friction_nm(result: AuditResult, joint: str) -> float | None:
    fit: FrictionFit | None = result.friction.get(joint)
    law = None if fit is None else FrictionModel.of(fit)
    if law is None or law.speed_range[0] <= 0:
        return None
    speed = sqrt(law.speed_range[0] * law.speed_range[1])
    facts = None if result.detection is None else result.detection.friction_level.get(joint)
    level = 1.0 if facts is None or facts.mean is None else facts.mean
    return level * float(np.mean(np.abs(law.torque(np.array([speed, -speed])))))


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
