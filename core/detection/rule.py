"""Rule (6): a residual above gamma for n samples in a row is a collision; what nearly was, a near miss."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import chain
from math import ceil

import numpy as np
from numpy.typing import NDArray

from collaudit.core.data.audit_result import Spoke
from collaudit.core.numeric.arrays import BoolArray, FloatArray, Span, closed, lasting, run_bounds

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


#: Events with which residual told them.
Told = list[tuple[Event, Spoke]]


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
) -> tuple[list[Event], list[Event], list[Event]]:
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


def both_events(
    model: tuple[FloatArray, Level, Level],
    cycle: tuple[FloatArray, Level] | None,
    evidence: BoolArray,
    n: int,
    persistence: float,
    merge_samples: int,
) -> tuple[Told, Told, Told]:
    """Rule (6) on the two residuals of one joint, as one rule: alarms and the two kinds of near misses.

    An alarm that both have is the model's; what is nearly an alarm counts where no alarm is, and once.

    Args:
        model: what the model leaves, its threshold, its level of a near miss, N·m.
        cycle: what other cycles leave, NaN where there is no reference, and its threshold, which is what motion does:
            nearly an alarm is then only what is too brief; None where nothing repeats.
        evidence, n, persistence, merge_samples: as of :func:`rule_events`.
    """
    fired, low, brief = rule_events(model[0], evidence, model[1], n, model[2], persistence, merge_samples)
    others: tuple[list[Event], list[Event], list[Event]] = ([], [], [])
    if cycle is not None:
        known = evidence & np.isfinite(cycle[0])
        others = rule_events(cycle[0], known, cycle[1], n, cycle[1], persistence, merge_samples)

    def apart(events: list[Event], *from_all: list[Event]) -> list[Event]:
        taken = np.zeros(evidence.size, dtype=np.bool_)
        for event in chain(*from_all):
            taken[max(0, event.span.start - merge_samples) : event.span.stop + merge_samples] = True
        return [event for event in events if not taken[event.span.slice].any()]

    alone = apart(fired, others[0])
    alarms: Told = [(event, "model" if event in alone else "both") for event in fired]
    alarms += [(event, "cycle") for event in apart(others[0], fired)]
    nearly: list[Told] = [[(event, "model") for event in apart(its, others[0])] for its in (low, brief)]
    for told, more in zip(nearly, others[1:], strict=True):
        told += [(event, "cycle") for event in apart(more, fired, low, brief)]
    return alarms, nearly[0], nearly[1]


def _events(mask: BoolArray, merge: int) -> list[Span]:
    """Runs of samples, those that are close as one."""
    return [Span(int(a), int(b)) for a, b in zip(*run_bounds(closed(mask, merge - 1)), strict=True)]


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
