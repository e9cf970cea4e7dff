"""Recursive filters over long, narrow signals: by blocks of time, forward or both ways, column groups in threads.

A filter's state is carried from block to block, so that nothing as large as the signal is needed but the result:
fresh memory costs more time than the arithmetic. Many short stretches are filtered together, as the rows of a matrix:
one by one, calling NumPy would take several times as long as filtering.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise

import numpy as np

from collaudit.core.numeric.arrays import BoolArray, FloatArray, Span
from collaudit.core.numeric.filter_design import settled_state
from collaudit.core.numeric.linear_filter import linear_filter
from collaudit.core.numeric.parallel import ordered_map, threads
from collaudit.core.numeric.runs import run_bounds
from collaudit.core.numeric.stats import distinct
from collaudit.core.numeric.tables import table

#: Values at a time, of all columns of a group: a block and what the filter makes of it stay in the cache.
_BLOCK = 65536
#: Stretches with no more values than this, padding included, are short; fewer than so many are not worth a matrix.
_SHORT, _FEW = 8192, 4


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
        both_ways: forward and then backward, without delay; else forward only.
        pad: samples by which each stretch is continued by its point reflection at both ends (at most its length
            less one); 0 starts at the first value as if it had lasted for ever.
        out: (n, j) memory for the result, none of it that of ``x``; fresh memory without.

    Returns:
        (n, j) result, NaN outside the stretches; and (n, j) where values were bridged, None when nowhere.
    """
    out = blank(x, segments, out)
    settled = settled_state(b, a)
    bridged: BoolArray | None = None
    short = [span for span in segments if len(span) and (len(span) + 2 * pad) * x.shape[1] <= _SHORT]
    rest: Iterable[Span] = segments
    if len(short) >= _FEW:
        short = [span for span in short if np.isfinite(x[span.slice].sum())]
        together = set(short)
        rest = [span for span in segments if span not in together]
        for spans in _alike(short, pad, x.shape[1]):
            _Rows(b, a, settled, [x[span.slice] for span in spans], pad).run(
                [out[span.slice] for span in spans], both_ways=both_ways
            )
    for span in rest:
        if len(span) == 0:
            continue
        part, missing = _bridged(x[span.slice])
        if missing is not None:
            bridged = np.zeros(x.shape, dtype=bool) if bridged is None else bridged
            bridged[span.slice] = missing
        groups = _groups(x.shape[1], len(span))
        work = [_Stretch(b, a, settled, part[:, g], out[span.slice, g], min(pad, len(span) - 1)) for g in groups]
        for _ in ordered_map(lambda stretch: stretch.run(both_ways=both_ways), work):
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


