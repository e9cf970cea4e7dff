"""Aligned columns for a terminal; wcwidth knows how wide letters of every script are."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator, Sequence

from collaudit.reports.values.visible_text import visible

_GAP = "  "
_LEAST_TEXT = 10
_BELOW = " " * 4
_CUT = "…"
#: Latin and Greek letters and common signs take one column each; wcwidth, which takes 10 ms to import, is not asked.
_NARROW = re.compile("[ -~\u00a1-\u00ac\u00ae-\u02ff\u0391-\u03ff–—‘’“”…‰→←−≈≤≥×·√∞]*")


def table(
    head: Sequence[str],
    lines: Sequence[Sequence[str]],
    numeric: Sequence[int] = (),
    width: int | None = None,
    fold: bool = False,
) -> str:
    """Aligned columns with a header line and a rule under it.

    Args:
        head: column titles.
        lines: cells; control characters are spelt out.
        numeric: columns that are flush right.
        width: columns of the terminal that the table must fit: long titles are folded, then the widest columns of
            text become narrower, the first column last, and at the end lines are cut. None: nothing is, as in files
            and pipes.
        fold: text that does not fit goes on in the next line; else it is cut, and the cut is marked.

    Returns:
        Text that ends in a line feed.
    """
    cells = [[visible(cell) for cell in line] for line in (head, *lines)]
    if width is not None:
        widths = _widths(cells, numeric, width)
        titles = [_folded(cell, wide) for cell, wide in zip(cells[0], widths, strict=True)]
        above = list(_side_by_side(titles))
        below = [row for line in cells[1:] for row in _narrowed(line, widths, fold)]
    else:
        above, below = cells[:1], cells[1:]
    text = _aligned(above, below, numeric)
    return "".join(f"{line if width is None else _cut(line, width)}\n" for line in text)


def table_with_text(
    head: Sequence[str], lines: Sequence[Sequence[str]], numeric: Sequence[int] = (), width: int | None = None
) -> str:
    """A table whose last column is text: below each row, and whole, where the terminal has no room beside it.

    Args:
        head: column titles.
        lines: cells.
        numeric: columns that are flush right.
        width: columns of the terminal; None: any.
    """
    whole = table(head, lines, numeric)
    if width is None or max(map(len, whole.splitlines())) <= width:
        return whole
    shown = table(head[:-1], [line[:-1] for line in lines], numeric, width).splitlines()
    above, rows = shown[: len(shown) - len(lines)], shown[len(shown) - len(lines) :]
    under = [_folded(visible(line[-1]), max(width, 40) - len(_BELOW)) if line[-1] else [] for line in lines]
    below = ["\n".join((row, *(_BELOW + text for text in texts))) for row, texts in zip(rows, under, strict=True)]
    return "\n".join((*above, *below)) + "\n"


def wrapped(text: str, width: int | None, indent: str = "") -> str:
    """Text in lines of the terminal's width at most, the later ones indented; None: one line.

    Names, paths and options are never broken, so that they can be copied.

    Args:
        text: one line.
        width: columns of the terminal.
        indent: before every line but the first.
    """
    if width is None:
        return text
    lines = textwrap.wrap(
        text, max(width, 40), subsequent_indent=indent, break_on_hyphens=False, break_long_words=False
    )
    return "\n".join(lines or [""])


def _aligned(above: Sequence[Sequence[str]], below: Sequence[Sequence[str]], numeric: Sequence[int]) -> Iterator[str]:
    """Rows of equal columns, with a rule between those above and those below."""
    rows = [[cell.strip() for cell in row] for row in (*above, *below)]
    wide = [max(map(_columns, column)) for column in zip(*rows, strict=True)]
    rule = _GAP.join("-" * columns for columns in wide).rstrip()
    for number, row in enumerate(rows):
        if number == len(above):
            yield rule
        room = [" " * (columns - _columns(cell)) for cell, columns in zip(row, wide, strict=True)]
        sides = enumerate(zip(row, room, strict=True))
        yield _GAP.join(blank + cell if k in numeric else cell + blank for k, (cell, blank) in sides).rstrip()
    if len(rows) == len(above):
        yield rule


def _columns(text: str) -> int:
    """Columns that a text takes."""
    if _NARROW.fullmatch(text):
        return len(text)
    from wcwidth import wcswidth

    return wcswidth(text)


def _widths(cells: list[list[str]], numeric: Sequence[int], width: int) -> list[int]:
    """Columns that each column gets: titles give first, then columns of text; numbers stay whole."""
    columns = range(len(cells[0]))
    body = [max((_columns(line[k]) for line in cells[1:]), default=0) for k in columns]
    widths = [max(_columns(cells[0][k]), body[k]) for k in columns]
    excess = sum(widths) + len(_GAP) * (len(widths) - 1) - width
    least = [max(body[k], *(_columns(word) for word in cells[0][k].split() or [""])) for k in columns]
    for _ in range(excess):
        longest = max(columns, key=lambda k: widths[k] - least[k])
        if widths[longest] <= least[longest]:
            break
        widths[longest] -= 1
        excess -= 1
    words = [k for k in columns if k not in numeric]
    for giving in (words[1:] if words[:1] == [0] else words, words):
        while excess > 0 and giving:
            widest = max(giving, key=widths.__getitem__)
            if widths[widest] <= _LEAST_TEXT:
                break
            widths[widest] -= 1
            excess -= 1
    return widths


def _narrowed(line: Sequence[str], widths: Sequence[int], fold: bool) -> Iterator[list[str]]:
    if fold:
        yield from _side_by_side([_folded(cell, wide) for cell, wide in zip(line, widths, strict=True)])
    else:
        yield [_cut(cell, wide) for cell, wide in zip(line, widths, strict=True)]


def _side_by_side(columns: Sequence[Sequence[str]]) -> Iterator[list[str]]:
    """Rows of cells that are several lines high."""
    for k in range(max((len(column) for column in columns), default=0)):
        yield [column[k] if k < len(column) else "" for column in columns]


def _folded(text: str, width: int) -> list[str]:
    """A cell in lines of its column: parts two blanks apart stay together where they fit, then words, then letters."""
    lines: list[str] = []
    for part in text.split(_GAP):
        if lines and _columns(f"{lines[-1]}{_GAP}{part}") <= width:
            lines[-1] += _GAP + part
            continue
        words = part.split(" ") if _columns(part) > width else [part]
        for k, word in enumerate(words):
            if k and _columns(f"{lines[-1]} {word}") <= width:
                lines[-1] += f" {word}"
                continue
            while _columns(word) > width and (start := _start(word, width)) and word.startswith(start):
                lines.append(start)
                word = word[len(start) :]
            lines.append(word)
    return lines or [""]


def _cut(text: str, width: int) -> str:
    """Text in at most ``width`` columns; what was cut ends in a mark."""
    return text if _columns(text) <= width else _start(text, max(width - 1, 0)) + _CUT


def _start(text: str, width: int) -> str:
    """As much of a text as these columns hold."""
    from wcwidth import clip

    return clip(text, 0, width).rstrip()
