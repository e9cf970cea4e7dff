"""A recommendation as text: three lines for a terminal, every table behind them, and written into a configuration."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import tomlkit
from tomlkit.items import KeyType, SingleKey, Table

from collaudit.core.data.audit_result import RecommendedRule
from collaudit.core.data.recommendation_result import ArmRate, StretchToConfirm
from collaudit.core.errors import ConfigError
from collaudit.core.recommend.arm_recommendation import ArmRecommendation
from collaudit.core.small_files import to_toml
from collaudit.reports.sections.joint_sections import set_rule_section
from collaudit.reports.sections.section import Section, section_of
from collaudit.reports.terminal.text_table import sections_text
from collaudit.reports.values.numbers import duration, rate_words
from collaudit.reports.values.visible_text import joint_lines, wrapped
from collaudit.reports.values.words import by_joint, plural, with_unit


def recommendation_text(
    found: ArmRecommendation, as_set: str = "", width: int | None = None, detail: bool = False
) -> str:
    """Three lines: what to set, what that notices, and how many hours support what rate.

    Args:
        found: the recommendation.
        as_set: the force that was noticed with the thresholds as they were, in words; empty where none is known.
        width: columns that lines fit; None: any.
        detail: with a line a joint, what to confirm, and all that is missing.
    """
    rules = {joint: rule for joint, rule in found.joints.items() if rule.gamma_nm is not None}
    if rules:
        gamma = by_joint({joint: with_unit(f"{rule.gamma_nm:g}", joint, found.units) for joint, rule in rules.items()})
        noticed = {joint: rule.noticed_nm for joint, rule in rules.items() if rule.noticed_nm is not None}
        torque = by_joint({joint: with_unit(f"{x:.3g}", joint, found.units) for joint, x in noticed.items()})
        persistence = f"{1e3 * found.persistence_s:.4g} ms"
        n = " and ".join(sorted({str(rule.n) for rule in rules.values()}))
        lines = [
            f"Set      γ {gamma}, n {n} ({persistence}, as {found.chosen_by})",
            f"Notices  torques of {torque} that last so long, at 95 % of the judged moments; {_forces(as_set)}",
        ]
    else:
        said = [(joint, text) for joint, rule in found.joints.items() for text in rule.missing]
        missing = [] if detail else joint_lines(said, len(found.joints), brief=True)
        if not found.joints:
            missing = ["a joint that is judged: none of these logs has one; collaudit detect says why"]
        lines = ["Set      nothing: the evidence supports no threshold", *(f"Missing  {line}" for line in missing[:1])]
    lines.insert(1, f"Rests on {claim(found.rate)}")
    text = "".join(f"{wrapped(line, width, ' ' * 9)}\n" for line in lines)
    return text + (sections_text(recommendation_sections(found), width) if detail else "")


def _forces(as_set: str) -> str:
    return f"with the γ of these runs: {as_set}" if as_set else "in newtons not known"


def claim(arm: ArmRate) -> str:
    """What the clean hours support, first; and how many more would show the rate asked for."""
    hours = duration(3600.0 * arm.hours)
    if arm.bound_per_hour is None:
        return f"{hours} of clean motion, which supports no rate of false alarms"
    seen = "" if not arm.alarms else f" ({arm.alarms} counted)"
    shown = f"{hours} of clean motion: at most {rate_words(arm.bound_per_hour)} false alarms of the arm (95 %){seen}"
    if arm.supported:
        return shown
    more = f"{duration(3600.0 * arm.more_hours)} more without one" if arm.more_hours > 0 else "a higher γ"
    return f"{shown}; {more} would show {rate_words(arm.target_per_hour)}"


#: More stretches than this are counted, not listed.
_LISTED = 8
_TO_CONFIRM = (
    "left out as possible contact; please confirm (--set fit.contact=none if nothing touched the arm, else --truth)"
)
_COUNTED = "counted as clean, as stated, though higher than usual in such motion"
_NOTICES = "Notices: an external torque of this size that lasts n samples alarms at 95 % of the judged moments."
_UNTIL_THEN = 'Until then: gamma_nm = "auto" stands on what the friction file tells of motion.'


def recommendation_sections(found: ArmRecommendation) -> tuple[Section, ...]:
    """A line a joint, opinions on what is set, what to confirm, and what is missing."""
    refused = all(rule.gamma_nm is None for rule in found.joints.values())
    higher = ", ".join(f"{joint} {with_unit(f'{x:g}', joint, found.units)}" for joint, x in found.if_clean_nm.items())
    if_clean = f"If nothing touched the arm there, γ has to be higher: {higher}" if higher else ""
    missing = joint_lines(
        [(joint, text) for joint, rule in found.joints.items() for text in rule.missing], len(found.joints)
    )
    return (
        *(() if refused else (_thresholds(found), set_rule_section(found.set_rules, found.units))),
        _stretches(found, found.to_confirm, _TO_CONFIRM, if_clean),
        _stretches(found, found.counted, _COUNTED),
        _highest(found),
        Section("Missing", (), (), (*missing, *([_UNTIL_THEN] if refused else []))),
    )


def _thresholds(found: ArmRecommendation) -> Section:
    return section_of(
        "Thresholds", (_threshold(joint, rule, found.units) for joint, rule in found.joints.items()), _NOTICES
    )


def _threshold(joint: str, rule: RecommendedRule, units: Mapping[str, str]) -> dict[str, str]:
    torques = (rule.noticed_nm, rule.largest_clean_nm, rule.motion_nm)
    notices, largest, motion = ("" if x is None else with_unit(f"{x:.3g}", joint, units) for x in torques)
    return {
        "joint": joint,
        "γ": "none" if rule.gamma_nm is None else with_unit(f"{rule.gamma_nm:g}", joint, units),
        "n": str(rule.n),
        "notices": notices,
        "clean time": duration(3600.0 * rule.clean_hours),
        "largest clean": largest,
        "motion's level": motion,
        "false alarms at most (95 %)": "" if (most := rule.false_alarms_per_hour_upper95) is None else f"{most:.2g} /h",
    }


def _highest(found: ArmRecommendation) -> Section:
    """The moment that determines each threshold most."""
    records = (
        {
            "joint": joint,
            "log": peaks[0].log,
            "at": f"{peaks[0].time_s:.1f} s",
            "level": with_unit(f"{peaks[0].level_nm:.3g}", joint, found.units),
        }
        for joint, peaks in found.highest.items()
        if peaks and found.joints[joint].gamma_nm
    )
    title = "Highest level counted as clean: a push there would raise γ (--json lists five a joint)"
    return section_of(title, records)


def _stretches(found: ArmRecommendation, stretches: Sequence[StretchToConfirm], what: str, note: str = "") -> Section:
    if not stretches:
        return Section("Left out as possible contact", (), (), (note,) if note else ())
    count = plural(len(stretches), "stretch", "stretches")
    ranked = sorted(stretches, key=lambda s: -(s.level_nm or 0.0))[:_LISTED]
    records = (_stretch(s, found.units) for s in sorted(ranked, key=lambda s: (s.log, s.start_s)))
    left = len(stretches) - len(ranked)
    more = f"And {left} with lower levels (--json lists all)." if left else ""
    title = f"{count} ({duration(sum(s.end_s - s.start_s for s in stretches))}) {what}"
    return section_of(title, records, *(text for text in (more, note) if text))


def _stretch(s: StretchToConfirm, units: Mapping[str, str]) -> dict[str, str]:
    slide = len(s.joints) > 0 and all(units.get(joint) == "N" for joint in s.joints)
    return {
        "log": s.log,
        "when": f"{s.start_s:.1f} to {s.end_s:.1f} s",
        "why": s.why,
        "joints": ", ".join(s.joints),
        "level for n samples": "" if s.level_nm is None else f"{s.level_nm:.3g} {'N' if slide else 'N·m'}",
    }


def written_into(text: str, found: ArmRecommendation, robot: str | None = None) -> str:
    """A configuration with the recommended thresholds; everything else in it stays, comments included.

    The persistence is written where it was asked for or chosen, and where the file has none. A joint without a
    recommendation keeps its threshold.

    Args:
        text: of the file.
        found: the recommendation; of one that is refused nothing is written.
        robot: write the thresholds into this robot's table of the fleet instead of ``[detect]``.

    Raises:
        ConfigError: the file has no table for this robot.
    """

    document: Any = tomlkit.parse(text)
    gammas = {joint: rule.gamma_nm for joint, rule in found.joints.items() if rule.gamma_nm is not None}
    if robot is not None:
        robots = document.get("fleet", {}).get("robots", {})
        if robot not in robots:
            expected = f"a table [fleet.robots.{robot}]"
            raise ConfigError(
                "the file does not describe this robot", found=", ".join(robots) or None, expected=expected
            )
        _set(robots[robot], found, gammas)
        return tomlkit.dumps(document)
    if "detect" not in document:
        document.append("detect", tomlkit.table())
    detect = document["detect"]
    if found.chosen_by != "set" or not {"n", "persistence_ms"} & set(detect):
        detect.pop("n", None)
        detect["persistence_ms"] = round(1e3 * found.persistence_s, 6)
    _set(detect, found, gammas)
    return tomlkit.dumps(document)


def _set(table: Any, found: ArmRecommendation, gammas: dict[str, float]) -> None:
    """Change thresholds where they stand, so that comments beside them stay; else put a table in their place."""
    stated = table.get("gamma_nm")
    if isinstance(stated, dict):
        for joint, gamma in gammas.items():
            stated[joint] = gamma
        return
    of_all = dict.fromkeys(found.joints, float(stated)) if isinstance(stated, int | float) else {}
    table.pop("gamma_nm", None)
    table.append("gamma_nm", _table(of_all | gammas))


def _table(gammas: Mapping[str, float]) -> Table:
    thresholds = tomlkit.table()
    for joint, gamma in gammas.items():
        thresholds.append(_key(joint), gamma)
    return thresholds


def _key(name: str) -> SingleKey:
    """A quoted key, in which nothing can hide."""
    return SingleKey(name, KeyType.Basic, original=to_toml(name))
