"""Rows of a rule study: what contacts are noticed, by which persistence, what thresholds are made of."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from collaudit.core.data.rule_study_result import (
    ContactSensitivity,
    DynamicGain,
    ForceNoticed,
    JointPlane,
    PersistenceChoice,
    PlanePoint,
    RuleSensitivity,
    RuleStudy,
)
from collaudit.reports.values.numbers import percent, significant
from collaudit.reports.values.words import with_force_unit

NEVER = "none"
ANYWHERE = "anywhere"
#: Factors on the thresholds at which known contacts are shown.
_FACTORS = (0.5, 1.0, 2.0, 4.0, 8.0)
_CAUSES = {
    "noise": "sensor noise",
    "reversal": "friction at reversals",
    "friction": "friction over speed",
    "model": "model",
    "ripple": "ripple",
    "drift": "drift",
    "lag": "time lag",
    "rest": "left without them all",
}


@dataclass(frozen=True, slots=True)
class NoticedRow:
    """What one rule notices of one shape, in words."""

    rule: str
    shape: str
    where: str
    contacts: str
    half: str
    most: str
    blind: str
    delay: str


@dataclass(frozen=True, slots=True)
class PlaceTable:
    """What one rule notices by place and by motion: a row for each and each measure, a column for each shape."""

    rule: str
    shapes: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True, slots=True)
class PlaneRow:
    """One joint's rule in its plane, in words."""

    joint: str
    rule: str
    gamma: str
    n: str
    alarms: str
    torque: str
    delay: str


def noticed_rows(study: RuleStudy, *, places: bool = False, motions: bool = False) -> list[NoticedRow]:
    """What the rules notice, shape by shape; by place and by motion where that is asked for."""
    return [
        _noticed(rule, contact)
        for rule in study.rules
        for contact in rule.contacts
        if (contact.place is None or places) and (contact.motion is None or motions)
    ]


def place_tables(study: RuleStudy) -> Iterator[PlaceTable]:
    """What each rule notices by place and by motion; nothing where contacts were not told apart so."""
    for rule in study.rules:
        found = [(contact.shape, _noticed(rule, contact)) for contact in rule.contacts]
        told = {(row.where, shape): row for shape, row in found if row.where != ANYWHERE}
        shapes = tuple(dict.fromkeys(shape for _, shape in told))
        rows = tuple(
            (where, words, *(getattr(told[where, shape], field) if (where, shape) in told else "–" for shape in shapes))
            for where in dict.fromkeys(where for where, _ in told)
            for words, field in (("half", "half"), ("90 %", "most"), ("never", "blind"))
        )
        if rows:
            yield PlaceTable(rule.name, shapes, rows)


def _noticed(rule: RuleSensitivity, contact: ContactSensitivity) -> NoticedRow:
    by_share = {noticed.share: noticed for noticed in contact.noticed}
    return NoticedRow(
        rule=rule.name,
        shape=contact.shape,
        where=contact.place or contact.motion or ANYWHERE,
        contacts=str(contact.contacts),
        half=_force(by_share[0.5]),
        most=_force(by_share[0.9]),
        blind=percent(contact.blind),
        delay=milliseconds(contact.delay_s),
    )


def _force(noticed: ForceNoticed) -> str:
    if noticed.force_n is None:
        return NEVER
    low, high = noticed.ci95_n
    return f"{significant(noticed.force_n)} ({_open(low)} to {_open(high)})"


def _open(value: float | None) -> str:
    return "∞" if value is None else significant(value)


def milliseconds(seconds: float | None) -> str:
    """A delay as whole milliseconds; what looks ahead in time may be before the onset."""
    return "" if seconds is None else f"{1e3 * seconds:.0f}"


def plane_rows(planes: Mapping[str, JointPlane], units: Mapping[str, str]) -> list[PlaneRow]:
    """The configured and the recommended rule of every joint; ``units`` by joint, of what its drive exerts."""
    return [
        _plane(joint, name, point, units)
        for joint, plane in planes.items()
        for name, point in (("configured", plane.configured), ("recommended", plane.chosen))
        if point is not None
    ]


