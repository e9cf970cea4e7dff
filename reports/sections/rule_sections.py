"""Rules of joints: what evidence says of the thresholds that are set, and their alarms over gamma and persistence."""

from __future__ import annotations

from collections.abc import Mapping

from collaudit.core.data.recommendation_result import SetRule
from collaudit.core.recommend.alarm_plane import AlarmPlane
from collaudit.reports.sections.section import Section, section_of
from collaudit.reports.values.numbers import duration, significant
from collaudit.reports.values.words import with_unit


def set_rule_section(set_rules: Mapping[str, SetRule], units: Mapping[str, str]) -> Section:
    """Whether the thresholds that are set are too tight, too loose or supported; ``units`` by joint."""
    title = "Verdict on what is set"
    if set_rules and all(rule.opinion == "not judged" for rule in set_rules.values()):
        return Section(title, (), (), ("Not judged, as the evidence supports no threshold.",))
    records = (_set_rule(joint, one, units) for joint, one in set_rules.items())
    return section_of(title, records, "False alarms as counted in the clean time.")


def _set_rule(joint: str, one: SetRule, units: Mapping[str, str]) -> dict[str, str]:
    unnoticed = "" if one.unnoticed_nm is None else " to ".join(significant(x) for x in one.unnoticed_nm)
    return {
        "joint": joint,
        "set": with_unit(f"{one.gamma_nm:.3g}", joint, units),
        "n": str(one.n) if one.n else "",
        "asked for": "" if one.recommended_nm is None else with_unit(f"{one.recommended_nm:.3g}", joint, units),
        "false alarms counted": _alarm_rate(one.false_alarms_per_hour),
        "at most (95 %)": _alarm_rate(one.false_alarms_per_hour_upper95),
        "goes unnoticed": with_unit(unnoticed, joint, units),
        "verdict": one.opinion,
    }


def _alarm_rate(per_hour: float | None) -> str:
    """A rate of false alarms: per hour, or per 1,000 h where it is rare."""
    if per_hour is None:
        return ""
    if per_hour >= 0.1:
        return f"{per_hour:.2g} /h"
    per_thousand = 1e3 * per_hour
    return "< 0.01 /1,000 h" if per_thousand < 0.01 else f"{per_thousand:.2g} /1,000 h"


def plane_section(planes: Mapping[str, AlarmPlane], units: Mapping[str, str]) -> Section:
    """Alarms of every joint in its clean time, a row for each threshold, a column for each persistence.

    Args:
        planes: by joint.
        units: by joint, of what its drive exerts.
    """
    records = (
        {
            "joint": joint,
            "γ": with_unit(significant(gamma), joint, units),
            **{f"{1e3 * s:.3g} ms": str(count) for s, count in zip(plane.persistence_s, row, strict=True)},
            "clean time": duration(plane.clean_s),
        }
        for joint, plane in planes.items()
        for gamma, row in zip(plane.gamma_nm, plane.alarms, strict=True)
    )
    note = "No alarm in a time T means at most 3 in T (95 %). γ is constant here."
    return section_of("Alarms in the clean time, by γ and persistence", records, note)
