"""A section for a terminal."""

from __future__ import annotations

from collections.abc import Iterable

from collaudit.reports.sections.section import Section
from collaudit.reports.terminal.text_table import table, wrapped


def section_text(found: Section, width: int | None = None, text_below: bool = False) -> str:
    """Title, table and notes; of an empty section its title with the notes.

    Args:
        found: the section.
        width: columns of the terminal that lines fit; None: any.
        text_below: the last column is text, which goes below each row where there is no room beside it.
    """
    notes = "".join(f"{wrapped(f'  {note}', width, '    ')}\n" for note in found.notes)
    title = f"{wrapped(found.title, width, '  ')}\n" if found.title else ""
    if not found.rows:
        return title + notes
    shown = found.units_in_headings()
    return title + table(shown.columns, shown.rows, shown.numeric, width, text_below) + notes


def sections_text(found: Iterable[Section], width: int | None = None) -> str:
    """Sections one below the other, a blank line before each; without those that are folded or say nothing."""
    shown = [one for one in found if not one.folded and (one.rows or one.notes)]
    return "".join(f"\n{section_text(one, width)}" for one in shown)
