"""The columns of a table, for a terminal: one line for those that differ in a number only."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import groupby

from collaudit.core.logs.log_summary import ColumnInfo
from collaudit.reports.terminal.text_table import table


def columns_text(columns: Sequence[ColumnInfo], width: int | None = None) -> str:
    """Name, unit, range, changes, role and its reason of each column.

    Args:
        columns: of one log.
        width: that lines are cut to; None: any.
    """
    several = len({column.file for column in columns}) > 1
    rows = [_row(list(group), several=several) for _, group in groupby(columns, _family)]
    return table(("column", "unit", "min", "max", "changes", "role", "why"), rows, (2, 3, 4), width, fold=True).rstrip()


def _family(column: ColumnInfo) -> tuple[str, ...]:
    return re.sub(r"\d+", "#", column.name), column.unit, column.role, column.why, column.file


def _row(group: Sequence[ColumnInfo], *, several: bool) -> tuple[str, ...]:
    first, last = group[0], group[-1]
    name = first.name if len(group) == 1 else f"{first.name} … {last.name}"
    changes = sorted({column.changes for column in group if column.changes is not None})
    lows = [column.min for column in group if column.min is not None]
    highs = [column.max for column in group if column.max is not None]
    return (
        f"{name} ({first.file})" if several else name,
        first.unit,
        f"{min(lows):.6g}" if lows else "",
        f"{max(highs):.6g}" if highs else "",
        "" if not changes else str(changes[0]) if len(changes) == 1 else f"{changes[0]}–{changes[-1]}",
        first.role + (f" ({len(group)})" if len(group) > 1 else ""),
        first.why,
    )
