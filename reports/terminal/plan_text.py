"""A plan for a terminal."""

from __future__ import annotations

from collaudit.core.data.plan_result import PlanFile
from collaudit.reports.sections.plan_sections import plan_sections
from collaudit.reports.terminal.section_text import sections_text
from collaudit.reports.terminal.text_table import wrapped
from collaudit.reports.values.numbers import duration


def plan_text(plan: PlanFile, width: int | None = None) -> str:
    """The statement, how long the motion takes, and every section.

    Args:
        plan: the plan.
        width: columns of the terminal; None: any.
    """
    exciting = "none" if plan.exciting_s is None else (
        f"{plan.exciting_moves} moves, {duration(plan.exciting_s[1] - plan.exciting_s[0])} from "
        f"{plan.exciting_s[0]:.1f} s on")  # fmt: skip
    of_arm = sum(one.joint is None for one in plan.predictions)
    return (
        f"{wrapped(plan.statement, width)}\n\nMotion: {duration(plan.duration_s)} of at most "
        f"{plan.minutes_asked:g} min\nExciting trajectory: {exciting}\n"
        f"{sections_text(plan_sections(plan, of_joints_only=True), width)}\n"
        f"{of_arm} parameters of the whole arm besides: plan.html, plan.json\n"
    )
