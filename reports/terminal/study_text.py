"""A rule study for a terminal."""

from __future__ import annotations

from dataclasses import replace

from collaudit.core.data.rule_study_result import RuleStudy
from collaudit.reports.sections.study_sections import chosen_flags, study_sections
from collaudit.reports.terminal.section_text import sections_text
from collaudit.reports.values.visible_text import visible


def study_text(study: RuleStudy, width: int | None = None, detail: bool = False, answer: bool = True) -> str:
    """What the rule notices, which persistence would notice more, and what thresholds are made of.

    Args:
        study: of one log.
        width: columns of the terminal that tables fit; None: any.
        detail: by place and motion as well, and the planes' points.
        answer: as of :func:`~collaudit.reports.sections.study_sections.study_sections`.
    """
    found = [replace(one, folded=one.folded and not detail) for one in study_sections(study, answer)]
    flags = chosen_flags(study) if answer else None
    # Flags are to be copied: they stay on one line.
    last = "" if flags is None else f"\nRecommended rule, from this log alone:\n  {visible(flags)}\n"
    return sections_text(found, width).removeprefix("\n") + last
