"""Rule (6): a residual above gamma for n samples in a row is a collision; what nearly was, a near miss."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import ceil

import numpy as np
from numpy.typing import NDArray

from collaudit.core.data.audit_result import Spoke
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray, Span
from collaudit.core.numeric.runs import lasting, run_bounds

#: A threshold: constant, or one a sample.
Level = float | FloatArray | NDArray[np.float32]

#: Exceedances of one joint closer than this are one event, s: a push that falters for an instant stays one.
MERGE_S = 0.2
#: The period of a log is known to about this share: 24 ms at 1.9999998 ms is 12 samples, not 13.
_PERIOD_SLACK = 1e-3


@dataclass(frozen=True, slots=True)
class Event:
    """A stretch above a level, in samples.

    Attributes:
        span: from the first to the last sample above the level (exceedances closer than the merging time
            are one event).
        detected: the sample at which the rule fires (the n-th in a row above gamma), or the last for events on which
            it does not.
        longest: longest run of samples above gamma.
        peak: value of the largest |residual|, of those above gamma where some are, signed.
        peak_at: its sample.
    """

    span: Span
    detected: int
    longest: int
    peak: float
    peak_at: int


#: Alarms, and near misses by amplitude and by persistence.
Kinds = tuple[list[Event], list[Event], list[Event]]


def persistence_samples(persistence_s: float, period_s: float) -> int:
    """Persistence in whole samples, rounded up: 25 ms at 2 ms is 13.

    A remainder below a thousandth of a sample is a rounding error of the period, not a further sample.
    """
    return max(1, ceil(persistence_s / period_s - _PERIOD_SLACK))


def rule_events(
    residual: FloatArray,
    evidence: BoolArray,
    gamma: Level,
    n: int,
    near: Level,
    persistence: float,
    merge_samples: int = 0,
) -> Kinds:
    """Rule (6) for one joint: runs of at least n samples above gamma; and what nearly was one, apart from those.

    Args:
        residual: (n,) N·m.
        evidence: (n,) samples that may count.
        gamma: threshold, N·m; one number, or (n,) when it varies.
        n: persistence, samples.
        near: level of a near miss, N·m, at most gamma; one number, or (n,).
        persistence: share of n.
        merge_samples: exceedances closer than this are one event (one push, not several).

    Returns:
        The collisions; ``amplitude``: n samples in a row above the level of a near miss; ``persistence``: above gamma
        for at least persistence·n and fewer than n samples in a row. A stretch that is both is listed as persistence.
    """
    size = np.abs(residual)
    with np.errstate(invalid="ignore"):
        above, nearly = evidence & (size > gamma), evidence & (size > near)
    fired, brief = lasting(above, n), lasting(above, max(1, ceil(persistence * n - 1e-9)))
    hits = [_describe(residual, above, span, n) for span in _events(fired, merge_samples)]
    close = [span for span in _events(brief | lasting(nearly, n), merge_samples) if not fired[span.slice].any()]
    short = [bool(brief[span.slice].any()) for span in close]
    events = [_describe(residual, above, span, n) for span in close]
    low, held = ([e for e, its in zip(events, short, strict=True) if its is kind] for kind in (False, True))
    return hits, low, held


def cycle_events(
    torque: FloatArray, evidence: BoolArray, gamma: Level, n: int, persistence: float, merge_samples: int
) -> Kinds:
    """Rule (6) on the second residual, whose threshold is what motion does: nearly an alarm is what is too brief.

    Args:
        torque: (n,) difference to other cycles, N·m, NaN where there is none.
        evidence, gamma, n, persistence, merge_samples: as of :func:`rule_events`.
    """
    return rule_events(torque, evidence & np.isfinite(torque), gamma, n, gamma, persistence, merge_samples)


#: Events with which residual told them.
Told = list[tuple[Event, Spoke]]


def of_both(model: Kinds, cycle: Kinds, size: int, merge_samples: int) -> tuple[Told, Told, Told]:
    """The events of two residuals of one joint as those of one rule.

    An alarm that both have is the model's; what is nearly an alarm counts where no alarm is, and once.

    Args:
        model, cycle: alarms and the two kinds of near misses, as :func:`rule_events` gives them.
        size: samples of the log.
        merge_samples: events closer than this are the same.

    Returns:
        Alarms and the two kinds of near misses, each with the residual that spoke.
    """
    taken = {"model": _taken(model[0], size, merge_samples), "cycle": _taken(cycle[0], size, merge_samples)}

    def meets(event: Event, spoke: str) -> bool:
        return bool(taken[spoke][event.span.slice].any())

    alarms: Told = [(event, "both" if meets(event, "cycle") else "model") for event in model[0]]
    alarms += _told([event for event in cycle[0] if not meets(event, "model")], "cycle")
    low, brief = (_told([event for event in its if not meets(event, "cycle")], "model") for its in model[1:])
    near = _taken([*model[0], *model[1], *model[2]], size, merge_samples)
    low += _told([event for event in cycle[1] if not near[event.span.slice].any()], "cycle")
    brief += _told([event for event in cycle[2] if not near[event.span.slice].any()], "cycle")
    return alarms, low, brief


def _told(events: Iterable[Event], spoke: Spoke) -> Told:
    return [(event, spoke) for event in events]


def _taken(events: Sequence[Event], size: int, merge: int) -> BoolArray:
    out = np.zeros(size, dtype=np.bool_)
    for event in events:
        out[max(0, event.span.start - merge) : event.span.stop + merge] = True
    return out


def _events(mask: BoolArray, merge: int) -> list[Span]:
    """Runs of samples, those that are close as one."""
    starts, stops = run_bounds(mask)
    return [Span(int(starts[g[0]]), int(stops[g[-1]])) for g in _groups(starts, stops, merge)]


def _groups(starts: IntArray, stops: IntArray, merge: int) -> list[IntArray]:
    """Indices of the runs that are one event."""
    if starts.size == 0:
        return []
    first = np.flatnonzero(np.concatenate(([True], starts[1:] - stops[:-1] >= max(1, merge))))
    return np.split(np.arange(starts.size), first[1:])


def _describe(residual: FloatArray, above: BoolArray, span: Span, n: int) -> Event:
    """The event of a span; ``above`` (n,) tells the samples above the threshold."""
    starts, stops = run_bounds(above[span.slice])
    length = stops - starts
    fires = np.flatnonzero(length >= n)
    longest = int(length.max(initial=0))
    detected = span.stop - 1 if not fires.size else span.start + int(starts[fires[0]]) + n - 1
    counts = above[span.slice] if longest else np.isfinite(residual[span.slice])
    size = np.where(counts, np.abs(residual[span.slice]), 0.0)
    top = span.start + int(np.argmax(size))
    return Event(span, detected, longest, float(residual[top]), top)
