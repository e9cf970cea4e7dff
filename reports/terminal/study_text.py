"""A rule study for a terminal."""

from __future__ import annotations

from dataclasses import replace

from collaudit.core.data.rule_study_result import RuleStudy
from collaudit.reports.sections.study_sections import study_sections
from collaudit.reports.terminal.section_text import sections_text


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
