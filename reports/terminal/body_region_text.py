"""Estimated contact forces beside the user's limits, for a terminal."""

from __future__ import annotations

from collections.abc import Sequence

from collaudit.core.data.audit_result import AuditResult
from collaudit.reports.terminal.text_table import table, wrapped
from collaudit.reports.values.body_regions import CANNOT_BE_CONCLUDED, BodyLimits, body_region_rows
from collaudit.reports.values.visible_text import visible
from collaudit.reports.values.words import nothing_judged


def body_region_text(results: Sequence[AuditResult], limits: BodyLimits, width: int | None = None) -> str:
    """A table of each log with contacts, then what cannot be concluded.

    Args:
        results: of the runs.
        limits: as the user's file states them.
        width: columns of the terminal that tables are cut to; None: any.
    """
    parts = [wrapped(f"Limits by body region, as stated by: {visible(limits.source)}", width) + "\n"]
    for result in results:
        lines = [(r.onset, r.joints, r.force, r.region, r.limit, r.beside) for r in body_region_rows(result, limits)]
        head = ("onset", "joints", "estimated force (95 %)", "region", "limit", "force beside limit")
        none = "not judged\n" if nothing_judged(result) else "no contact was found in the time that was judged\n"
        parts.append(
            f"\n{visible(result.log.name)}\n" + (table(head, lines, (0,), width, fold=True) if lines else none)
        )
    parts.append(f"\n{wrapped(CANNOT_BE_CONCLUDED, width)}\n")
    return "".join(parts)
