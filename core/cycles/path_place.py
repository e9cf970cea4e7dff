"""The place of each sample on the path of its cycle: by the way that was gone, then by the nearest point of the path.

Places are numbered like the moving samples of a usual cycle, some milliseconds apart: where the arm starts and brakes
they lie close together on the path, as the torque changes fast there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil

import numpy as np
from numpy.typing import NDArray

from collaudit.core.cycles.cycle_search import NEAR_RAD, DrawnPath, resampled
from collaudit.core.numeric.arrays import FloatArray, Span
from collaudit.core.numeric.stats import median_of

#: Places are so far apart in time, s.
PLACE_S = 0.01
#: The nearest point of the path is looked for among so many places on either side; samples are no further apart.
#: In so many rounds.
_SHIFT, _ROUNDS = 8.0, 4
#: Slower along the path than this is no motion: rad a place.
_SLOWEST_RAD = 1e-4


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
        """(m, k) of values at places (p, k) what the samples of one cycle have; NaN where they have no place."""
        place = self.place[self.spans[number].slice]
        known = np.isfinite(place)
        low = np.minimum(np.where(known, place, 0.0).astype(np.int64), self.path.share.size - 2)
        further = (place - low)[:, None]
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
    at = np.linspace(0.0, rows.size - 1.0, max(2, round(seconds[k] / PLACE_S)))
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
