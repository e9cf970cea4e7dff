"""Two audits side by side, for a terminal."""

from __future__ import annotations

from collaudit.reports.terminal.text_table import table, wrapped
from collaudit.reports.values.comparison import Comparison
from collaudit.reports.values.comparison_tables import ComparedTable, compared_notes, compared_sides, compared_tables


def comparison_text(found: Comparison, width: int | None = None) -> str:
    """Verdicts, contacts, settings, friction, residual level, findings.

    Args:
        found: the comparison.
        width: columns of the terminal that tables are cut to; None: any.
    """
    return "\n".join([_head(found, width), *(_shown(part, width) for part in compared_tables(found))])


def _head(found: Comparison, width: int | None) -> str:
    lines = []
    for side, verdict, name, note in compared_sides(found):
        lines.append(f"{side + ':':<8}{verdict}  {name}\n")
        if note:
            lines.append(f"{wrapped(' ' * 8 + note, width, ' ' * 8)}\n")
    return "".join([*lines, *(f"{wrapped(text, width)}\n" for text in compared_notes(found))])


def _shown(part: ComparedTable, width: int | None) -> str:
    if not part.rows:
        return wrapped(f"{part.title}{f': {part.note}' if part.note else ''}", width, "  ") + "\n"
    note = f"{wrapped(part.note, width)}\n" if part.note else ""
    return f"{wrapped(part.title, width, '  ')}\n{table(part.head, part.rows, part.numeric, width, fold=True)}{note}"
