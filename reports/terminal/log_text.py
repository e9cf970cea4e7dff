"""What is in a log, for a terminal."""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import UTC, datetime
from itertools import groupby
from textwrap import indent

from collaudit.core.logs.log_summary import ColumnInfo, LogSummary, TopicInfo
from collaudit.reports.terminal.text_table import table

_LONGEST_LIST = 24
_INDENT = "  "


def log_text(summary: LogSummary, width: int | None = None) -> str:
    """What is in a log: its size and length, a table of its topics, the joints of each.

    Args:
        summary: of the log.
        width: columns of the terminal that the table is cut to; None: any.
    """
    title = [summary.name, f"{summary.format}, {_bytes(summary.size_bytes)}"]
    if summary.duration_s is not None:
        title.append(f"{summary.duration_s:.3f} s")
    if summary.start_ns is not None:
        title.append(f"starts {datetime.fromtimestamp(summary.start_ns / 1e9, UTC):%Y-%m-%d %H:%M:%S} UTC")
    lines = ["  ".join(title)]
    room = None if width is None else width - len(_INDENT)
    if summary.columns:
        lines.append(indent(columns_text(summary.columns, room), _INDENT))
    elif summary.csv_columns:
        lines.append(f"  {len(summary.csv_columns)} columns: {_listed(summary.csv_columns)}")
    if summary.topics:
        rows = [
            (
                topic.name,
                topic.type,
                topic.role.replace("_", " "),
                str(topic.count),
                "" if topic.rate_hz is None else f"{topic.rate_hz:.1f}",
                "" if topic.largest_gap_s is None else f"{topic.largest_gap_s:.3f}",
                topic.note,
            )
            for topic in summary.topics
        ]
        head = ("topic", "type", "role", "messages", "Hz", "largest gap s", "note")
        lines.append(indent(table(head, rows, (3, 4, 5), room, text_below=True).rstrip(), _INDENT))
        lines += [f"  joints of {topic.name}: {_joints(topic)}" for topic in summary.topics if topic.joints]
    return "\n".join(lines)


def _joints(topic: TopicInfo) -> str:
    present = {"velocity": topic.has_velocity, "effort": topic.has_effort}
    lacking = [f"no {name}" for name, there in present.items() if there is False]
    return _listed(topic.joints) + (f" ({', '.join(lacking)})" if lacking else "")


def _listed(names: tuple[str, ...]) -> str:
    shown = [name for name in names if name][:_LONGEST_LIST]
    return ", ".join(shown) + (", …" if len(names) > _LONGEST_LIST else "")


def _bytes(size: int) -> str:
    """A size in the unit a reader thinks in."""
    value, units = float(size), ["B", "kB", "MB", "GB"]
    while value >= 1000 and len(units) > 1:
        value, units = value / 1000, units[1:]
    return f"{value:.0f} {units[0]}" if units[0] == "B" else f"{value:.1f} {units[0]}"


def columns_text(columns: Sequence[ColumnInfo], width: int | None = None) -> str:
    """Name, unit, range, changes, role and its reason of each column.

    Args:
        columns: of one log.
        width: that lines are cut to; None: any.
    """
    several = len({column.file for column in columns}) > 1
    rows = [_row(list(group), several=several) for _, group in groupby(columns, _family)]
    return table(("column", "unit", "min", "max", "changes", "role", "why"), rows, (2, 3, 4), width).rstrip()


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
