"""Many audits for a terminal, in a line each."""

from __future__ import annotations

from collections.abc import Sequence

from collaudit.reports.terminal.text_table import table
from collaudit.reports.values.entries import IndexEntry, brief_reason, verdict_counts, worst_first
from collaudit.reports.values.words import NONE, VERDICT_WORD, plural

#: Characters of the one reason beside a log among many.
_REASON = 120


def summary_table(entries: Sequence[IndexEntry], width: int | None = None, most: int | None = None) -> str:
    """One line per log, worst first, then the counts.

    Args:
        entries: one per log.
        width: columns of the terminal that the table is cut to; None: any.
        most: lines at most, each with its first reason and how many follow; None: any, with every reason.

    Returns:
        Text that ends in a line feed.
    """
    head = ("verdict", "log", "would have noticed", "contacts", "near misses", "reasons")
    listed = worst_first(entries)[:most]
    lines = [
        (
            entry.word,
            entry.name,
            entry.noticed or NONE,
            entry.counted(entry.contacts),
            entry.counted(entry.near_misses),
            _reasons(entry, brief=most is not None),
        )
        for entry in listed
    ]
    left = len(entries) - len(listed)
    more = f"… and {plural(left, 'more log')}; -v lists all\n" if left else ""
    return table(head, lines, (2, 3, 4), width, text_below=True) + more + "\n" + total_text(entries)


def _reasons(entry: IndexEntry, brief: bool) -> str:
    """Why, then what the verdict leaves out; in brief the first of it, which a line of a file can hold."""
    every = (*entry.reasons, *entry.exclusions)
    if not brief or not every:
        return "; ".join(every)
    first = brief_reason(entry, _REASON)
    return f"{first} (and {len(every) - 1} more)" if len(every) > 1 else first


def total_text(entries: Sequence[IndexEntry]) -> str:
    """How many logs have which verdict, in one line."""
    counts = verdict_counts(entries)
    total = ", ".join(f"{counts[verdict]} {word.lower()}" for verdict, word in VERDICT_WORD.items())
    return f"{plural(len(entries), 'log')}: {total}\n"
