"""What a fit, a plan, a rule study and the checks of an installation say on a terminal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from collaudit.core.data.audit_result import FrictionFile
from collaudit.core.data.plan_result import PlanFile
from collaudit.core.data.rule_study_result import RuleStudy
from collaudit.reports.sections.fit_sections import fit_sections
from collaudit.reports.sections.plan_sections import plan_sections
from collaudit.reports.sections.study_sections import study_sections
from collaudit.reports.terminal.section_text import section_text, sections_text
from collaudit.reports.terminal.text_table import table, wrapped
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


def fit_text(friction: FrictionFile, width: int | None = None, detail: bool = False) -> str:
    """The joints with what to do, what was left out, and in detail all that was identified.

    Args:
        friction: the fit.
        width: columns of the terminal that tables are cut to; None: any.
        detail: as of :func:`~collaudit.reports.sections.fit_sections.fit_sections`.
    """
    joints, *others = fit_sections(friction, detail)
    return section_text(joints, width, text_below=True) + sections_text(others, width)


def study_text(study: RuleStudy, width: int | None = None, detail: bool = False, answer: bool = True) -> str:
    """What the rule notices, and what thresholds are made of.

    Args:
        study: of one log.
        width: columns of the terminal that tables fit; None: any.
        detail: by place and motion as well, and the planes' points.
        answer: as of :func:`~collaudit.reports.sections.study_sections.study_sections`.
    """
    found = [replace(one, folded=one.folded and not detail) for one in study_sections(study, answer)]
    return sections_text(found, width).removeprefix("\n")


def checks_text(checks: Sequence[tuple[bool, str, str, str, str]], width: int | None = None) -> str:
    """One line a check, then how many passed.

    Args:
        checks: of each, whether it passed, the robot, what was checked, what was wanted, what was found.
        width: columns of the terminal that the table is cut to; None: any.
    """
    lines = [("ok" if passed else "WRONG", *cells) for passed, *cells in checks]
    passed = sum(check[0] for check in checks)
    head = ("", "robot", "check", "wanted", "found")
    return table(head, lines, width=width) + f"\n{passed} of {len(checks)} checks passed\n"
