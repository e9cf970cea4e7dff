"""A recommendation for a terminal: one screen, the answer first."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from collaudit.core.data.recommendation_result import ArmRate, StretchToConfirm
from collaudit.core.recommend.arm_recommendation import ArmRecommendation
from collaudit.reports.terminal.study_text import persistence_text, set_rule_text
from collaudit.reports.terminal.text_table import table, wrapped
from collaudit.reports.values.joint_lines import joint_lines
from collaudit.reports.values.numbers import duration, rate
from collaudit.reports.values.words import plural, with_force_unit

#: More stretches than this are counted, not listed.
_LISTED = 8
_TO_CONFIRM = "left out as possible contact; please confirm (--clean if nothing touched the arm, else --truth)"
_COUNTED = "counted as clean, as stated, though higher than usual in such motion"
_HEAD = (
    "joint",
    "gamma N·m",
    "n",
    "notices N·m",
    "clean h",
    "largest clean N·m",
    "false alarms at most (95 %)",
)
_NOTICES = "notices: an external torque of this size that lasts n samples alarms at 95 % of the judged moments"
_UNTIL_THEN = 'until then: gamma_nm = "auto" takes the thresholds of the friction file, which claim less'
_WHY = {
    "stated": "as stated",
    "chosen": "chosen: notices the least force of those compared",
    "set": "as set; --choose-n takes what notices the least force",
}


def brief_text(found: ArmRecommendation, as_set: str = "", width: int | None = None) -> str:
    """Three lines: what to set, what that notices, and how many hours are missing for what rate.

    Args:
        found: the recommendation.
        as_set: the force that was noticed with the thresholds as they were, in words; empty where none is known.
        width: columns that lines fit; None: any.
    """
    rules = {joint: rule for joint, rule in found.joints.items() if rule.gamma_nm is not None}
    if not rules:
        missing = joint_lines(
            ((j, t) for j, rule in found.joints.items() for t in rule.missing), len(found.joints), True
        )
        lines = ["Set      nothing: the evidence supports no threshold", *(f"Missing  {line}" for line in missing[:1])]
        return "".join(wrapped(line, width, "         ") + "\n" for line in (*lines, f"Hours    {_hours(found.rate)}"))
    gamma = _listed({joint: f"{rule.gamma_nm:g}" for joint, rule in rules.items()}, found.units)
    torque = _listed({j: f"{r.noticed_nm:.3g}" for j, r in rules.items() if r.noticed_nm is not None}, found.units)
    persistence = f"{1e3 * found.persistence_s:.4g} ms"
    lines = [
        f"Set      gamma {gamma}; persistence {persistence} ({_WHY[found.chosen_by]})",
        f"Notices  torques of {torque} that last so long, at 95 % of the judged moments; {_forces(found, as_set)}",
        f"Hours    {_hours(found.rate)}",
    ]
    return "".join(wrapped(line, width, "         ") + "\n" for line in lines)


def _listed(shown: Mapping[str, str], units: Mapping[str, str]) -> str:
    return ", ".join(f"{joint} {with_force_unit(text, joint, units)}" for joint, text in shown.items()) + " N·m"


def _forces(found: ArmRecommendation, as_set: str) -> str:
    """Forces of contacts added to the logs, of which half are noticed, where a study of this persistence tells."""
    ns = {rule.n for rule in found.joints.values()}
    known = [
        f"{shape} {n:.3g} N" for c in found.compared if c.n in ns for shape, n in c.force_n.items() if n is not None
    ]
    if known:
        return f"half of the contacts added to the logs: {', '.join(known)}"
    return f"with gamma as it was: {as_set}" if as_set else "in newtons not known (collaudit detect --study)"


def _hours(arm: ArmRate) -> str:
    asked, hours = rate_words(arm.target_per_hour), duration(3600.0 * arm.hours)
    if arm.supported:
        return f"enough: {hours} without contact support at most {asked} false alarms of the arm (95 %)"
    so_far = "" if arm.supported_per_hour is None else f"; {hours} support {rate_words(arm.supported_per_hour)}"
    return (
        f"{duration(3600.0 * arm.more_hours)} without contact are missing for {asked} false alarms of the arm{so_far}"
    )


def recommendation_text(found: ArmRecommendation, width: int | None = None) -> str:
    """The answer, one line a joint, what to confirm, and what is missing; lines fit ``width``, None: any."""
    units = found.units
    refused = all(rule.gamma_nm is None for rule in found.joints.values())
    lines = [*(wrapped(line, width, "  ") for line in _answer(found)), ""]
    if not refused:  # tables of nothing tell nothing
        lines.append(table(_HEAD, _rows(found), range(1, len(_HEAD)), width, fold=True).rstrip())
        lines.append(wrapped(_NOTICES, width, "  "))
    verdicts = "" if refused else set_rule_text(found.set_rules, units, width)
    for text in (verdicts, persistence_text(found.compared, width)):
        lines += ["", text.rstrip()] if text else []
    lines += [""] if verdicts or found.compared else []
    lines += _confirm(found.to_confirm, _TO_CONFIRM, units, width)
    if found.if_clean_nm:
        higher = found.if_clean_nm.items()
        listed = ", ".join(f"{joint} {with_force_unit(f'{gamma:g}', joint, units)}" for joint, gamma in higher)
        lines.append(wrapped(f"If nothing touched the arm there, gamma (N·m) has to be higher: {listed}", width, "  "))
    lines += _confirm(found.counted, _COUNTED, units, width)
    lines += _highest(found, width)
    said = [(joint, text) for joint, rule in found.joints.items() for text in rule.missing]
    lines += [wrapped(f"missing: {line}", width, "  ") for line in joint_lines(said, len(found.joints))]
    if refused:
        lines.append(wrapped(_UNTIL_THEN, width, "  "))
    return "\n".join(lines) + "\n"


def rate_words(per_hour: float) -> str:
    """A rate as a person says it: 1 per 1,000 h, 2.4 per hour."""
    if per_hour >= 1.0:
        return f"{per_hour:.2g} per hour"
    hours = 1.0 / per_hour
    return f"1 per {hours:,.0f} h" if hours >= 10.0 else f"1 per {hours:.2g} h"


def claim(found: ArmRecommendation) -> str:
    """The answer in one sentence."""
    return _claim(found.rate) if found.rate.bound_per_hour is not None else "the evidence supports no threshold"


def _answer(found: ArmRecommendation) -> list[str]:
    asks = found.rate
    asked = (
        f"Asked: false alarms of the arm below {rate_words(asks.target_per_hour)}, "
        f"persistence {1e3 * found.persistence_s:.3g} ms ({_WHY[found.chosen_by]})"
    )
    if asks.bound_per_hour is None:
        return [asked, "Answer: refused; the evidence supports no threshold"]
    return [asked, f"Answer: {_claim(asks)}", _alone(asks)]


def _claim(arm: ArmRate) -> str:
    assert arm.bound_per_hour is not None and arm.supported_per_hour is not None
    if arm.supported:
        return f"with these thresholds at most {rate_words(arm.bound_per_hour)} (95 %)"
    hours = duration(3600.0 * arm.hours)
    return (
        f"NOT SUPPORTED: {hours} of clean time support {rate_words(arm.supported_per_hour)}; "
        f"{duration(3600.0 * arm.more_hours)} more would support {rate_words(arm.target_per_hour)}"
    )


def _alone(arm: ArmRate) -> str:
    assert arm.extrapolated_per_hour is not None and arm.observed_per_hour is not None
    return (
        f"False alarms of the arm (95 %): at most {rate_words(arm.extrapolated_per_hour)} if rarer peaks follow those "
        f"seen, at most {rate_words(arm.observed_per_hour)} by counting alone"
    )


def _rows(found: ArmRecommendation) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = []
    for joint, rule in found.joints.items():
        rows.append(
            (
                joint,
                "none" if rule.gamma_nm is None else with_force_unit(f"{rule.gamma_nm:g}", joint, found.units),
                str(rule.n),
                "" if rule.noticed_nm is None else with_force_unit(f"{rule.noticed_nm:.2g}", joint, found.units),
                f"{rule.clean_hours:.2g}",
                ""
                if rule.largest_clean_nm is None
                else with_force_unit(f"{rule.largest_clean_nm:.2g}", joint, found.units),
                "" if rule.false_alarms_per_hour is None else rate(rule.false_alarms_per_hour, rule.clean_hours),
            )
        )
    return rows


def _highest(found: ArmRecommendation, width: int | None) -> list[str]:
    """The moment that determines each gamma most."""
    first = {joint: peaks[0] for joint, peaks in found.highest.items() if peaks and found.joints[joint].gamma_nm}
    if not first:
        return []
    several = len({peak.log for peak in first.values()}) > 1
    listed = [
        f"{joint} {f'{peak.log} ' if several else ''}{peak.time_s:.1f} s "
        f"({peak.level_nm:.2g} {found.units.get(joint, 'N·m')})"
        for joint, peak in first.items()
    ]
    words = "Highest level counted as clean (a push there would raise gamma; --json lists five a joint): "
    return [wrapped(words + ", ".join(listed), width, "  ")]


def _confirm(
    stretches: Sequence[StretchToConfirm], title: str, units: Mapping[str, str], width: int | None
) -> list[str]:
    if not stretches:
        return []
    seconds = sum(s.end_s - s.start_s for s in stretches)
    count = plural(len(stretches), "stretch", "stretches")
    lines = [wrapped(f"{count} ({duration(seconds)}) {title}:", width, "  ")]
    ranked = sorted(stretches, key=lambda s: -(s.level_nm or 0.0))[:_LISTED]
    for s in sorted(ranked, key=lambda s: (s.log, s.start_s)):
        slide = len(s.joints) > 0 and all(units.get(joint) == "N" for joint in s.joints)
        level = "" if s.level_nm is None else f", {s.level_nm:.2g} {'N' if slide else 'N·m'} for n samples"
        lines.append(f"  {s.log} {s.start_s:.1f}-{s.end_s:.1f} s: {s.why} {', '.join(s.joints)}{level}")
    if len(stretches) > _LISTED:
        lines.append(f"  and {len(stretches) - _LISTED} with lower levels (--json lists all)")
    return lines
