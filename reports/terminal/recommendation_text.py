"""A recommendation for a terminal: one screen, the answer first."""

from __future__ import annotations

from collections.abc import Mapping

from collaudit.core.data.recommendation_result import ArmRate
from collaudit.core.recommend.arm_recommendation import ArmRecommendation
from collaudit.reports.sections.recommendation_sections import recommendation_sections
from collaudit.reports.terminal.section_text import sections_text
from collaudit.reports.terminal.text_table import wrapped
from collaudit.reports.values.joint_lines import joint_lines
from collaudit.reports.values.numbers import duration
from collaudit.reports.values.words import with_unit

_WHY = {
    "stated": "as stated",
    "set": "as set",
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
        f"Notices  torques of {torque} that last so long, at 95 % of the judged moments; {_forces(as_set)}",
        f"Hours    {_hours(found.rate)}",
    ]
    return "".join(wrapped(line, width, "         ") + "\n" for line in lines)


def _listed(shown: Mapping[str, str], units: Mapping[str, str]) -> str:
    """Values by joint; a unit that all share is said once."""
    kinds = {units.get(joint, "N·m") for joint in shown}
    if len(kinds) == 1:
        return ", ".join(f"{joint} {text}" for joint, text in shown.items()) + f" {kinds.pop()}"
    return ", ".join(f"{joint} {with_unit(text, joint, units)}" for joint, text in shown.items())


def _forces(as_set: str) -> str:
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
    answer = "".join(f"{wrapped(line, width, '  ')}\n" for line in _answer(found))
    return answer + sections_text(recommendation_sections(found), width)


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
