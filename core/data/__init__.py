"""What the stages hand to each other: logs, series, signals, results; frozen types that show themselves in short.

In: what a stage computed. Out: the same, read-only, in the shape of the JSON files where it becomes one.
Elsewhere: every computation, every file.

At a prompt and in a notebook a result is a title and a few rows, never all of its numbers; things of one name are told
apart there and in files.

Where results are validated as JSON, annotations are objects (no ``from __future__ import annotations``): msgspec would
compile and evaluate the text of each.
"""

from __future__ import annotations

import textwrap
from collections import Counter
from collections.abc import Iterable, Sequence
from html import escape

#: Columns of a screen, letters of one row's value, and rows: more would not fit a screen of 24 lines.
_WIDTH, _LONGEST, _ROWS = 100, 280, 12

#: A title, and terms with their values.
Shown = tuple[str, Sequence[tuple[str, str]]]


class Showing:
    """A result that says in short what it is, at a prompt and to IPython, which asks for HTML."""

    __slots__ = ()

    def outline(self) -> Shown:
        """Title, and terms with values."""
        raise NotImplementedError

    def __repr__(self) -> str:
        title, rows = self.outline()
        wide = max((len(term) for term, _ in rows), default=0)
        lines = [textwrap.shorten(title, _WIDTH, placeholder=" …")]
        for term, value in rows[:_ROWS]:
            kept = textwrap.shorten(value, _LONGEST, placeholder=" …")
            head, under = f"  {term:{wide}}  ", " " * (wide + 4)
            lines += textwrap.wrap(kept, _WIDTH, initial_indent=head, subsequent_indent=under)
        return "\n".join(lines[:24])

    def _repr_html_(self) -> str:
        title, rows = self.outline()
        cells = "".join(
            f'<tr><th style="text-align:left">{escape(term)}</th><td style="text-align:left">{escape(value)}</td></tr>'
            for term, value in rows
        )
        return f"<strong>{escape(title)}</strong><table>{cells}</table>"


def first_few(values: Iterable[str], count: int = 3) -> str:
    """The first few of a list, and how many there are beyond them."""
    every = list(values)
    more = f"; and {len(every) - count} more" if len(every) > count else ""
    return "; ".join(value.rstrip(".") for value in every[:count]) + more


def distinct(names: Sequence[str]) -> list[str]:
    """The names; one that came before counts up, since what reads our files takes two of one name for one log."""
    seen: Counter[str] = Counter()
    out = []
    for name in names:
        seen[name] += 1
        out.append(name if seen[name] == 1 else f"{name}#{seen[name]}")
    return out
