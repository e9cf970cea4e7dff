"""What regressions take of a log: means at some forty samples a second, sliding motion, held-out blocks.

Causes and checks act more slowly than forty times a second. A joint slides once it has travelled far enough since it
last rested or reversed: over the first hundredth of a radian its gear turns. What is not settled is no evidence for the
friction of sliding, for sections, coupled axes and the residual alike. One division into blocks serves every choice and
every residual.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from collaudit.core.data.joint_log import LEAST_EFFORT_CHANGE, MOVING_RAD_S, UniformSeries
from collaudit.core.numeric.arrays import BoolArray, FloatArray, Span, run_bounds
from collaudit.core.torque_table.block_sums import BlockSums

#: Columns of sliding friction and an offset.
SLIDING = ("way", "beyond", "one")
_RATE_HZ = 40.0
#: Samples within so long share their errors, s.
_BLOCK_S = 1.0
#: A joint that keeps to less is an arm that gives under a touch; its effort against the model tells of the touch.
_LEAST_TRAVEL_RAD = 0.05
#: Blocks of time a fold at least, so that no fold is one kind of motion only; a long log has so many longer ones.
_BLOCKS_A_FOLD, _ENOUGH_BLOCKS = 3, 20
_FOLD_BLOCK_S = 10.0
#: With so many samples a fit without a third of them is as good as one without a fifth, and takes less time. A half
#: would often lack speeds of the other.
_MANY, _FEWEST_FOLDS = 100_000, 3
#: Travel until friction is steady, rad (m if prismatic): presliding of gears ends within a few thousandths of a radian.
REVERSAL_TRAVEL_RAD = 0.01


@dataclass(frozen=True, slots=True, eq=False)
class TorqueTable:
    """Means over equal numbers of samples, NaN where fewer than half are known.

    Attributes:
        joints: j names.
        period_s: from one to the next.
        time_s: (m,).
        motion: position, velocity, acceleration, (m, j) each, as the dynamics take them.
        way: (m, j) mean direction of motion: 1 or -1 where the joint moves one way.
        effort: (m, j) in the log's unit.
        model: (m, j) torque that the model explains, N·m.
    """

    joints: tuple[str, ...]
    period_s: float
    time_s: FloatArray
    motion: tuple[FloatArray, FloatArray, FloatArray]
    way: FloatArray
    effort: FloatArray
    model: FloatArray

    @classmethod
    def of(
        cls, series: UniformSeries, model_nm: FloatArray | None = None, contact_nm: FloatArray | None = None
    ) -> TorqueTable:
        """Of a log with effort; the torque (n, j) of a commanded tool force adds to the model's where it is known."""
        size = max(1, int(1.0 / (_RATE_HZ * series.period_s)))
        v = series.velocity_rad_s
        way = np.subtract(v > MOVING_RAD_S, v < -MOVING_RAD_S, dtype=np.int8)
        time_s, q, v, a, way = (thinned(x, size) for x in (series.time_s[:, None], *series.motion, way))
        none = np.zeros_like(q)
        whole = cls(series.joint_names, size * series.period_s, time_s[:, 0], (q, v, a), way, none, none)
        return whole.seen(series, model_nm, contact_nm)

    def seen(
        self, series: UniformSeries, model_nm: FloatArray | None = None, contact_nm: FloatArray | None = None
    ) -> TorqueTable:
        """The same motion with the effort of another series of it; with the torques of :meth:`of`, where given."""
        assert series.effort is not None
        size, model = round(self.period_s / series.period_s), self.model
        if model_nm is not None:
            model = thinned(model_nm, size)
        if model_nm is not None and contact_nm is not None:
            model += np.nan_to_num(thinned(contact_nm, size))
        return replace(self, effort=thinned(series.effort, size), model=model)

    def sums(self, **columns: FloatArray) -> dict[str, BlockSums]:
        """Sums of the joints where they slide one way; without those that hardly travel or whose effort never changes.

        Of ``effort``, ``model`` and its ``rate``, direction (``way``), speed that way ``beyond`` its mean, and more.

        Args:
            columns: (m, j) each; rows at which one is NaN do not count.
        """
        if len(self.time_s) < 2:
            return {}
        rate, speed = np.gradient(self.model, self.period_s, axis=0), np.abs(self.motion[1])
        every = np.stack([self.effort, self.model, rate, self.way, speed, *columns.values()], axis=2)
        slides, out = (np.abs(self.way) == 1.0) & np.isfinite(every).all(axis=2), {}
        for j, use in enumerate(map(np.flatnonzero, slides.T)):
            rows, travel = every[use, j], np.ptp(self.motion[0][use, j]) if use.size else 0.0
            if travel < _LEAST_TRAVEL_RAD or np.ptp(rows[:, 0]) <= LEAST_EFFORT_CHANGE:
                continue
            rows[:, 4] = rows[:, 3] * (rows[:, 4] - np.mean(rows[:, 4]))
            names = ("effort", "model", "rate", "way", "beyond", *columns)
            out[self.joints[j]] = BlockSums.of(np.floor(self.time_s[use] / _BLOCK_S), names, rows)
        return out


