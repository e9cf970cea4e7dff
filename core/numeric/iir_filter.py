"""Recursive filters over the gap-free stretches of a log, a few columns at a time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from collaudit.core.numeric.arrays import BoolArray, FloatArray, Span
from collaudit.core.numeric.parallel import ordered_map
from collaudit.core.numeric.runs import run_bounds
from collaudit.core.numeric.signal_filters import filtfilt, lfilter, lfilter_zi
from collaudit.core.numeric.tables import table

#: Values of a stretch from which on each of its columns is filtered alone, which takes less memory and several threads.
_LARGE = 1 << 17


def filtered(
    b: FloatArray,
    a: FloatArray,
    x: FloatArray,
    segments: Sequence[Span],
    *,
    both_ways: bool,
    pad: int = 0,
    out: FloatArray | None = None,
) -> tuple[FloatArray, BoolArray | None]:
    """Run a recursive filter over each stretch, starting settled.

    Args:
        b, a: numerator and denominator of a filter in z.
        x: (n, j); values that are not finite inside a stretch are bridged by straight lines.
        segments: gap-free stretches.
        both_ways: forward and then backward, without delay (``scipy.signal.filtfilt``); else forward only.
        pad: samples by which each stretch is continued by its point reflection at both ends (at most its length
            less one); 0 starts at the first value as if it had lasted for ever.
        out: (n, j) memory for the result, none of it that of ``x``; fresh memory without.

    Returns:
        (n, j) result, NaN outside the stretches; and (n, j) where values were bridged, None when nowhere.
    """
    out = blank(x, segments, out)
    settled = lfilter_zi(b, a)
    bridged: BoolArray | None = None
    for span in segments:
        if len(span) == 0:
            continue
        part, missing = _bridged(x[span.slice])
        if missing is not None:
            bridged = np.zeros(x.shape, dtype=bool) if bridged is None else bridged
            bridged[span.slice] = missing
        result, edge = out[span.slice], min(pad, len(span) - 1)

        def run(columns: slice, part: FloatArray = part, result: FloatArray = result, edge: int = edge) -> None:
            values = part[:, columns]
            if both_ways:
                result[:, columns] = filtfilt(b, a, values, edge)
            else:
                result[:, columns] = lfilter(b, a, values, settled[:, None] * values[:1])

        for _ in ordered_map(run, _groups(x.shape[1], len(span))):
            pass
    return out, bridged


def blank(like: FloatArray, segments: Sequence[Span], out: FloatArray | None = None) -> FloatArray:
    """An array of the same shape, NaN outside the stretches and not yet written inside them."""
    if out is None:
        out = table(*like.shape) if like.ndim > 1 else np.empty(like.shape)
    before = 0
    for span in segments:
        out[before : span.start] = np.nan
        before = span.stop
    out[before:] = np.nan
    return out


def _groups(columns: int, samples: int) -> list[slice]:
    """Columns that are filtered together: all of a short stretch, each of a long one alone."""
    return [slice(j, j + 1) for j in range(columns)] if samples * columns > _LARGE else [slice(0, columns)]


def _bridged(part: FloatArray) -> tuple[FloatArray, BoolArray | None]:
    """A stretch (m, j) with missing values filled by straight lines, and where they were, None when nowhere."""
    if np.isfinite(part.sum()):
        return part, None
    missing: BoolArray = ~np.isfinite(part)
    filled = part.copy()
    for column in np.flatnonzero(missing.any(axis=0)):
        hole = missing[:, column]
        starts, stops = run_bounds(hole)
        known = np.unique(np.concatenate([starts - 1, stops]))  # of the known samples the holes' neighbours are enough
        known = known[(known >= 0) & (known < hole.size)]
        filled[hole, column] = np.interp(np.flatnonzero(hole), known, part[known, column]) if known.size else 0.0
    return filled, missing
