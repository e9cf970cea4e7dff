"""Aligned columns for a terminal; tabulate and wcwidth know how wide letters of every script are."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

from collaudit.reports.values.visible_text import visible

_GAP = "  "
_LEAST_TEXT = 12
_CUT = "…"


def table(
    head: Sequence[str], lines: Sequence[Sequence[str]], numeric: Sequence[int] = (), width: int | None = None
) -> str:
    """Aligned columns with a header line and a rule under it.

    Args:
        head: column titles.
        lines: cells; control characters are spelt out.
        numeric: columns that are flush right.
        width: columns of the terminal that the table is cut to: the widest columns of text first, then the ends of
            lines, each cut marked. None: nothing is cut, as in files and pipes.

    Returns:
        Text that ends in a line feed.
    """
    from tabulate import SEPARATING_LINE, DataRow, Line, TableFormat, tabulate

    cells = [[visible(cell) for cell in line] for line in (head, *lines)]
    if width is not None:
        cells = _shortened(cells, numeric, width)
    row = DataRow("", _GAP, "")
    # The head goes as a row: tabulate gives titles two columns more than they need.
    shape = TableFormat(None, Line("", "-", _GAP, ""), None, None, row, row, 0, None)
    alignment = ["right" if k in numeric else "left" for k in range(len(head))]
    text = tabulate([cells[0], SEPARATING_LINE, *cells[1:]], tablefmt=shape, disable_numparse=True, colalign=alignment)
    return "".join(f"{line if width is None else _cut(line, width)}\n" for line in text.split("\n"))


def wrapped(text: str, width: int | None, indent: str = "") -> str:
    """Text in lines of the terminal's width at most, the later ones indented; None: one line.

    Args:
        text: one line.
        width: columns of the terminal.
        indent: before every line but the first.
    """
    return text if width is None else "\n".join(textwrap.wrap(text, max(width, 40), subsequent_indent=indent) or [""])


def _shortened(cells: list[list[str]], numeric: Sequence[int], width: int) -> list[list[str]]:
    """Cells cut so that the table fits, as far as columns of text can give; numbers stay whole."""
    from wcwidth import wcswidth

    columns = range(len(cells[0]))
    widths = [max(wcswidth(line[k]) for line in cells) for k in columns]
    words = [k for k in columns if k not in numeric]
    excess = sum(widths) + len(_GAP) * (len(widths) - 1) - width
    for _ in range(excess if words else 0):
        widest = max(words, key=widths.__getitem__)
        if widths[widest] <= _LEAST_TEXT:
            break
        widths[widest] -= 1
    return [[_cut(line[k], widths[k]) for k in columns] for line in cells]


def _cut(text: str, width: int) -> str:
    """Text in at most ``width`` columns; what was cut ends in a mark."""
    from wcwidth import clip, wcswidth

    return text if wcswidth(text) <= width else clip(text, 0, max(width - 1, 0)).rstrip() + _CUT
