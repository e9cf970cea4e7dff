"""Which contacts get a card when there are more than fit on the page."""

from __future__ import annotations

from collections.abc import Sequence


def furthest(heights: Sequence[float], limit: int) -> list[int]:
    """Indices of the highest, in order of time; of equals the earlier.

    Args:
        heights: peak over threshold of each contact, in order of time.
        limit: how many at most.
    """
    return sorted(sorted(range(len(heights)), key=lambda k: (-heights[k], k))[:limit])
