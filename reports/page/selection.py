"""Which events get a drawing when there are more than anyone would look at."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

_WORST_SHARE = 5


@dataclass(frozen=True, slots=True)
class Selection:
    """Indices of the events that are drawn, and what is said about the others (None: all are drawn)."""

    drawn: frozenset[int]
    note: str | None


def select(heights: Sequence[float], limit: int) -> Selection:
    """The first events, and those with the highest peak for their threshold.

    Args:
        heights: peak over threshold of each event, in order of time.
        limit: how many to draw at most, at least 1.
    """
    count = len(heights)
    if count <= limit:
        return Selection(frozenset(range(count)), None)
    worst_count = max(1, limit // _WORST_SHARE)
    worst = sorted(range(count), key=lambda k: (-heights[k], k))[:worst_count]
    others = [k for k in range(count) if k not in set(worst)][: limit - worst_count]
    note = (
        f"{limit} of {count} are drawn: the first {len(others)} and the {worst_count} with the highest "
        f"peak. {count - limit} are not drawn; the table lists all."
    )
    return Selection(frozenset(worst) | frozenset(others), note)
