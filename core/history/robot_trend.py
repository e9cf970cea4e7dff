"""What the nights of one robot show: levels and rates, changes with their likely causes, and what cannot be told."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.special import gammaincinv as gamma_quantile

from collaudit.core.history.joint_series import TESTED, NightSeries, Quantity, joint_series
from collaudit.core.history.log_record import LogRecord
from collaudit.core.history.series_changes import FEWEST, Change, series_changes

Cause = Literal[
    "wear-like growth", "friction step", "friction fell", "payload or tool", "temperature", "common cause", "residual"
]
#: Friction that changes in this share of the joints at once has a cause that they share.
_COMMON, _COMMON_LEAST = 0.5, 3


@dataclass(frozen=True, slots=True)
class Event:
    """Changes of one robot that begin together, and what they look like.

    Attributes:
        cause: what it looks like.
        changes: of one or several quantities and joints; the leading one is first.
        text: in a sentence or two, with what would not be told apart.
    """

    cause: Cause
    changes: tuple[Change, ...]
    text: str


@dataclass(frozen=True, slots=True)
class RateOfNights:
    """Counts over judged hours with an exact 95 % Poisson interval, per hour; None without hours."""

    count: int
    hours: float
    per_hour: float | None
    ci95: tuple[float, float] | None


@dataclass(frozen=True, slots=True, eq=False)
class RobotTrend:
    """One robot over its nights.

    Attributes:
        robot: its name.
        nights: ISO dates with a log.
        logs, not_judged: of the logs, and those of them that were not judged.
        contacts, near_misses: rates.
        verdicts: verdict to count.
        series: joint to quantity to series.
        events: what changed, earliest first.
        undetermined: what the nights do not allow to say.
    """

    robot: str
    nights: tuple[str, ...]
    logs: int
    not_judged: int
    contacts: RateOfNights
    near_misses: RateOfNights
    verdicts: Mapping[str, int]
    series: Mapping[str, Mapping[Quantity, NightSeries]]
    events: tuple[Event, ...]
    undetermined: tuple[str, ...]


def robot_trends(records: Sequence[LogRecord]) -> tuple[RobotTrend, ...]:
    """The trend of every robot, by name.

    Args:
        records: one a log, the one that counts.
    """
    by_robot: dict[str, list[LogRecord]] = {}
    for record in records:
        by_robot.setdefault(record.robot, []).append(record)
    joints = {robot: _joints(own) for robot, own in by_robot.items()}
    tests = len(TESTED) * sum(len(names) for names in joints.values())
    return tuple(_trend(robot, by_robot[robot], joints[robot], tests) for robot in sorted(by_robot))


def _joints(records: Sequence[LogRecord]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(item.joint for record in records for item in record.joints if item.watched))


def _trend(robot: str, records: Sequence[LogRecord], joints: Sequence[str], tests: int) -> RobotTrend:
    quantities: tuple[Quantity, ...] = (*TESTED, "margin")
    series = {joint: {q: joint_series(records, joint, q) for q in quantities} for joint in joints}
    changes = [c for joint in joints for q in TESTED for c in series_changes(series[joint][q], joint, tests)]
    hours = sum(record.judged_h for record in records)
    nights = tuple(sorted({record.night for record in records}))
    verdicts = {word: sum(r.verdict == word for r in records) for word in ("fail", "not_judged", "pass")}
    return RobotTrend(
        robot=robot,
        nights=nights,
        logs=len(records),
        not_judged=verdicts["not_judged"],
        contacts=rate_of(sum(len(r.contacts) for r in records), hours),
        near_misses=rate_of(sum(len(r.near_misses) for r in records), hours),
        verdicts=verdicts,
        series=series,
        events=tuple(sorted(_events(changes, joints), key=lambda e: (e.changes[0].night, e.cause))),
        undetermined=_undetermined(records, series, nights),
    )


def rate_of(count: int, hours: float) -> RateOfNights:
    """A count over hours; the interval of Garwood (Biometrika 28, 1936)."""
    if hours <= 0:
        return RateOfNights(count, hours, None, None)
    low = float(gamma_quantile(count, 0.025)) if count else 0.0
    return RateOfNights(count, hours, count / hours, (low / hours, float(gamma_quantile(count + 1, 0.975)) / hours))


def _events(changes: Sequence[Change], joints: Sequence[str]) -> list[Event]:
    """Changes grouped by cause: load first, then friction; a residual that rises with them is theirs."""
    left = list(changes)
    out: list[Event] = []
    while loads := [c for c in left if c.quantity in ("load", "offset")]:
        lead = min(loads, key=lambda c: c.chance)
        group = [lead, *(c for c in left if c is not lead and _together(c, lead))]
        left = [c for c in left if c not in group]
        out.append(_load_event(group))
    friction = [c for c in left if c.quantity == "friction"]
    while friction:
        lead = min(friction, key=lambda c: c.chance)
        same = [c for c in friction if _together(c, lead) and c.grown * lead.grown > 0]
        shared = len(same) >= max(_COMMON_LEAST, _COMMON * len(joints))
        group = same if shared else [lead]
        friction = [c for c in friction if c not in group]
        follows = [c for c in left if c.quantity == "residual" and any(_follows(c, f) for f in group)]
        left = [c for c in left if c not in group and c not in follows]
        out.append(_friction_event([*group, *follows], shared))
    for rest in (c for c in left if c.quantity == "residual"):
        words = "rose" if rest.grown > 0 else "fell"
        text = f"The clean residual of {rest.joint} {words}, and neither friction nor load of this joint explains it."
        out.append(Event("residual", (rest,), text))
    return out


def _together(a: Change, b: Change) -> bool:
    """Whether two changes may have begun on the same night."""
    return a.night_ci95[0] <= b.night_ci95[1] and b.night_ci95[0] <= a.night_ci95[1]


def _follows(residual: Change, friction: Change) -> bool:
    """A residual follows friction of its joint at once, or later, when it stands out."""
    return residual.joint == friction.joint and residual.night_ci95[1] >= friction.night_ci95[0]


def _load_event(group: Sequence[Change]) -> Event:
    names = ", ".join(dict.fromkeys(c.joint for c in group))
    text = (
        f"Torque that does not depend on the direction of motion changed ({names}): another tool or payload, or a "
        "wrong one stated. "
    )
    if any(c.quantity == "friction" for c in group):
        text += "Friction changed with it, as friction that depends on load does; wear cannot be told from that here."
    return Event("payload or tool", tuple(group), text.strip())


def _friction_event(group: Sequence[Change], shared: bool) -> Event:
    lead = group[0]
    names = ", ".join(dict.fromkeys(c.joint for c in group if c.quantity == "friction"))
    since = {
        "not known": "The logs hold no temperature: a colder arm cannot be told from wear.",
        "does not explain it": "Temperature does not explain it.",
        "explains it": "Temperature explains it as well: it is not counted as wear.",
    }[lead.temperature]
    if lead.temperature == "explains it":
        return Event("temperature", tuple(group), f"Friction of {names} changed with its temperature. {since}")
    if shared:
        text = f"Friction of {names} changed together: a cause that the joints share, such as temperature of the hall, "
        return Event("common cause", tuple(group), text + f"current scale or software, not wear of one. {since}")
    if lead.grown < 0:
        text = f"Friction of {names} fell: running in, new grease, a repair, or a warmer joint. {since}"
        return Event("friction fell", tuple(group), text)
    load = "The load did not change with it. "
    if lead.shape == "step":
        text = f"Friction of {names} rose from one night to the next: damage, a brake that drags, or a part changed. "
        return Event("friction step", tuple(group), text + load + since)
    return Event("wear-like growth", tuple(group), f"Friction of {names} grows, as it does with wear. {load}{since}")


def _undetermined(
    records: Sequence[LogRecord], series: Mapping[str, Mapping[Quantity, NightSeries]], nights: Sequence[str]
) -> tuple[str, ...]:
    out = []
    if len(nights) < FEWEST:
        out.append(
            f"Changes: {len(nights)} nights; with fewer than {FEWEST} no change can be distinguished from chance."
        )
    short = [joint for joint, own in series.items() if 0 < len(own["friction"].nights) < FEWEST <= len(nights)]
    none = [joint for joint, own in series.items() if not own["friction"].nights]
    if short:
        out.append(f"Changes of friction of {', '.join(short)}: friction is known of fewer than {FEWEST} nights.")
    if none:
        out.append(f"Friction of {', '.join(none)}: no night separates it from load and offset.")
    if series and not any(np.isfinite(own["friction"].temperature_c).any() for own in series.values()):
        out.append("Temperature: the logs hold none, so colder nights and wear look the same.")
    own_fits = sum(record.verdict != "not_judged" and record.friction_sha256 is None for record in records)
    if own_fits:
        out.append(
            f"Load, offset: {own_fits} logs were judged with friction fitted on themselves; only a friction file "
            "shows what changed beside it."
        )
    unread = sum(record.night_from == "audit" for record in records)
    if unread:
        out.append(f"The night of {unread} logs: they hold no date, and count to the day of their audit.")
    return tuple(out)