def thinned(values: FloatArray, size: int) -> FloatArray:
    """(m, j) means of (n, j) values, so many each, NaN where half of them are; the last ones, too few, are left out."""
    cells = values[: len(values) // size * size].T.reshape(values.shape[1], -1, size)
    out = cells.mean(axis=2)
    holes = ~np.isfinite(out)
    known = np.isfinite(cells[holes])
    total = np.sum(np.where(known, cells[holes], 0.0), axis=1)
    count = np.count_nonzero(known, axis=1)
    out[holes] = np.where(2 * count > size, total / np.maximum(count, 1), np.nan)
    return np.asarray(out.T)


def sliding(
    segments: Sequence[Span], position: FloatArray, velocity: FloatArray, rest_rad_s: float, margin: int
) -> BoolArray:
    """(n,) whether friction slides: a joint is settled, and will travel as far, for ``margin`` samples to either side.

    Friction that still turns about comes later than the motion, as does an effort that is stamped late. Of a stroke as
    much is left out at its end as at its beginning: else what the model lacks would look early.

    Args:
        segments, position, velocity, rest_rad_s: as of :func:`settled`.
        margin: samples.
    """
    back = [Span(velocity.size - span.stop, velocity.size - span.start) for span in reversed(segments)]
    moves = settled(segments, position, velocity, rest_rad_s)[0]
    moves &= settled(back, position[::-1], velocity[::-1], rest_rad_s)[0][::-1]
    return one_way(np.where(moves, velocity, 0.0), 0.0, margin)


def settled(
    segments: Sequence[Span], position: FloatArray, velocity: FloatArray, rest_rad_s: float
) -> tuple[BoolArray, FloatArray]:
    """(n,) whether a joint moves and has travelled far enough, and its way since it last rested or reversed.

    Both also count from the start of a stretch.

    Args:
        segments: stretches without a gap.
        position, velocity: (n,) of the joint, or of an axis that several turn.
        rest_rad_s: speed below which it rests.
    """
    steady, travel = np.zeros(velocity.size, dtype=np.bool_), np.zeros(velocity.size)
    for segment in segments:
        if len(segment) == 0:
            continue
        s = segment.slice
        direction = np.sign(_last_known(velocity[s]))  # an unknown velocity is no reversal, and hides none
        place = _last_known(position[s])
        resting = np.abs(velocity[s]) < rest_rad_s  # an unknown velocity does not rest
        starts = np.flatnonzero(resting | np.concatenate(([True], direction[1:] * direction[:-1] < 0)))
        travel[s] = np.nan_to_num(np.abs(place - np.repeat(place[starts], np.diff(starts, append=place.size))))
        steady[s] = (travel[s] >= REVERSAL_TRAVEL_RAD) & ~resting
    return steady, travel


def one_way(velocity: FloatArray, rest_rad_s: float, margin: int) -> BoolArray:
    """(n,) whether a joint moves one way, faster than it rests, for ``margin`` samples before and after."""
    out = np.zeros(velocity.size, dtype=np.bool_)
    for mask in (velocity > rest_rad_s, velocity < -rest_rad_s):
        for start, stop in zip(*run_bounds(mask), strict=True):
            out[start + margin : max(start + margin, stop - margin)] = True
    return out


def _last_known(x: FloatArray) -> FloatArray:
    """(n,) values with what is unknown replaced by the last known value before it."""
    if np.isfinite(x.sum()):
        return x
    known = np.isfinite(x)
    return np.asarray(x[np.maximum.accumulate(np.where(known, np.arange(x.size), 0))])


def fold_count(logs: Sequence[UniformSeries], most: int) -> int:
    """How many folds there are of these logs, of at most so many."""
    return most if sum(series.time_s.size for series in logs) <= _MANY else min(most, _FEWEST_FOLDS)


def block_length_s(series: UniformSeries, folds: int) -> float:
    """Length of the blocks of time that are dealt out in turn, so that each fold has a part of every kind of motion."""
    duration_s = float(series.time_s[-1] - series.time_s[0]) + series.period_s
    usual_s = max(_FOLD_BLOCK_S, duration_s / (folds * _ENOUGH_BLOCKS))
    return min(usual_s, duration_s / (folds * _BLOCKS_A_FOLD))


def fold_of_sample(series: UniformSeries, folds: int) -> NDArray[np.int16]:
    """(n,) fold of each sample of a log.

    Args:
        series: the log.
        folds: how many there are.
    """
    block = np.floor((series.time_s - series.time_s[0]) / block_length_s(series, folds))
    return np.asarray(block.astype(np.int64) % folds, dtype=np.int16)
