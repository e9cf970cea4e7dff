"""Which events get a plot when there are more than anyone would look at."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from collaudit.core.data.audit_result import Collision, NearMiss

_WORST_SHARE = 5


@dataclass(frozen=True, slots=True)
class Selection:
    """Indices of the events that are drawn, and what is said about the others (None: all are drawn)."""

    drawn: frozenset[int]
    note: str | None


def select(events: Sequence[Collision | NearMiss], limit: int) -> Selection:
    """The first events, and those with the highest peak for their threshold.

    Args:
        events: in order of time.
        limit: how many to draw at most, at least 1.
    """
    count = len(events)
    if count <= limit:
        return Selection(frozenset(range(count)), None)
    worst_count = max(1, limit // _WORST_SHARE)
    by_height = sorted(range(count), key=lambda k: (-abs(events[k].peak_nm) / events[k].gamma_nm, k))
    worst = by_height[:worst_count]
    others = [k for k in range(count) if k not in set(worst)][: limit - worst_count]
    note = (
        f"{limit} of {count} are drawn: the first {len(others)} and the {worst_count} with the highest "
        f"peak. {count - limit} are not drawn; the table lists all."
    )
    return Selection(frozenset(worst) | frozenset(others), note)
