"""Progress of work in stages: each reports its own part, the caller sees the share of the whole."""

from __future__ import annotations

from collections.abc import Callable

#: Called with what is done and what there is in all.
Progress = Callable[[int, int], None]

_STEPS = 1000


def stage(progress: Progress | None, start: float, end: float) -> Progress:
    """A callback for one stage of some work.

    Args:
        progress: of the whole; None: nobody asks.
        start, end: shares of the whole at which the stage begins and ends, 0 to 1, as its time usually is.
    """

    def report(done: int, total: int) -> None:
        if progress is not None and total > 0:
            progress(round(_STEPS * (start + (end - start) * min(done / total, 1.0))), _STEPS)

    return report