def _plane(joint: str, name: str, point: PlanePoint, units: Mapping[str, str]) -> PlaneRow:
    upper = point.alarms_per_hour_upper95
    return PlaneRow(
        joint=joint,
        rule=name,
        gamma=with_force_unit(significant(point.gamma_nm), joint, units),
        n=str(point.n),
        alarms=f"{point.alarms}" + ("" if upper is None else f" (at most {significant(upper)} an hour)"),
        torque=NEVER if point.torque_nm is None else with_force_unit(significant(point.torque_nm), joint, units),
        delay=milliseconds(point.delay_s),
    )


def choice_rows(choices: Sequence[PersistenceChoice]) -> Iterator[tuple[str, ...]]:
    """Persistences that were compared: n, ms, forces by shape, cost, mark."""
    for choice in choices:
        forces = tuple(NEVER if force is None else significant(force) for force in choice.force_n.values())
        cost = "" if choice.cost is None else f"{choice.cost:.2f}"
        mark = "recommended" if choice.chosen else ""
        yield (str(choice.n), milliseconds(choice.persistence_s), *forces, cost, mark)


def chosen_flags(study: RuleStudy) -> str | None:
    """The recommended rule as it is given to ``collaudit detect``; None where none is."""
    for choice in study.choices:
        if choice.chosen:
            gammas = ",".join(f"{joint}={gamma:g}" for joint, gamma in choice.gamma_nm.items())
            return f"--n {choice.n} --gamma {gammas}"
    return None


def part_rows(study: RuleStudy) -> Iterator[tuple[str, ...]]:
    """What each threshold is made of: joint, level, the causes by falling share, and last what is left."""
    for joint, parts in study.parts.items():
        shares = sorted(parts.parts, key=lambda part: part.cause == "rest")
        told = [f"{_CAUSES[p.cause]} {significant(p.gamma_nm, 2)}" for p in shares if p.gamma_nm >= 0.005]
        yield joint, with_force_unit(significant(parts.level_nm), joint, study.units), ", ".join(told)


def dynamic_rows(study: RuleStudy) -> Iterator[tuple[str, str]]:
    """What a dynamic threshold would gain, by joint."""
    for joint, gain in study.dynamic.items():
        yield joint, _gain(gain, study.units.get(joint, "N·m"))


def _gain(gain: DynamicGain, unit: str) -> str:
    if gain.sensitivity_gain is None:
        return gain.why_not or ""
    if gain.sensitivity_gain <= 0.02:
        held = "no gain: constant and dynamic thresholds are about equal"
    else:
        held = f"{percent(gain.sensitivity_gain, 0)} lower on average ({significant(gain.constant_nm)} {unit} constant)"
    fresh = f"alarms on the held-out half: {gain.alarms_constant} constant, {gain.alarms_dynamic} dynamic"
    return f"{held}; {fresh}"


def labelled_rows(study: RuleStudy) -> Iterator[tuple[str, ...]]:
    """Share of known contacts missed as thresholds rise, beside injected pushes: factor, known, then by force."""
    curve = study.labelled
    if curve is None:
        return
    for wanted in _FACTORS:
        k = min(range(len(curve.scale)), key=lambda place: abs(curve.scale[place] - wanted))
        low, high = curve.missed_ci95[k]
        known = f"{percent(curve.missed[k], 0)} ({percent(low, 0)} to {percent(high, 0)})"
        yield f"{wanted:g}", known, *(percent(missed[k], 0) for missed in curve.injected.values())


def blind_rows(study: RuleStudy) -> Iterator[tuple[str, str]]:
    """By place, from where a force is not noticed, and how often."""
    if study.force_map is None:
        return
    for pose in study.force_map.blind:
        need = "no force is noticed" if pose.force_n is None else f"{significant(pose.force_n)} N are needed"
        often = f"a direction that needs over {study.force_map.limit_n:g} N exists in {percent(pose.share, 0)} of poses"
        yield pose.place, f"{often}; worst at {pose.time_s:.1f} s, {pose.words}: {need}"
