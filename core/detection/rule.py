"""Rule (6): a residual above gamma for n samples in a row is a collision; what nearly was, a near miss."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil

import numpy as np

from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray, Span
from collaudit.core.numeric.runs import run_bounds, trailing_means

#: A threshold: constant, or one a sample.
Level = float | FloatArray

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
        detected: the sample at which the rule fires (the n-th in a row), or the last of the longest run
            for events on which it does not.
        longest: longest run of samples above the level; of a mean, the samples above it.
        peak: value of the largest |residual|, signed.
    """

    span: Span
    detected: int
    longest: int
    peak: float


def persistence_samples(persistence_s: float, period_s: float) -> int:
    """Persistence in whole samples, rounded up: 25 ms at 2 ms is 13.

    A remainder below a thousandth of a sample is a rounding error of the period, not a further sample.
    """
    return max(1, ceil(persistence_s / period_s - _PERIOD_SLACK))


def exceedances(residual: FloatArray, evidence: BoolArray, level: Level) -> tuple[IntArray, IntArray]:
    """Runs (starts, stops) of judged samples with |residual| > level. NaN never exceeds.

    Args:
        residual: (n,) N·m.
        evidence: (n,) samples that may count; a gap is False and so breaks a run.
        level: N·m; one number, or (n,) when it varies.
    """
    return run_bounds(_above(residual, evidence, level))


def _above(residual: FloatArray, evidence: BoolArray, level: Level) -> BoolArray:
    """(n,) samples of evidence above the level."""
    with np.errstate(invalid="ignore"):
        above = np.abs(residual) > level
    above &= evidence
    return above


def _tolerant_runs(residual: FloatArray, evidence: BoolArray, level: Level) -> tuple[IntArray, IntArray]:
    """Runs above the level, over single samples of evidence below it: noise does not end a near miss."""
    above = _above(residual, evidence, level)
    alone = ~above[1:-1] & above[:-2] & above[2:]
    above[1:-1] |= alone & evidence[1:-1]
    return run_bounds(above)


def lasting_collisions(residual: FloatArray, evidence: BoolArray, level: FloatArray, n: int, merge: int) -> list[Event]:
    """Stretches in which the mean of n samples of the residual exceeds that of the level.

    An event is from the first to the last of those samples above the level; it is detected at the last sample of the
    first such mean.

    Args:
        residual: (m,) N·m.
        evidence: (m,) samples that may count; all of a mean must.
        level: (m,) N·m.
        n: samples that a mean is taken over.
        merge: events closer than so many samples are one.
    """
    with np.errstate(invalid="ignore"):
        high = np.abs(trailing_means(residual, evidence, n)) > trailing_means(level, evidence, n)
    ends, after = run_bounds(high)
    out = []
    for group in _groups(ends - (n - 1), after, merge):
        begin = int(ends[group[0]]) - (n - 1)
        part = slice(begin, int(after[group[-1]]))
        own = np.nan_to_num(residual[part])
        above = begin + np.flatnonzero(np.abs(own) > level[part])
        span = Span(int(above[0]), int(above[-1]) + 1)
        out.append(Event(span, int(ends[group[0]]), above.size, float(own[np.argmax(np.abs(own))])))
    return out


def rule_events(
    residual: FloatArray,
    evidence: BoolArray,
    gamma: Level,
    n: int,
    amplitude: float,
    persistence: float,
    merge_samples: int = 0,
) -> tuple[list[Event], list[Event], list[Event]]:
    """Rule (6) for one joint: runs of at least n samples above gamma, and what nearly was one, away from those.

    Args:
        residual: (n,) N·m.
        evidence: (n,) samples that may count.
        gamma: threshold, N·m; one number, or (n,) when it varies.
        n: persistence, samples.
        amplitude, persistence: shares of gamma and of n.
        merge_samples: collisions closer than this are one event (one push, not several).

    Returns:
        The collisions; ``amplitude``: n samples in a row above amplitude·gamma, where single samples may lie below;
        ``persistence``: above gamma for at
        least persistence·n and fewer than n samples in a row. A stretch that is both is listed as persistence.
    """
    above = exceedances(residual, evidence, gamma)
    hits = _lasting(residual, above, n, merge_samples)
    length = above[1] - above[0]
    short = (length < n) & (length >= max(1, ceil(persistence * n - 1e-9)))
    brief = _events(residual, above[0][short], above[1][short], n, merge_samples)
    brief = apart(brief, hits, merge_samples)
    low = _lasting(residual, _tolerant_runs(residual, evidence, amplitude * gamma), n, merge_samples)
    return hits, apart(low, hits + brief, merge_samples), brief


def _lasting(residual: FloatArray, runs: tuple[IntArray, IntArray], n: int, merge: int) -> list[Event]:
    """Events of the runs of at least n samples."""
    starts, stops = runs
    long = stops - starts >= n
    return _events(residual, starts[long], stops[long], n, merge)


def _events(residual: FloatArray, starts: IntArray, stops: IntArray, n: int, merge: int) -> list[Event]:
    """Merge runs that are close, and describe each group."""
    return [_describe(residual, starts[g], stops[g], n) for g in _groups(starts, stops, merge)]


def _groups(starts: IntArray, stops: IntArray, merge: int) -> list[IntArray]:
    """Indices of the runs that are one event."""
    if starts.size == 0:
        return []
    first = np.flatnonzero(np.concatenate(([True], starts[1:] - stops[:-1] >= max(1, merge))))
    return np.split(np.arange(starts.size), first[1:])


def _describe(residual: FloatArray, starts: IntArray, stops: IntArray, n: int) -> Event:
    span = Span(int(starts[0]), int(stops[-1]))
    length = stops - starts
    longest = int(np.argmax(length))
    fires = np.flatnonzero(length >= n)
    detected = int(starts[fires[0]]) + n - 1 if fires.size else int(stops[longest]) - 1
    part = np.nan_to_num(residual[span.slice])
    peak = float(part[int(np.argmax(np.abs(part)))])
    return Event(span, detected, int(length[longest]), peak)


def apart(events: Sequence[Event], others: Sequence[Event], margin: int) -> list[Event]:
    """Events that neither overlap nor neighbour any of the others."""
    return [
        e
        for e in events
        if not any(e.span.start < o.span.stop + margin and o.span.start - margin < e.span.stop for o in others)
    ]
