"""The one form in which a report states facts: a titled table of text with notes."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

Rows = tuple[tuple[str, ...], ...]

#: What stands where there is no value.
BLANK = frozenset({"", "–", "none", "no force", "not felt", "not known", "not watched", "open", "unknown"})
_NUMBER = re.compile(r"[-−+±×≤≥<>]? ?\d(?:[^;:,]|,(?=\d)){0,32}")
_WITH_UNIT = re.compile(r"[-−+]?\d[\d.,e+-]* (N·m|N)( ▲)?")


@dataclass(frozen=True, slots=True)
class Section:
    """One subject of a report; every value is text with its unit.

    Attributes:
        title: what the rows show.
        columns: headings.
        rows: cells; the first names the row. A cell of several lines says the later ones in detail.
        notes: sentences that go with the rows, or stand in their place.
        folded: long, and second to others: not for a terminal.
        windows: of each row the seconds of the log that show it; empty where no signals belong to it.
    """

    title: str
    columns: tuple[str, ...]
    rows: Rows
    notes: tuple[str, ...] = ()
    folded: bool = False
    windows: tuple[tuple[float, float], ...] = ()

    @property
    def numeric(self) -> tuple[int, ...]:
        """Places of the columns that hold numbers."""
        return tuple(
            k
            for k in range(len(self.columns))
            if any(row[k] not in BLANK for row in self.rows)
            and all(row[k] in BLANK or _NUMBER.fullmatch(row[k]) for row in self.rows)
        )

    @property
    def records(self) -> list[dict[str, str]]:
        """Each row by heading."""
        return [dict(zip(self.columns, row, strict=True)) for row in self.rows]

    def only(self, *columns: str) -> Section:
        """With these columns, in this order; one that says nothing in any row is left out."""
        if not self.rows:
            return self
        kept = [self.columns.index(name) for name in columns]
        filled = [k for k in kept if any(row[k] for row in self.rows)]
        cells = tuple(tuple(row[k] for k in filled) for row in self.rows)
        return replace(self, columns=tuple(self.columns[k] for k in filled), rows=cells)

    def part(self, start: int, stop: int | None = None) -> Section:
        """With some of the rows; the notes stay with the first of them."""
        notes = self.notes if start == 0 else ()
        return replace(self, rows=self.rows[start:stop], windows=self.windows[start:stop], notes=notes)

    def units_in_headings(self) -> Section:
        """Torques and forces without the unit that all of a column share: its heading has it."""
        columns, cells = list(self.columns), [list(row) for row in self.rows]
        for k, name in enumerate(self.columns):
            found = [_WITH_UNIT.fullmatch(row[k]) for row in self.rows if row[k] not in BLANK]
            units = {match[1] if match else "" for match in found}
            if len(units) == 1 and (unit := units.pop()):
                columns[k] = f"{name}, {unit}"
                for row in cells:
                    row[k] = row[k].replace(f" {unit}", "")
        return replace(self, columns=tuple(columns), rows=tuple(tuple(row) for row in cells))


def section_of(title: str, records: Iterable[Mapping[str, str]], *notes: str, folded: bool = False) -> Section:
    """A section whose rows state each cell beside its heading; without rows it says nothing.

    Args:
        title: what the rows show.
        records: of each row its cells by heading, all alike.
        notes: sentences that go with the rows.
        folded: as of :class:`Section`.
    """
    rows = list(records)
    if not rows:
        return Section(title, (), (), (), folded)
    return Section(title, tuple(rows[0]), tuple(tuple(row.values()) for row in rows), notes, folded)
