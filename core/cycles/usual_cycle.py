"""What cycles that run about as fast have in common: at each place of the path, the median and the spread."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from collaudit.core.cycles.cycle_search import Motion
from collaudit.core.cycles.path_place import PLACE_S, CyclePath, Placed
from collaudit.core.data.cycles_result import CycleReference
from collaudit.core.numeric.arrays import FloatArray, IntArray
from collaudit.core.numeric.stats import SD_PER_MAD

#: Cycles are alike in speed within such a share of the logarithm.
_SPEED_CLASS = 0.1
#: A reference is made of so many cycles at most, evenly over the log.
_MOST_CYCLES = 60
#: ... and of a place at which nearly all of them were judged.
_NEARLY_ALL = 0.8
#: The spread at a place is that of so much motion about it, s: a few cycles tell it poorly.
_SPREAD_S = 0.25
#: Thresholds change over the path in such steps of the usual one.
_STEP = 8.0


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

    def of_nights(self, field: str, least: int) -> tuple[FloatArray, FloatArray]:
        """Median and spread (p, j) over the nights."""
        return median_and_spread(np.stack([getattr(night, field) for night in self.nights]), least)

    def references(self, table: FloatArray, least: int) -> Iterator[tuple[int, FloatArray]]:
        """Each cycle's number with its reference (p, j), of the chosen others; NaN where they are fewer than needed."""
        if self.nights:
            middle = self.of_nights("median_nm", least)[0]
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

    def weights(self, table: FloatArray, least: int) -> Iterator[tuple[int, FloatArray]]:
        """Each cycle's number with the spread (p, j) at each place over the usual one, at least 1, in steps."""
        spread = median_and_spread(table[self.chosen], least)[1]
        if self.nights:
            spread = np.hypot(self.of_nights("median_nm", least)[1], self.of_nights("spread_nm", least)[0])
        known = np.isfinite(spread)
        width = max(1, round(_SPREAD_S / PLACE_S))
        sums, counts = (
            uniform_filter1d(x, width, axis=0) for x in (np.where(known, spread, 0.0), known.astype(np.float64))
        )
        mean = np.where(known, sums / np.maximum(counts, 1e-9), np.nan)
        usual = np.maximum(median_and_spread(mean, 1)[0], 1e-12)
        weight = np.maximum(np.ceil(_STEP * mean / usual) / _STEP, 1.0)
        return ((k, weight) for k in self.members.tolist())

    def kept(self, table: FloatArray, least: int, path: CyclePath) -> CycleReference | None:
        """What later nights may know of this one."""
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
    """(n, 1) speed along the path, places a second; NaN where a sample has no place."""
    slope = np.gradient(on_path.path.position_rad, axis=0)
    known = np.isfinite(on_path.place)
    along = slope[np.rint(on_path.place[known]).astype(np.int64)]
    size = np.maximum(np.einsum("nj,nj->n", along, along), np.finfo(np.float64).tiny)
    out = np.full((on_path.place.size, 1), np.nan)
    out[known, 0] = np.einsum("nj,nj->n", motion.velocity_rad_s[known], along) / size
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
