"""The cycles of a log: where its path comes back, by position alone, or as its user states.

Time plays no part: the path is drawn over its own length, so that overrides, waits and blends change nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from collaudit.core.config.schema import CyclesConfig
from collaudit.core.data.joint_log import MOVING_RAD_S, UniformSeries
from collaudit.core.data.signals import Signals
from collaudit.core.numeric.arrays import BoolArray, FloatArray, Span, run_bounds, stretch_distances

#: Points of the path are so far apart, rad (m), and at most so many.
_STEP_RAD, _MOST_POINTS = 0.02, 1 << 16
#: Two passes of a place are the same path where no joint is further off, rad; blends differ by a few hundredths.
NEAR_RAD = 0.1
#: A path shorter than this is a joint that trembles, rad.
_SHORTEST_RAD = 0.2
#: A period is looked for among so many shortest ones that come back as well as the best, to this share.
_CANDIDATES, _AS_WELL = 30, 0.9
#: It comes back over so much of the log at least, and a cycle over so much of itself.
_LEAST_SHARE, _OF_CYCLE = 0.15, 0.98
#: Beginnings of cycles are told by so many points of the path; lengths of cycles differ by less than this share.
_BEGINNING, _LENGTH_SHARE = 300, 0.05


#: What cycles are found in: a conditioned log, or the signals of an audit.
Motion = UniformSeries | Signals


@dataclass(frozen=True, slots=True, eq=False)
class DrawnPath:
    """A motion over the length of its path.

    Attributes:
        motion: of all joints.
        way_rad: (n,) length of the path at each sample, rad over all joints; it stands while the arm does.
        step_rad: between two points of it.
        points: (m, j) positions.
    """

    motion: Motion
    way_rad: FloatArray
    step_rad: float
    points: FloatArray

    @classmethod
    def of(cls, motion: Motion) -> DrawnPath:
        """The path of a motion."""
        squares, moves = np.zeros(len(motion.time_s) - 1), np.zeros(len(motion.time_s), dtype=bool)
        for position, speed in zip(motion.position_rad.T, motion.velocity_rad_s.T, strict=True):
            squares += np.square(np.nan_to_num(np.diff(position)))
            moves |= np.abs(speed) > MOVING_RAD_S
        way = np.append(0.0, np.cumsum(np.where(moves[1:], np.sqrt(squares), 0.0)))
        step = max(_STEP_RAD, float(way[-1]) / _MOST_POINTS)
        known = np.flatnonzero(np.isfinite(motion.position_rad).all(axis=1))
        if not known.size:
            return cls(motion, way, step, np.empty((0, motion.position_rad.shape[1])))
        at = step * np.arange(int(way[-1] / step) + 1, dtype=np.float64)
        points = [np.interp(at, way[known], position[known]) for position in motion.position_rad.T]
        return cls(motion, way, step, np.stack(points, axis=1))

    def sample(self, point: int, place: FloatArray) -> int:
        """Nearest to a place (j,), about a point: near rest a step of the path takes long."""
        edges = (self.step_rad * (point - 1), self.step_rad * (point + 1))
        a, b = (int(k) for k in np.searchsorted(self.way_rad, edges, side="right"))
        off = np.abs(self.motion.position_rad[a:b] - place).max(axis=1, initial=0.0)
        return a + int(np.argmin(np.where(np.isnan(off), np.inf, off))) if b > a else a

    def cycles_like(self, cycle: FloatArray) -> list[Span]:
        """Whole passes of a path (k, j), given at the steps of this one: as long, and along it."""
        period = len(cycle)
        if period > len(self.points):
            return []
        distance = stretch_distances(cycle[: min(period, _BEGINNING)], self.points)
        near = np.flatnonzero(distance < NEAR_RAD)
        groups = np.split(near, np.flatnonzero(np.diff(near) > period // 2) + 1)
        starts = np.array([group[np.argmin(distance[group])] for group in groups if group.size], dtype=np.int64)
        ends = np.append(starts[1:], starts[-1:] + period)
        ends = np.where(ends - starts > (1.0 + _LENGTH_SHARE) * period, starts + period, ends)
        ends = np.where(ends == len(self.points), ends - 1, ends)
        fits = (ends < len(self.points)) & (ends - starts > (1.0 - _LENGTH_SHARE) * period)
        share, found = np.linspace(0.0, 1.0, period), []
        for a, b in zip(starts[fits].tolist(), ends[fits].tolist(), strict=True):
            its = self.points[np.round(a + share * (b - a)).astype(np.int64)]
            span = Span(self.sample(a, cycle[0]), self.sample(b, cycle[0]))
            if np.mean(_near(its, cycle)) >= _OF_CYCLE and span.stop > span.start:
                found.append(span)
        return found


def resampled(at: FloatArray, x: FloatArray, columns: FloatArray) -> FloatArray:
    """(m, j) columns (n, j), known at rising ``x`` (n,), at other places (m,)."""
    return np.stack([np.interp(at, x, column) for column in columns.T], axis=1)


def find_cycles(series: UniformSeries, drawn: DrawnPath, config: CyclesConfig) -> list[Span]:
    """Whole cycles in order, samples each; none where the motion does not repeat.

    Args:
        series: the judged joints.
        drawn: its path.
        config: cycles, where they are stated.
    """
    if config.spans_s or config.label is not None:
        marks = [one for one in (*series.annotations, *series.phases) if config.label in (one.name, one.source)]
        spans_s = sorted([*config.spans_s, *(span for one in marks for span in one.intervals_s)])
        bounds = np.searchsorted(series.time_s, np.array(spans_s).reshape(-1, 2))
        return [Span(int(a), int(b)) for a, b in bounds if b > a]
    if drawn.way_rad[-1] < 2.0 * _SHORTEST_RAD or not len(drawn.points):
        return []
    period = _period(drawn.points, round(_SHORTEST_RAD / drawn.step_rad))
    if period is None:
        return []
    first = _first(drawn, period)
    return drawn.cycles_like(drawn.points[first : first + period])


def _near(one: FloatArray, other: FloatArray) -> BoolArray:
    return np.asarray(np.abs(one - other).max(axis=1) < NEAR_RAD)


def _period(path: FloatArray, least: int) -> int | None:
    """After how many points the path (m, j) comes back; None where it does not.

    The mean squared distance of points so far apart has a minimum there, which correlations by FFT tell for all
    distances at once. Of the minima that bring back as much of the path as the best one the shortest counts.
    """
    count = path.shape[0]
    centred = path - path.mean(axis=0)
    size = 1 << (2 * count - 1).bit_length()
    spectrum = np.fft.rfft(centred, size, axis=0)
    product = np.fft.irfft((np.abs(spectrum) ** 2).sum(axis=1), size)[:count]
    squares = np.append(0.0, np.cumsum((centred**2).sum(axis=1)))
    lags = np.arange(count)
    apart = (squares[count - lags] + squares[count] - squares[lags] - 2.0 * product) / (count - lags)
    inside = np.arange(max(least, 2), count // 2)
    dips = inside[(apart[inside] <= apart[inside - 1]) & (apart[inside] <= apart[inside + 1])]
    deepest = np.sort(dips[np.argsort(apart[dips], kind="stable")][:_CANDIDATES])
    shares = np.array([np.mean(_near(path[:-lag], path[lag:])) for lag in deepest])
    if not shares.size or shares.max() < _LEAST_SHARE:
        return None
    return int(deepest[np.flatnonzero(shares >= _AS_WELL * shares.max())[0]])


def _first(drawn: DrawnPath, period: int) -> int:
    """The first point of a cycle: of the longest stretch that comes back the place where the arm stands longest."""
    begins, ends = run_bounds(_near(drawn.points[:-period], drawn.points[period:]))
    first = int(begins[np.argmax(ends - begins)])
    stands = np.searchsorted(drawn.way_rad, drawn.step_rad * np.arange(first, first + period + 1))
    return first + int(np.argmax(np.diff(stands)))
