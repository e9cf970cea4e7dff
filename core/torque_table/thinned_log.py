"""A log at some forty samples a second, each the mean of what it stands for: causes and checks act more slowly."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.data.joint_log import LEAST_EFFORT_CHANGE, MOVING_RAD_S, UniformSeries
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.torque_table.block_sums import BlockSums

#: Columns of sliding friction and an offset.
SLIDING = ("way", "beyond", "one")
_RATE_HZ = 40.0
#: Samples within so long share their errors, s.
_BLOCK_S = 1.0
#: A joint that keeps to less is an arm that gives under a touch; its effort against the model tells of the touch.
_LEAST_TRAVEL_RAD = 0.05


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
