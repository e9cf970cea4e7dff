"""How results show themselves at a prompt and in a notebook: a title and a few rows, never all of their numbers.

A class with a method ``outline`` takes :func:`text` as its ``__repr__`` and :func:`html` as its ``_repr_html_``, which
IPython asks for.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Sequence
from html import escape
from typing import Protocol

#: Columns of a screen, letters of one row's value, and rows: more would not fit a screen of 24 lines.
_WIDTH, _LONGEST, _ROWS = 100, 280, 12

#: A title, and terms with their values.
Shown = tuple[str, Sequence[tuple[str, str]]]


class Showing(Protocol):
    """What says in short what it is."""

    def outline(self) -> Shown:
        """Title, and terms with values."""


def text(self: Showing) -> str:
    """A screen of text at most."""
    title, rows = self.outline()
    wide = max((len(term) for term, _ in rows), default=0)
    lines = [textwrap.shorten(title, _WIDTH, placeholder=" …")]
    for term, value in rows[:_ROWS]:
        kept = textwrap.shorten(value, _LONGEST, placeholder=" …")
        lines += textwrap.wrap(kept, _WIDTH, initial_indent=f"  {term:{wide}}  ", subsequent_indent=" " * (wide + 4))
    return "\n".join(lines[:24])


def html(self: Showing) -> str:
    """The same as a table, with every text escaped."""
    title, rows = self.outline()
    cells = "".join(
        f'<tr><th style="text-align:left">{escape(term)}</th><td style="text-align:left">{escape(value)}</td></tr>'
        for term, value in rows
    )
    return f"<strong>{escape(title)}</strong><table>{cells}</table>"


def first(values: Iterable[str], count: int = 3) -> str:
    """The first few of a list, and how many there are beyond them."""
    every = list(values)
    more = f"; and {len(every) - count} more" if len(every) > count else ""
    return "; ".join(value.rstrip(".") for value in every[:count]) + more
