"""How far an effort channel smooths torque over time: a filter of drive or logger, a moving mean, values that are held.

While a joint moves one way, its drive supplies the model's torque and sliding friction. Both are smoothed by Gaussian
windows of one standard deviation after the other, and the effort is regressed on them, at the delay that suits best:
what the channel is made of does not matter, and neither do its delay, its scale or an offset. Windows that clearly
leave more than the best one, block of time against block, bound the interval (Student's t of the blocks' differences).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.special import stdtrit as student_quantile

from collaudit.core.data.uniform_series import MOVING_RAD_S, UniformSeries
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.filters import gaussian_smoothed
from collaudit.core.prepare.effort.channel_shift import all_known, basis_of, steady

Friction = Callable[[FloatArray], FloatArray]

#: Standard deviations of the windows, s. Shorter than 20 ms is what the filters of this program do themselves.
_WINDOWS_S = np.array([0.0, *np.geomspace(0.02, 1.0, 15)])
#: Delays of the effort that are tried, s, and samples looked at in a second.
_EARLIEST_S, _LATEST_S, _RATE_HZ = -0.04, 0.9, 50.0
#: Time about a reversal in which friction is not yet sliding, s.
_REVERSAL_S = 0.15
#: Least time in such motion, s; most samples of it.
_LEAST_S, _MOST = 5.0, 6_000
_BLOCKS = 20
#: A window of this standard deviation or more is said, s: half of what a push of 0.2 s needs to lose height.
SHOWN_S = 0.05


@dataclass(frozen=True, slots=True)
class Smoothing:
    """Standard deviation of a Gaussian window that smooths as the channel does, s: the best one, interval of 95 %.

    ``high_s`` is infinite where the motion does not bound it.
    """

    best_s: float
    low_s: float
    high_s: float

    @property
    def shown(self) -> bool:
        """Whether the channel clearly smooths more than a drive does."""
        return self.low_s >= SHOWN_S


def effort_smoothing(
    series: UniformSeries, drive_nm: FloatArray, rigid_nm: FloatArray, friction: Mapping[int, Friction]
) -> dict[int, Smoothing]:
    """How far the effort of each joint is smoothed: as all joints together tell, but for those that clearly differ.

    Args:
        series: all joints of the log.
        drive_nm: (n, j) effort less the torque of the commanded tool force; NaN where unknown.
        rigid_nm: (n, j) rigid-body torque.
        friction: sliding friction at (k,) speeds, by column.

    Returns:
        By column; empty where no joint moves for long enough.
    """
    grid = _Grid.of(series)
    found = {j: grid.left_over(series, j, drive_nm[:, j], rigid_nm[:, j], law) for j, law in friction.items()}
    told = {j: left for j, left in found.items() if left is not None}
    if not told:
        return {}
    own = {j: _interval(left) for j, left in told.items()}
    best_s = _together(told).best_s
    apart = {j: one for j, one in own.items() if not one.low_s <= best_s <= one.high_s}
    alike = {j: left for j, left in told.items() if j not in apart}
    arm = _together(alike) if alike else max(own.values(), key=lambda one: one.high_s)
    return {j: apart.get(j, arm) for j in friction}


def _together(told: Mapping[int, FloatArray]) -> Smoothing:
    """That of several joints, each in units of what its own best window leaves."""
    return _interval(np.sum([left / left.sum(axis=2).min() * left.size for left in told.values()], axis=0))


@dataclass(frozen=True, slots=True, eq=False)
class _Grid:
    """About fifty samples a second of the stretches that are long enough.

    Attributes:
        rows: (k,) samples of the log.
        stretches: slices of ``rows``.
        part: (k,) number of the stretch.
        step_s: between two of them.
    """

    rows: IntArray
    stretches: tuple[slice, ...]
    part: IntArray
    step_s: float

    @classmethod
    def of(cls, series: UniformSeries) -> _Grid:
        every = max(1, int(1.0 / (_RATE_HZ * series.period_s)))
        long = [span for span in series.segments if len(span) * series.period_s >= _LEAST_S]
        parts = [np.arange(span.start, span.stop, every) for span in long]
        ends = np.cumsum([0, *(part.size for part in parts)])
        number = np.repeat(np.arange(len(parts)), np.diff(ends))
        rows = np.concatenate([*parts, np.zeros(0, dtype=np.int64)]).astype(np.int64)
        return cls(rows, tuple(slice(int(a), int(b)) for a, b in pairwise(ends)), number, every * series.period_s)

    @property
    def shifts(self) -> IntArray:
        """(s,) delays that are tried, in steps."""
        return np.arange(round(_EARLIEST_S / self.step_s), round(_LATEST_S / self.step_s) + 1)

    def left_over(
        self, series: UniformSeries, j: int, drive: FloatArray, rigid: FloatArray, law: Friction
    ) -> FloatArray | None:
        """(windows, shifts, blocks) squares of one joint's effort that are left; None without motion or effort."""
        effort, torque, speed = drive[self.rows], rigid[self.rows], series.velocity_rad_s[self.rows, j]
        parts = np.column_stack([torque, law(np.nan_to_num(speed))])
        known = all_known([parts, speed[:, None]])
        sliding = known & steady(np.nan_to_num(speed), MOVING_RAD_S, round(_REVERSAL_S / self.step_s))
        use = self._reached(sliding, effort)
        if use.size * self.step_s < _LEAST_S:
            use = self._reached(known & (np.abs(np.nan_to_num(speed)) > MOVING_RAD_S), effort)
        if use.size * self.step_s < _LEAST_S:
            return None
        use = use[:: -(-use.size // _MOST)]
        measured = np.nan_to_num(effort)[use[:, None] + self.shifts]
        if np.ptp(measured) == 0.0:
            return None
        block = np.searchsorted(np.linspace(0, self.rows.size, _BLOCKS + 1)[1:-1], use, side="right")
        starts = np.searchsorted(block, np.arange(_BLOCKS))
        filled = np.nan_to_num(parts)
        out = [self._of_window(filled, window / self.step_s, use, measured, starts) for window in _WINDOWS_S]
        return np.array(out)

    def _reached(self, mask: BoolArray, effort: FloatArray) -> IntArray:
        """Marked samples about which the effort is known at all delays, within one stretch."""
        first, last = int(self.shifts[0]), int(self.shifts[-1])
        rows = np.flatnonzero(mask)
        rows = rows[(rows + first >= 0) & (rows + last < mask.size)]
        holes = np.concatenate([[0], np.cumsum(~np.isfinite(effort))])
        whole = holes[rows + last + 1] == holes[rows + first]
        return np.asarray(rows[whole & (self.part[rows + first] == self.part[rows + last])])

    def _of_window(
        self, parts: FloatArray, window: float, use: IntArray, measured: FloatArray, starts: IntArray
    ) -> FloatArray:
        """(shifts, blocks) of one window, in steps."""
        pieces = [[gaussian_smoothed(column, window) for column in parts[s].T] for s in self.stretches]
        smooth = np.concatenate([np.column_stack(piece) for piece in pieces])
        basis = basis_of(np.column_stack([smooth[use], np.ones(use.size)]))
        left = np.square(measured - basis @ (basis.T @ measured))
        sums = np.concatenate([np.zeros((1, left.shape[1])), np.cumsum(left, axis=0)])
        return np.asarray(np.diff(sums[np.append(starts, use.size)], axis=0).T)


def _interval(left: FloatArray) -> Smoothing:
    """From below the best window to above it, half a step before the first that clearly leaves more.

    Args:
        left: (windows, shifts, blocks) sums of squares; of each window those at its best delay count.
    """
    total = left.sum(axis=2)
    delay = total.argmin(axis=1)
    curve = left[np.arange(len(left)), delay]
    best = int(curve.sum(axis=1).argmin())
    worse = curve - curve[best]
    error = np.std(worse, axis=1, ddof=1) * np.sqrt(_BLOCKS)
    alike = np.flatnonzero(worse.sum(axis=1) <= student_quantile(_BLOCKS - 1, 0.975) * error)
    between = np.sqrt(_WINDOWS_S[:-1] * _WINDOWS_S[1:])
    bounded = alike[-1] < len(left) - 1 and delay[best] < left.shape[1] - 1
    low_s = float(between[alike[0] - 1]) if alike[0] > 0 else 0.0
    return Smoothing(float(_WINDOWS_S[best]), low_s, float(between[alike[-1]]) if bounded else np.inf)


def smoothing_words(found: Mapping[str, Smoothing], duration_s: float) -> str:
    """What a log's efforts do to a push, in words.

    Args:
        found: by joint, of those that show it.
        duration_s: of the push.
    """
    least = min(one.low_s for one in found.values())
    most = max(one.high_s for one in found.values())
    range_text = f"{least:.2g} s or more" if np.isinf(most) else f"{least:.2g} to {most:.2g} s"
    return (
        f"The efforts of {', '.join(found)} are smoothed on their way into the log, as by a window with a standard "
        f"deviation of {range_text} (95 %): a push of {duration_s:.2g} s shows less than its height. What would have "
        "been noticed counts that; shorter contact is flattened further."
    )


def joints_of(found: Mapping[int, Smoothing], names: Sequence[str]) -> dict[str, Smoothing]:
    """By name."""
    return {names[j]: one for j, one in found.items()}