class _Stretch:
    """One stretch of a group of columns on its way through the filter."""

    def __init__(
        self, b: FloatArray, a: FloatArray, settled: FloatArray, x: FloatArray, out: FloatArray, pad: int
    ) -> None:
        self.b, self.a, self.settled = b, a, settled
        self.x, self.out, self.pad = x, out, pad

    def run(self, *, both_ways: bool) -> None:
        """Fill ``out``."""
        x, pad = self.x, self.pad
        head, tail = 2.0 * x[0] - x[pad:0:-1], 2.0 * x[-1] - x[-2 : -pad - 2 : -1]
        state = self._start(head[0] if pad else x[0])
        state = self._step(head, state)[1]
        for block in _blocks(x):
            self.out[block], state = self._step(x[block], state)
        if both_ways:
            after, _ = self._step(tail, state)
            state = self._start(after[-1] if pad else self.out[-1])
            state = self._step(after[::-1], state)[1]
            for block in reversed(list(_blocks(x))):
                back, state = self._step(self.out[block][::-1], state)
                self.out[block] = back[::-1]

    def _start(self, first: FloatArray) -> FloatArray:
        """(j, order) state as if a value had lasted for ever."""
        return np.asarray(first[:, None] * self.settled)

    def _step(self, rows: FloatArray, state: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Filter rows (m, j) from a state; the (m, j) result and the state after them."""
        if rows.shape[0] == 0:
            return rows, state
        columns = np.ascontiguousarray(rows.T)  # filters run several times faster along the contiguous axis
        result, state = linear_filter(self.b, self.a, columns, state)
        return result.T, state


def _alike(spans: list[Span], pad: int, columns: int) -> Iterator[list[Span]]:
    """Stretches by their lengths, as many at a time as a matrix of them stays in the cache."""
    group: list[Span] = []
    for span in sorted(spans, key=len):
        if group and (len(span) + 2 * pad) * columns * (len(group) + 1) > 2 * _BLOCK:
            yield group
            group = []
        group.append(span)
    if group:
        yield group


class _Rows:
    """Short stretches on their way through the filter together: the columns of each, with their ends, are rows.

    What a row holds beyond its own values is filtered as well, and left.
    """

    def __init__(self, b: FloatArray, a: FloatArray, settled: FloatArray, parts: list[FloatArray], pad: int) -> None:
        self.b, self.a, self.settled = b, a, settled
        self.pads = [min(pad, part.shape[0] - 1) for part in parts]
        self.lengths = [part.shape[0] + 2 * pad for part, pad in zip(parts, self.pads, strict=True)]
        self.columns = parts[0].shape[1]
        self.rows = np.zeros((len(parts) * self.columns, max(self.lengths)))
        for row, length, part, ends in zip(self._row(), self.lengths, parts, self.pads, strict=True):
            row[:, ends : length - ends] = part.T
            if ends:
                row[:, :ends] = (2.0 * part[0] - part[ends:0:-1]).T
                row[:, length - ends : length] = (2.0 * part[-1] - part[-2 : -ends - 2 : -1]).T

    def _row(self) -> Iterator[FloatArray]:
        """The rows of each stretch."""
        return (self.rows[k : k + self.columns] for k in range(0, self.rows.shape[0], self.columns))

    def run(self, out: list[FloatArray], *, both_ways: bool) -> None:
        """Fill the (m, j) results of the stretches."""
        self._filter()
        if both_ways:
            self._turn()
            self._filter()
            self._turn()
        for row, length, ends, result in zip(self._row(), self.lengths, self.pads, out, strict=True):
            result[...] = row[:, ends : length - ends].T

    def _filter(self) -> None:
        """Run each row from its beginning, as if its first value had lasted for ever."""
        self.rows, _ = linear_filter(self.b, self.a, self.rows, self.rows[:, :1] * self.settled)

    def _turn(self) -> None:
        """Turn each row round in its place."""
        for row, length in zip(self._row(), self.lengths, strict=True):
            row[:, :length] = row[:, :length][:, ::-1].copy()


def _blocks(x: FloatArray) -> Iterator[slice]:
    """Blocks of the rows of a (m, j) group."""
    count, step = x.shape[0], max(1, _BLOCK // max(1, x.shape[1]))
    return (slice(start, min(start + step, count)) for start in range(0, count, step))


def _groups(columns: int, samples: int) -> list[slice]:
    """The columns in as many parts as there are threads; short stretches in one."""
    parts = min(threads(), columns) if samples * columns > 2 * _BLOCK else 1
    edges = np.linspace(0, columns, parts + 1).round().astype(int).tolist()
    return [slice(first, last) for first, last in pairwise(edges)]


def _bridged(part: FloatArray) -> tuple[FloatArray, BoolArray | None]:
    """A stretch (m, j) with missing values filled by straight lines, and where they were, None when nowhere."""
    if np.isfinite(part.sum()):
        return part, None
    missing: BoolArray = ~np.isfinite(part)
    filled = part.copy()
    for column in np.flatnonzero(missing.any(axis=0)):
        hole = missing[:, column]
        starts, stops = run_bounds(hole)
        known = distinct(np.concatenate([starts - 1, stops]))  # of the known samples the holes' neighbours are enough
        known = known[(known >= 0) & (known < hole.size)]
        filled[hole, column] = np.interp(np.flatnonzero(hole), known, part[known, column]) if known.size else 0.0
    return filled, missing
