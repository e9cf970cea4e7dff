"""Two audits side by side, and forces beside the user's limits, for a terminal."""

from __future__ import annotations

from collections.abc import Sequence

from collaudit.core.data.audit_result import AuditResult
from collaudit.reports.sections.body_region_sections import CANNOT_BE_CONCLUDED, BodyLimits, body_region_section
from collaudit.reports.sections.comparison_sections import compared_notes, compared_sections, compared_sides
from collaudit.reports.terminal.section_text import sections_text
from collaudit.reports.terminal.text_table import wrapped
from collaudit.reports.values.comparison import Comparison
from collaudit.reports.values.visible_text import visible


def comparison_text(found: Comparison, width: int | None = None) -> str:
    """Verdicts, contacts, settings, friction, residual level, findings.

    Args:
        found: the comparison.
        width: columns of the terminal that tables are cut to; None: any.
    """
    lines = []
    for side, verdict, name, note in compared_sides(found):
        lines.append(f"{side + ':':<8}{verdict}  {name}\n")
        if note:
            lines.append(f"{wrapped(' ' * 8 + note, width, ' ' * 8)}\n")
    lines += [f"{wrapped(text, width)}\n" for text in compared_notes(found)]
    return "".join(lines) + sections_text(compared_sections(found), width)


def body_region_text(results: Sequence[AuditResult], limits: BodyLimits, width: int | None = None) -> str:
    """A table of each log with contacts, then what cannot be concluded.

    Args:
        results: of the runs.
        limits: as the user's file states them.
        width: columns of the terminal that tables are cut to; None: any.
    """
    head = wrapped(f"Limits by body region, as stated by: {visible(limits.source)}", width)
    found = sections_text((body_region_section(result, limits) for result in results), width)
    return f"{head}\n{found}\n{wrapped(CANNOT_BE_CONCLUDED, width)}\n"
