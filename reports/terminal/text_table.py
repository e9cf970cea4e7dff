"""Sections and aligned columns for a terminal; wcwidth knows how wide letters of every script are."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import chain, zip_longest

from wcwidth import clip, ljust, rjust, wcswidth, wrap

from collaudit.reports.sections.section import Section
from collaudit.reports.values.visible_text import visible, wrapped

_GAP = "  "
_LEAST_TEXT = 10
_BELOW = " " * 4
_CUT = "…"
#: A row of a table: its lines, each with a cell a column.
_Row = Sequence[Sequence[str]]


def table(
    head: Sequence[str],
    lines: Sequence[Sequence[str]],
    numeric: Sequence[int] = (),
    width: int | None = None,
    text_below: bool = False,
) -> str:
    """Aligned columns with a header line and a rule under it.

    Args:
        head: column titles.
        lines: cells; control characters are spelt out.
        numeric: columns that are flush right.
        width: columns of the terminal that the table must fit: long titles are folded, then text in the widest
            columns, the first column last, and at the end lines are cut. None: nothing is, as in files and pipes.
        text_below: the last column is text, which stands below its row where there is no room beside it; the others
            are cut then, not folded.

    Returns:
        Text that ends in a line feed.
    """
    cells = [[visible(cell).strip() for cell in line] for line in (head, *lines)]
    groups = _aligned([[line] for line in cells], numeric)
    if width is not None and max(map(wcswidth, chain(*groups))) > width:
        text = [line.pop() for line in cells][1:] if text_below else [""] * len(lines)
        notes = [[_BELOW + part for part in _folded(one, max(width, 40) - len(_BELOW))] if one else [] for one in text]
        widths = _widths(cells, numeric, width)
        folded: list[_Row] = [list(zip_longest(*map(_folded, line, widths), fillvalue="")) for line in cells]
        if text_below:
            folded[1:] = [[list(map(_shortened, line, widths))] for line in cells[1:]]
        rows = [[_cut(line, width) for line in group] for group in _aligned(folded, numeric)]
        groups = [rows[0], *(row + note for row, note in zip(rows[1:], notes, strict=True))]
    return "".join(f"{line}\n" for line in chain(*groups))


def _aligned(rows: Sequence[_Row], numeric: Sequence[int]) -> list[list[str]]:
    """Lines of each row in equal columns, with a rule under the first."""
    columns = [max(map(wcswidth, column)) for column in zip(*chain(*rows), strict=True)]
    sides = [(rjust if k in numeric else ljust, wide) for k, wide in enumerate(columns)]
    laid = [
        [_GAP.join(side(cell, wide) for cell, (side, wide) in zip(line, sides, strict=True)).rstrip() for line in row]
        for row in rows
    ]
    laid[0].append(_GAP.join("-" * wide for wide in columns).rstrip())
    return laid


def _widths(cells: Sequence[Sequence[str]], numeric: Sequence[int], width: int) -> list[int]:
    """Columns that each column gets: titles give first, then columns of text; numbers stay whole."""
    columns = range(len(cells[0]))
    body = [max((wcswidth(line[k]) for line in cells[1:]), default=0) for k in columns]
    widths = [max(wcswidth(cells[0][k]), body[k]) for k in columns]
    room = width - len(_GAP) * (len(widths) - 1)
    titles = [max(body[k], *(wcswidth(word) for word in cells[0][k].split() or [""])) for k in columns]
    text = [k for k in columns if k not in numeric]
    _give(widths, list(columns), titles, room)
    for giving in (text[1:] if text[:1] == [0] else text, text):
        _give(widths, giving, [_LEAST_TEXT] * len(widths), room)
    return widths


def _give(widths: list[int], giving: Sequence[int], least: Sequence[int], room: int) -> None:
    """Make the columns that have most to give narrower, down to the least of each."""
    for _ in range(sum(widths) - room):
        widest = max(giving, key=lambda k: widths[k] - least[k], default=None)
        if widest is None or widths[widest] <= least[widest]:
            return
        widths[widest] -= 1


def _folded(text: str, width: int) -> list[str]:
    """A cell in lines of its column: parts two blanks apart stay together where they fit, then words, then letters."""
    parts = [part.replace(" ", "\xa0") if wcswidth(part) <= width else part for part in text.split(_GAP)]
    lines = wrap(_GAP.join(parts), width, break_on_hyphens=False)
    return [line.replace("\xa0", " ") for line in lines] or [""]


def _cut(text: str, width: int) -> str:
    """Text in at most ``width`` columns; what was cut ends in a mark."""
    return text if wcswidth(text) <= width else clip(text, 0, max(width - 1, 0)).rstrip() + _CUT


def _shortened(text: str, width: int) -> str:
    """A cell in at most ``width`` columns, cut in the middle: names that differ at their ends stay told apart."""
    wide = wcswidth(text)
    if wide <= width or width < _LEAST_TEXT:
        return _cut(text, width)
    tail = clip(text, wide - width // 2, wide)
    return clip(text, 0, width - 1 - wcswidth(tail)) + _CUT + tail


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
