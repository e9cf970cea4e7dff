"""Near misses, those closest to an alarm first."""

from __future__ import annotations

from dataclasses import dataclass

from collaudit.core.data.audit_result import AuditResult
from collaudit.reports.values import rows
from collaudit.reports.values.times import clock_text


@dataclass(frozen=True, slots=True)
class LedgerRow:
    """One near miss; ``number`` counts in order of time, ``window`` are the seconds a plot of it shows."""

    anchor: str
    number: int
    row: rows.NearMissRow
    clock: str
    window: tuple[float, float]


def near_miss_ledger(result: AuditResult, key: str) -> tuple[LedgerRow, ...]:
    """Every near miss, by distance to an alarm."""
    numbered = list(enumerate(rows.in_time(result.near_misses), 1))
    numbered.sort(key=lambda item: (-item[1].ratio, item[0]))
    return tuple(
        LedgerRow(
            f"{key}-near-miss-{number}",
            number,
            rows.near_miss_row(event, result),
            clock_text(result.log.start, event.onset_s),
            (event.onset_s - 0.2, event.onset_s + event.duration_s + 0.2),
        )
        for number, event in numbered
    )
