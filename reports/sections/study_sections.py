"""A rule study: what contacts are noticed, by which persistence, what thresholds are made of."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from collaudit.core.data.recommendation_result import SetRule
from collaudit.core.data.rule_study_result import (
    ContactSensitivity,
    ForceNoticed,
    JointPlane,
    RuleStudy,
)
from collaudit.reports.sections.section import Rows, Section
from collaudit.reports.values.numbers import percent, significant
from collaudit.reports.values.words import NONE, with_unit

NEVER = "none"
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


def study_sections(study: RuleStudy, answer: bool = True) -> tuple[Section, ...]:
    """Every section that says something.

    Args:
        study: of one log.
        answer: with this log's opinion on the rule that is set; False where a recommendation gives it.
    """
    opinions = (set_rule_section(study.set_rules, study.units),) if answer else ()
    every = (
        _noticed(study),
        *_by_place(study),
        *opinions,
        _labelled(study),
        plane_section("Threshold and persistence of each joint", study.joints, study.units),
        _parts(study),
        Section("Poses and directions that are blind", ("place", "from where"), _blind(study)),
        Section("What these numbers rest on", (), (), study.assumptions),
    )
    return tuple(one for one in every if one.rows or one.notes)


def _noticed(study: RuleStudy) -> Section:
    rows = tuple(
        (
            rule.name,
            contact.shape,
            str(contact.contacts),
            *_forces(contact),
            "" if contact.delay_s is None else f"{1e3 * contact.delay_s:.0f}",
        )
        for rule in study.rules
        for contact in rule.contacts
        if contact.place is None and contact.motion is None
    )
    head = ("rule", "contact", "number", "half noticed at N (95 %)", "90 % at N (95 %)", "at no force", "delay ms")
    note = (
        "At random places, directions and moments, through the same filters. The delay is that of contacts of twice "
        "the force that each needs."
    )
    return Section("Contacts added to this log: force that is noticed", head, rows, (note,) if rows else ())


def _by_place(study: RuleStudy) -> Iterator[Section]:
    """What each rule notices by place and by motion; nothing where contacts were not told apart so."""
    for rule in study.rules:
        cells = {
            (contact.place or contact.motion, contact.shape): _forces(contact)
            for contact in rule.contacts
            if contact.place is not None or contact.motion is not None
        }
        shapes = tuple(dict.fromkeys(shape for _, shape in cells))
        rows = tuple(
            (where or "", words, *(cells[where, shape][k] if (where, shape) in cells else NONE for shape in shapes))
            for where in dict.fromkeys(where for where, _ in cells)
            for k, words in enumerate(("half at N", "90 % at N", "at no force"))
        )
        if rows:
            title = f"By place and motion, {rule.name} rule (95 %)"
            yield Section(title, ("where", "noticed", *shapes), rows, folded=True)


def _forces(contact: ContactSensitivity) -> tuple[str, str, str]:
    """Of which half and 90 % are noticed, and the share noticed at no force."""
    by_share = {noticed.share: noticed for noticed in contact.noticed}
    return _force(by_share[0.5]), _force(by_share[0.9]), percent(contact.blind)


def _force(noticed: ForceNoticed) -> str:
    if noticed.force_n is None:
        return NEVER
    low, high = ("∞" if value is None else significant(value) for value in noticed.ci95_n)
    return f"{significant(noticed.force_n)} ({low} to {high})"


def plane_section(title: str, planes: Mapping[str, JointPlane], units: Mapping[str, str]) -> Section:
    """The configured and the recommended rule of every joint; ``units`` by joint, of what its drive exerts."""
    rows = []
    for joint, plane in planes.items():
        for name, point in (("configured", plane.configured), ("recommended", plane.chosen)):
            if point is not None:
                gamma, push = (
                    NEVER if value is None else with_unit(significant(value), joint, units)
                    for value in (point.gamma_nm, point.torque_nm)
                )
                upper = point.alarms_per_hour_upper95
                alarms = f"{point.alarms}" + ("" if upper is None else f" (at most {significant(upper)} an hour)")
                rows.append((joint, name, gamma, str(point.n), alarms, push))
    alarms_head, push_head = "alarms in the clean time (95 %)", "push of 100 ms noticed from"
    head = ("joint", "rule", "γ", "n", alarms_head, push_head)
    return Section(title, head, tuple(rows), folded=True)


def set_rule_section(set_rules: Mapping[str, SetRule], units: Mapping[str, str]) -> Section:
    """Whether the thresholds that are set are too tight, too loose or supported; ``units`` by joint."""
    title = "Verdict on what is set"
    if set_rules and all(rule.opinion == "not judged" for rule in set_rules.values()):
        return Section(title, (), (), ("Not judged, as the evidence supports no threshold.",))
    rows = tuple(_set_rule(joint, one, units) for joint, one in set_rules.items())
    head = (
        "joint",
        "set",
        "n",
        "asked for",
        "false alarms expected",
        "at most (95 %)",
        "goes unnoticed",
        "verdict",
    )
    note = "False alarms as they follow from the largest peaks, rarer than the hours show."
    return Section(title, head, rows, (note,) if rows else ())


def _set_rule(joint: str, one: SetRule, units: Mapping[str, str]) -> tuple[str, ...]:
    unnoticed = "" if one.unnoticed_nm is None else " to ".join(significant(x) for x in one.unnoticed_nm)
    return (
        joint,
        with_unit(f"{one.gamma_nm:.3g}", joint, units),
        str(one.n) if one.n else "",
        "" if one.recommended_nm is None else with_unit(f"{one.recommended_nm:.3g}", joint, units),
        _alarm_rate(one.false_alarms_per_hour),
        _alarm_rate(one.false_alarms_per_hour_upper95),
        with_unit(unnoticed, joint, units),
        one.opinion,
    )


def _alarm_rate(per_hour: float | None) -> str:
    """A rate of false alarms: per hour, or per 1,000 h where it is rare."""
    if per_hour is None:
        return ""
    if per_hour >= 0.1:
        return f"{per_hour:.2g} /h"
    per_thousand = 1e3 * per_hour
    return "< 0.01 /1,000 h" if per_thousand < 0.01 else f"{per_thousand:.2g} /1,000 h"


def _parts(study: RuleStudy) -> Section:
    """What each threshold is made of: the level, the causes by falling share, and last what is left."""
    rows = []
    for joint, parts in study.parts.items():
        shares = sorted(parts.falls_nm.items(), key=lambda each: each[0] == "rest")
        causes = [f"{_CAUSES[cause]} {significant(fall, 2)}" for cause, fall in shares if fall >= 0.005]
        rows.append((joint, with_unit(significant(parts.level_nm), joint, study.units), ", ".join(causes)))
    title = "What thresholds are made of: by how much the level falls without each cause"
    note = "The level is what the clean residual sustains for n samples. Causes overlap and do not add up."
    return Section(title, ("joint", "level", "falls without"), tuple(rows), (note,) if rows else ())


def _labelled(study: RuleStudy) -> Section:
    """Share of known contacts missed as thresholds rise, beside injected pushes."""
    curve = study.labelled
    if curve is None:
        return Section("", (), ())
    rows = []
    for wanted in _FACTORS:
        k = min(range(len(curve.scale)), key=lambda place: abs(curve.scale[place] - wanted))
        low, high = curve.missed_ci95[k]
        known = f"{percent(curve.missed[k], 0)} ({percent(low, 0)} to {percent(high, 0)})"
        rows.append((f"{wanted:g}", known, *(percent(missed[k], 0) for missed in curve.injected.values())))
    head = ("thresholds times", "known (95 %)", *(f"push of {force} N" for force in curve.injected))
    title = f"Missed of {curve.contacts} known contacts, and of pushes of 100 ms added to the same log"
    return Section(title, head, tuple(rows))


def _blind(study: RuleStudy) -> Rows:
    """By place, from where a force is not noticed, and how often."""
    if study.force_map is None:
        return ()
    rows = []
    for pose in study.force_map.blind:
        need = "no force is noticed" if pose.force_n is None else f"{significant(pose.force_n)} N are needed"
        often = f"a direction that needs over {study.force_map.limit_n:g} N exists in {percent(pose.share, 0)} of poses"
        rows.append((pose.place, f"{often}; worst at {pose.time_s:.1f} s, {pose.words}: {need}"))
    return tuple(rows)
