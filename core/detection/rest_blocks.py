"""Signals of a log in means over short blocks of time, by which standing joints are looked at.

What is asked of them at every place and scale, a mean, a step, the way that a joint went, comes from running sums and
sliding extremes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from collaudit.core.data.signals import State
from collaudit.core.detection.detector_run import DetectorRun
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.parallel import each
from collaudit.core.numeric.runs import centred_extremes, widened
from collaudit.core.numeric.stats import median_of, smallest_step
from collaudit.core.prepare.prepared import Prepared

#: Steps are looked for in means over this time, s.
BLOCK_S = 0.01
#: Lengths of the means before and after a step, and the time between them in which it rises, s.
SCALES = ((0.04, 0.02), (0.12, 0.08), (0.3, 0.3), (0.5, 1.0))
#: A joint that goes no further than this over the windows of a step stands, rad (m of a prismatic joint).
STILL = 5e-3
#: It has stood for this long before a step, and goes nowhere for this long after it, s.
STOOD_S, STAYS_S = 0.3, 0.3
#: Nothing is told this close to time in which the drives were off, s.
_NEAR_OFF_S = 0.5
#: Samples, drawn evenly, that tell the step of an encoder.
_DRAWN = 20_000


@dataclass(frozen=True, slots=True, eq=False)
class RestBlocks:
    """Signals of the judged joints in means over blocks of time; NaN where a sample is unknown or does not count.

    Attributes:
        time_s: (m,) middle of each block.
        period_s: between blocks.
        position_rad: (m, j).
        torque_nm: (m, j) measured less the model's.
        model_nm: (m, j) the model's.
        count_rad: (j,) step of the encoder.
        stands: (scales, m) no joint of the arm moves over the windows of a step, before and after them.
    """

    time_s: FloatArray
    period_s: float
    position_rad: FloatArray
    torque_nm: FloatArray
    model_nm: FloatArray
    count_rad: FloatArray
    stands: BoolArray

    @classmethod
    def of(cls, prepared: Prepared, run: DetectorRun) -> RestBlocks | None:
        """None without a model, without torque in N·m, or of too short a log."""
        series, columns = prepared.series, prepared.columns()
        if series.effort is None or series.effort_unit != "Nm" or prepared.rigid_nm is None:
            return None
        size = max(1, round(BLOCK_S / series.period_s))
        count = series.time_s.size // size
        if count * size * series.period_s < 2.0:
            return None
        period = size * series.period_s
        if round(sum(SCALES[-1]) / period) < 1:
            return None
        off = None
        if series.not_driven is not None and series.not_driven.any():
            off = widened(series.not_driven, round(_NEAR_OFF_S / series.period_s))

        every = _means(series.position_rad, size)
        thinned = series.position_rad[:: max(1, series.time_s.size // _DRAWN)]
        steps = np.array([smallest_step(thinned[:, j]) for j in columns])
        torque, model = (np.empty((count, len(columns)), order="F") for _ in range(2))
        effort, rigid, contact = series.effort, prepared.rigid_nm, prepared.contact_nm

        def fill(k: int) -> None:
            usable = run.detected.state[:, k] <= State.FRICTION_INTERVAL
            if off is not None:
                usable &= ~off
            modelled = rigid[:, columns[k]] + (0.0 if contact is None else contact[:, columns[k]])
            left = np.where(usable, effort[:, columns[k]] - modelled, np.nan)
            torque[:, k], model[:, k] = _means(left, size), _means(modelled, size)

        each(fill, range(len(columns)))
        stands = ~_moves(every, [Window.of(scale, period) for scale in SCALES])
        time_s = _means(series.time_s, size)
        return cls(time_s, period, every[:, columns], torque, model, steps, stands)


def _means(x: FloatArray, size: int) -> FloatArray:
    """(m, …) means of ``size`` rows in a row each; what is left at the end is left out."""
    whole = x[: x.shape[0] // size * size]
    total = whole[::size].copy(order="K")
    for k in range(1, size):
        total += whole[k::size]
    return np.asarray(total / size)


def _moves(position: FloatArray, windows: Sequence[Window]) -> BoolArray:
    """(windows, m) any joint with these positions (m, joints) goes further than one that stands."""

    moves = np.zeros((len(windows), position.shape[0]), dtype=np.bool_)
    for column in position.T:
        known = np.where(np.isfinite(column), column, 0.0)
        for of_window, w in zip(moves, windows, strict=True):
            of_window |= travel(known, w.before, w.after) > STILL
    return moves


@dataclass(frozen=True, slots=True)
class Window:
    """Blocks of a scale: of either mean, of the rise between them, and all that must be still around the middle."""

    width: int
    rise: int
    before: int
    after: int

    @classmethod
    def of(cls, scale: tuple[float, float], period_s: float) -> Window:
        """Of a scale: length of the means and time between them, s; blocks are so far apart, s."""
        width, rise = (max(least, round(x / period_s)) for x, least in zip(scale, (1, 0), strict=True))
        stood, stays = (max(1, round(t / period_s)) for t in (STOOD_S, STAYS_S))
        return cls(width, rise, stood + width + rise // 2, width + rise - rise // 2 + stays)


@dataclass(frozen=True, slots=True, eq=False)
class RunningSums:
    """Running sums of a signal of blocks: (m + 1,) of what is known, from its median, and of how many are unknown."""

    known: FloatArray
    lost: IntArray

    @classmethod
    def of(cls, x: FloatArray) -> RunningSums:
        """Of the values (m,), NaN where one is unknown."""
        unknown = ~np.isfinite(x)
        known = np.where(unknown, 0.0, x - median_of(x[~unknown]))
        return cls(np.append(0.0, np.cumsum(known)), np.append(0, np.cumsum(unknown)))

    def step(self, width: int, rise: int, rows: IntArray) -> FloatArray:
        """(k,) mean of ``width`` blocks after less that before, ``rise`` blocks apart, at some blocks.

        NaN where one is unknown among them, just before the block, or beyond an end.
        """
        first, last = width + rise // 2, self.known.size - 1 - width - (rise - rise // 2)
        out = np.full(rows.size, np.nan)
        inside = (rows >= first) & (rows <= last)
        at = rows[inside]
        before, after = at - first, at - first + width + rise
        sums, lost = self.known, self.lost
        step = (sums[after + width] - sums[after]) / width - (sums[before + width] - sums[before]) / width
        for start, stop in ((after, after + width), (before, before + width), (at - width, at)):
            step[lost[stop] > lost[start]] = np.nan
        out[inside] = step
        return out


def travel(x: FloatArray, before: int, after: int) -> FloatArray:
    """(m,) largest less smallest value of the blocks from k - before to k + after (not included), about each block k.

    Beyond the ends the values there are held.

    Args:
        x: (m,) none is unknown.
        before, after: blocks.
    """
    low, high = centred_extremes(x, before + after)
    middle = np.arange(x.size) + (before + after) // 2 - before
    return np.asarray((high - low)[middle.clip(0, x.size - 1)])
