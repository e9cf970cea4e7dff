"""What is said of joints beside an audit: thresholds that are set, alarms over gamma and persistence, nights."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from collaudit.core.data.recommendation_result import SetRule
from collaudit.core.history.night_row import Change, JointNights
from collaudit.core.recommend.joint_thresholds import AlarmPlane
from collaudit.reports.sections.section import Section, section_of
from collaudit.reports.values.numbers import duration, rate_words, significant, with_interval
from collaudit.reports.values.words import NONE, with_unit


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
        "false alarms counted": rate_words(one.false_alarms_per_hour),
        "at most (95 %)": rate_words(one.false_alarms_per_hour_upper95),
        "goes unnoticed": with_unit(unnoticed, joint, units),
        "verdict": one.opinion,
    }


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


def nights_section(joints: Sequence[JointNights]) -> Section:
    """A row a joint: its nights, how many were tested, contacts, and whether level and friction changed.

    Args:
        joints: of the robots.
    """
    if not joints:
        return Section("Joints over nights", (), (), ("The store holds no joint.",))
    records = (
        {
            "robot": one.robot,
            "joint": one.joint,
            "nights tested": f"{sum(night.tested > 0 for night in one.nights)} of {len(one.nights)}",
            "judged": duration(sum(night.judged_s for night in one.nights)),
            "contacts": str(sum(night.contacts for night in one.nights)),
            "level, N·m": change_text(one.level, [night.level_nm for night in one.nights]),
            "friction, N·m": change_text(one.friction, [night.friction_nm for night in one.nights]),
            "γ, N·m": first_and_last([night.gamma_nm for night in one.nights]),
        }
        for one in joints
    )
    note = (
        "Level (mean residual away from events) and friction: before and since the night that divides them best, each "
        "with its 95 % interval; the logs of a night are replicates. γ: first and last night."
    )
    return section_of("Joints over nights", records, note)


def change_text(change: Change, values: Sequence[float | None]) -> str:
    """What became of a value: before and now with their intervals, or why that is not known.

    Args:
        change: over the nights.
        values: of the nights.
    """
    if change.before is None or change.now is None:
        words = {"not tested": "not tested in the last night", "too few": "too few nights to tell"}
        return f"{first_and_last(values)} ({words[change.state]})"
    before, now = (
        with_interval(value, (low, high) if low < high else None) for value, low, high in (change.before, change.now)
    )
    share = change.now[0] / change.before[0] - 1.0 if change.before[0] > 0.0 else None
    by = "" if share is None else f", {100.0 * share:+.0f} %"
    if change.state == "changed":
        return f"{before} → {now}{by}, since {change.since}"
    return f"no change shown: {before} → {now}{by}"


def first_and_last(values: Sequence[float | None]) -> str:
    """The first and the last known value; one where they are alike in words."""
    known = [significant(value) for value in values if value is not None]
    if not known:
        return NONE
    return known[0] if known[0] == known[-1] else f"{known[0]} → {known[-1]}"
