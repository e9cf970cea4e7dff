"""A recommendation for a terminal: the answer in three lines, and in detail every table behind it."""

from __future__ import annotations

from collections.abc import Mapping

from collaudit.core.data.recommendation_result import ArmRate
from collaudit.core.recommend.arm_recommendation import ArmRecommendation
from collaudit.reports.sections.recommendation_sections import recommendation_sections
from collaudit.reports.terminal.text_table import sections_text
from collaudit.reports.values.joint_lines import joint_lines
from collaudit.reports.values.numbers import duration, rate_words
from collaudit.reports.values.visible_text import wrapped
from collaudit.reports.values.words import with_unit


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
        gamma = _listed({joint: f"{rule.gamma_nm:g}" for joint, rule in rules.items()}, found.units)
        torque = _listed({j: f"{r.noticed_nm:.3g}" for j, r in rules.items() if r.noticed_nm is not None}, found.units)
        persistence = f"{1e3 * found.persistence_s:.4g} ms"
        lines = [
            f"Set      gamma {gamma}; persistence {persistence} (as {found.chosen_by})",
            f"Notices  torques of {torque} that last so long, at 95 % of the judged moments; {_forces(as_set)}",
        ]
    else:
        said = [(joint, text) for joint, rule in found.joints.items() for text in rule.missing]
        missing = [] if detail else joint_lines(said, len(found.joints), brief=True)
        lines = ["Set      nothing: the evidence supports no threshold", *(f"Missing  {line}" for line in missing[:1])]
    text = "".join(f"{wrapped(line, width, ' ' * 9)}\n" for line in (*lines, f"Hours    {claim(found.rate)}"))
    return text + (sections_text(recommendation_sections(found), width) if detail else "")


def _listed(shown: Mapping[str, str], units: Mapping[str, str]) -> str:
    """Values by joint; a unit that all share is said once."""
    kinds = {units.get(joint, "N·m") for joint in shown}
    if len(kinds) == 1:
        return ", ".join(f"{joint} {text}" for joint, text in shown.items()) + f" {kinds.pop()}"
    return ", ".join(f"{joint} {with_unit(text, joint, units)}" for joint, text in shown.items())


def _forces(as_set: str) -> str:
    return f"with gamma as it was: {as_set}" if as_set else "in newtons not known (collaudit detect --study)"


def claim(arm: ArmRate) -> str:
    """How many false alarms of the arm the hours support, and how many hours are missing for what was asked."""
    asked, hours = rate_words(arm.target_per_hour), duration(3600.0 * arm.hours)
    if arm.supported:
        return f"enough: {hours} without contact support at most {asked} false alarms of the arm (95 %)"
    so_far = "" if arm.supported_per_hour is None else f"; {hours} support {rate_words(arm.supported_per_hour)}"
    more = duration(3600.0 * arm.more_hours)
    return f"NOT SUPPORTED: {more} without contact are missing for {asked} false alarms of the arm{so_far}"
