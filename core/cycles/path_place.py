"""The place of each sample on the path of its cycle, and what cycles that run about as fast have in common there.

A place is found by the way that was gone, then by the nearest point of the path. Places are numbered like the moving
samples of a usual cycle, some milliseconds apart: where the arm starts and brakes they lie close together on the path,
as the torque changes fast there.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import ceil

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from collaudit.core.cycles.cycle_search import NEAR_RAD, DrawnPath, Motion, resampled
from collaudit.core.data.signals import CycleReference
from collaudit.core.numeric.arrays import FloatArray, IntArray, Span
from collaudit.core.numeric.stats import SD_PER_MAD, median_of

#: Places are so far apart in time, s.
_PLACE_S = 0.01
#: The nearest point of the path is looked for among so many places on either side; samples are no further apart.
#: In so many rounds.
_SHIFT, _ROUNDS = 8.0, 4
#: Slower along the path than this is no motion: rad a place.
_SLOWEST_RAD = 1e-4
#: Cycles are alike in speed within such a share of the logarithm.
_SPEED_CLASS = 0.1
#: A reference is made of so many cycles at most, evenly over the log.
_MOST_CYCLES = 60
#: ... and of a place at which nearly all of them were judged.
_NEARLY_ALL = 0.8
#: The spread at a place is that of so many about it: a few cycles tell it poorly.
_SPREAD_PLACES = 25
#: Thresholds change over the path in such steps of the usual one.
_STEP = 8.0


@dataclass(frozen=True, slots=True, eq=False)
class CyclePath:
    """The path of a program.

    Attributes:
        position_rad: (p, j) of its places.
        share: (p,) of its length gone there, rising from 0 to 1.
    """

    position_rad: FloatArray
    share: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Placed:
    """A log on the path of its program.

    Attributes:
        spans: its cycles.
        path: of the program.
        number: (n,) of the cycle, from 0 on; -1 outside of cycles.
        place: (n,) on the path, in places; NaN outside of cycles, at rest and off the path.
    """

    spans: tuple[Span, ...]
    path: CyclePath
    number: NDArray[np.int32]
    place: FloatArray

    def at_places(self, values: FloatArray) -> FloatArray:
        """(c, p, k) values (n, k) of each cycle at each place; NaN where the samples beside it have none."""
        places = np.arange(self.path.share.size)
        out = np.full((len(self.spans), places.size, values.shape[1]), np.nan)
        for own, span in zip(out, self.spans, strict=True):
            place = self.place[span.slice]
            there = np.flatnonzero(np.isfinite(place))
            if there.size == 0:
                continue
            rising = np.maximum.accumulate(place[there])
            for column, its in zip(own.T, values[span.slice][there].T, strict=True):
                column[:] = np.interp(places, rising, its, np.nan, np.nan)
            for k in np.flatnonzero(np.diff(rising) > _SHIFT):
                own[ceil(rising[k]) : ceil(rising[k + 1])] = np.nan
        return out

    def of_samples(self, number: int, at_places: FloatArray) -> FloatArray:
        """(m,) of values at places (p,) what the samples of one cycle have; NaN where they have no place."""
        place = self.place[self.spans[number].slice]
        known = np.isfinite(place)
        low = np.minimum(np.where(known, place, 0.0).astype(np.int64), self.path.share.size - 2)
        further = place - low
        return np.asarray((1.0 - further) * at_places[low] + further * at_places[low + 1])


def usual_path(drawn: DrawnPath, spans: Sequence[Span]) -> CyclePath:
    """The path of the cycle that moves for as long as most do.

    Args:
        drawn: the motion.
        spans: its cycles.
    """
    period_s, way_rad = float(np.diff(drawn.motion.time_s[:2])[0]), drawn.way_rad
    moving = [np.flatnonzero(np.diff(way_rad[span.slice], prepend=-1.0) > 0.0) for span in spans]
    seconds = np.array([rows.size * period_s for rows in moving])
    k = int(np.argmin(np.abs(seconds - median_of(seconds))))
    rows = spans[k].start + moving[k]
    at = np.linspace(0.0, rows.size - 1.0, max(2, round(seconds[k] / _PLACE_S)))
    gone = np.interp(at, np.arange(rows.size), way_rad[rows])
    position = resampled(at, np.arange(rows.size, dtype=np.float64), drawn.motion.position_rad[rows])
    return CyclePath(position, (gone - gone[0]) / max(gone[-1] - gone[0], 1e-12))


def along(drawn: DrawnPath, path: CyclePath) -> list[Span]:
    """The cycles of a motion that go along a known path, from its beginning on."""
    length = float(np.linalg.norm(np.diff(path.position_rad, axis=0), axis=1).sum())
    at = np.arange(0.0, 1.0, drawn.step_rad / max(length, drawn.step_rad))
    return drawn.cycles_like(resampled(at, path.share, path.position_rad))


def placed(drawn: DrawnPath, spans: Sequence[Span], path: CyclePath) -> Placed:
    """Every sample of the cycles on a path.

    Args:
        drawn: the motion.
        spans: its cycles, each from the beginning of the path to its end.
        path: of the program.
    """
    position, way_rad = drawn.motion.position_rad, drawn.way_rad
    number = np.full(way_rad.size, -1, dtype=np.int32)
    place = np.full(way_rad.size, np.nan)
    slope = np.gradient(path.position_rad, axis=0)
    size = np.maximum(np.einsum("pj,pj->p", slope, slope), _SLOWEST_RAD**2)
    numbers = np.arange(path.share.size)
    for k, span in enumerate(spans):
        part, own = span.slice, way_rad[span.slice]
        number[part] = k
        if not own[-1] > own[0]:
            continue
        here = np.nan_to_num(np.interp((own - own[0]) / (own[-1] - own[0]), path.share, numbers))
        for _ in range(_ROUNDS):  # the foot of the perpendicular on the path, from the place that the way gone tells
            nearest = np.rint(here).astype(np.int64)
            off = position[part] - path.position_rad[nearest]
            shift = np.nan_to_num(np.einsum("nj,nj->n", off, slope[nearest]) / size[nearest])  # unknown: no place below
            here = np.clip(nearest + np.clip(shift, -_SHIFT, _SHIFT), 0.0, path.share.size - 1.0)
        moves = np.diff(own, prepend=-1.0) > 0.0
        place[part] = np.where(moves & (np.abs(off).max(axis=1) < NEAR_RAD), here, np.nan)
    return Placed(tuple(spans), path, number, place)


@dataclass(frozen=True, slots=True, eq=False)
class SpeedClass:
    """Cycles that run about as fast as each other.

    Attributes:
        members: their numbers.
        chosen: those that a reference is made of.
        speed: (p,) the usual one, places a second.
        nights: earlier nights that run as fast; none where they are too few for a reference.
    """

    members: IntArray
    chosen: IntArray
    speed: FloatArray
    nights: list[CycleReference]

    @classmethod
    def of(cls, members: IntArray, speeds: FloatArray, nights: Sequence[CycleReference], least: int) -> SpeedClass:
        """Of cycles by their numbers, speeds (c, p) of all cycles, and the nights of their program."""
        usual = median_and_spread(speeds[members], 1)[0]
        alike = [night for night in nights if np.nanmedian(np.abs(usual / night.speed - 1.0)) < _SPEED_CLASS]
        even = np.linspace(0, members.size - 1, min(members.size, _MOST_CYCLES)).astype(np.int64)
        return cls(members, members[even], usual, alike if len(alike) >= least else [])

    def of_nights(self, field: str, j: int, least: int) -> tuple[FloatArray, FloatArray]:
        """Median and spread (p,) over the nights, of one joint."""
        return median_and_spread(np.stack([getattr(night, field)[:, j] for night in self.nights]), least)

    def references(self, table: FloatArray, j: int, least: int) -> Iterator[tuple[int, FloatArray]]:
        """Each cycle's number with its reference (p,), of the chosen others; NaN where they are fewer than needed.

        Args:
            table: (c, p) of one joint, of all cycles at all places.
            j: number of the joint.
            least: cycles, or nights, that are needed.
        """
        if self.nights:
            middle = self.of_nights("median_nm", j, least)[0]
            yield from ((k, middle) for k in self.members.tolist())
            return
        ordered = np.sort(table[self.chosen], axis=0)
        count = np.count_nonzero(np.isfinite(ordered), axis=0)
        count[count < _NEARLY_ALL * len(ordered)] = 0  # a place that few cycles judge is told by odd ones
        whole = np.where(count < least, np.nan, _middle(ordered, count))
        for k in self.members.tolist():
            if k not in self.chosen:
                yield k, whole
                continue
            own = table[k]
            there = np.isfinite(own)
            rank = np.where(there, np.count_nonzero(ordered < own, axis=0), len(ordered))
            yield k, np.where(count - there < least, np.nan, _middle(ordered, count - there, rank))

    def weights(self, table: FloatArray, j: int, least: int) -> Iterator[tuple[int, FloatArray]]:
        """Each cycle's number with the spread (p,) at each place over the usual one, at least 1, in steps.

        Arguments as of :meth:`references`.
        """
        spread = median_and_spread(table[self.chosen], least)[1]
        if self.nights:
            spread = np.hypot(self.of_nights("median_nm", j, least)[1], self.of_nights("spread_nm", j, least)[0])
        known = np.isfinite(spread)
        sums, counts = (
            uniform_filter1d(x, _SPREAD_PLACES) for x in (np.where(known, spread, 0.0), known.astype(np.float64))
        )
        mean = np.where(known, sums / np.maximum(counts, 1e-9), np.nan)
        usual = np.maximum(median_and_spread(mean, 1)[0], 1e-12)
        weight = np.maximum(np.ceil(_STEP * mean / usual) / _STEP, 1.0)
        return ((k, weight) for k in self.members.tolist())

    def kept(self, table: FloatArray, least: int, path: CyclePath) -> CycleReference | None:
        """What later nights may know of this one, from (c, p, j) values of all joints."""
        middle, spread = median_and_spread(table[self.chosen], least)
        if not np.isfinite(middle).any():
            return None
        return CycleReference(
            version="",
            night="",
            log="",
            position_rad=path.position_rad,
            share=path.share,
            speed=self.speed,
            median_nm=middle,
            spread_nm=spread,
        )


def along_path_speeds(on_path: Placed, motion: Motion) -> FloatArray:
    """(n,) speed along the path, places a second; NaN where a sample has no place."""
    slope = np.gradient(on_path.path.position_rad, axis=0)
    slope /= np.maximum(np.einsum("pj,pj->p", slope, slope), np.finfo(np.float64).tiny)[:, None]
    known = np.isfinite(on_path.place)
    at = np.rint(np.where(known, on_path.place, 0.0)).astype(np.int64)
    out = np.where(known, 0.0, np.nan)
    for velocity, along in zip(motion.velocity_rad_s.T, slope.T, strict=True):
        out += velocity * along[at]
    return out


def speed_classes(speeds: FloatArray) -> list[IntArray]:
    """Numbers of the cycles (c, p) that run about as fast as each other, as far as they were judged at all."""
    there = np.flatnonzero(np.isfinite(speeds).any(axis=1))
    if there.size == 0:
        return []
    usual = median_and_spread(speeds[there], 1)[0]
    share = median_and_spread((speeds[there] / usual).T, 1)[0]
    of_class = np.rint(np.log(np.maximum(share, 1e-3)) / _SPEED_CLASS)
    return [there[of_class == one] for one in np.unique(of_class)]


def median_and_spread(values: FloatArray, least: int) -> tuple[FloatArray, FloatArray]:
    """Median and robust standard deviation of (c, …) values over c; NaN where fewer than ``least`` are known."""
    ordered = np.sort(values, axis=0)
    known = np.count_nonzero(np.isfinite(ordered), axis=0)
    middle = _middle(ordered, known)
    spread = SD_PER_MAD * _middle(np.sort(np.abs(values - middle), axis=0), known)
    few = known < least
    return np.where(few, np.nan, middle), np.where(few, np.nan, spread)


def _middle(ordered: FloatArray, known: NDArray[np.integer], rank: NDArray[np.integer] | None = None) -> FloatArray:
    """Median of the first ``known`` of sorted values, the one at ``rank`` taken out where that is given."""
    ends = []
    for k in (np.maximum(known - 1, 0) // 2, known // 2):
        at = k if rank is None else k + (k >= rank)
        ends.append(np.take_along_axis(ordered, np.minimum(at, len(ordered) - 1)[None], axis=0)[0])
    return np.asarray(0.5 * (ends[0] + ends[1]))
