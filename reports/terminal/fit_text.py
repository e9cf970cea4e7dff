"""A fit for a terminal."""

from __future__ import annotations

from collaudit.core.data.audit_result import FrictionFile
from collaudit.reports.sections.fit_sections import fit_sections
from collaudit.reports.terminal.section_text import section_text, sections_text


def fit_text(friction: FrictionFile, width: int | None = None, detail: bool = False) -> str:
    """The joints with what to do, what was left out, and in detail all that was identified.

    Args:
        friction: the fit.
        width: columns of the terminal that tables are cut to; None: any.
        detail: as of :func:`~collaudit.reports.sections.fit_sections.fit_sections`.
    """
    joints, *others = fit_sections(friction, detail)
    return section_text(joints, width, text_below=True) + sections_text(others, width)
