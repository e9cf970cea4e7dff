"""How far an effort channel smooths torque over time: a filter of drive or logger, a moving mean, values that are held.

While a joint moves one way, its drive supplies the model's torque and sliding friction. Both are smoothed by Gaussian
windows of one standard deviation after the other, and the effort is regressed on them, at the delay that suits best:
what the channel is made of does not matter, and neither do its delay, its scale or an offset. Windows that clearly
leave more than the best one bound the interval. About reversals, where the drive's torque turns fastest, friction turns
gradually and looks smoothed itself: such motion is a bound from above and never a sign of smoothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import ceil, isfinite

import numpy as np
from scipy.special import stdtrit as student_quantile

from collaudit.core.data.joint_log import MOVING_RAD_S
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray, Span, run_bounds
from collaudit.core.numeric.filters import gaussian_smoothed
from collaudit.core.numeric.parallel import by_name
from collaudit.core.torque_table.block_sums import explained, products_of
from collaudit.core.torque_table.log_samples import TorqueTable, one_way

#: Standard deviations of the windows, s. Shorter than 20 ms is what the filters of this program do themselves.
_WINDOWS_S = np.array([0.0, *np.geomspace(0.02, 1.0, 15)])
#: Delays of the effort that are tried, s.
_EARLIEST_S, _LATEST_S = -0.04, 0.9
#: What both sides are smoothed by before smoothing that seems to be there is said, s: acceleration is noisy, and a
#: window that calms it looks like one that the effort has passed.
_CALM_S = 0.1
#: Time about a reversal in which friction is not yet sliding, s.
_REVERSAL_S = 0.15
#: Least time in such motion, s; most samples of it.
_LEAST_S, _MOST = 5.0, 6_000
#: Of a log that moves for longer, pieces of it are looked at, s: so much in all tells as much as an hour does.
_PIECE_S, _IN_ALL_S = 60.0, 240.0
_BLOCKS = 20
#: Share of the effort's power below which a difference of sums of squares is rounding.
_ROUNDING = 1e-12
#: Smoothing that leaves less than so many times less of the effort's power is any error of the model.
_MATERIAL = 1.5
#: A window of this standard deviation or more is said, s: at 0.05 s a push of 0.2 s keeps 95 % of its height.
_SHOWN_S = 0.05
#: Sliding friction at (k,) speeds, in the effort's unit.
Friction = Callable[[FloatArray], FloatArray]


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
        return self.low_s >= _SHOWN_S

    @property
    def bounded(self) -> bool:
        """Whether the motion tells how far the channel smooths at most."""
        return isfinite(self.high_s)

    def at_most(self, high_s: float) -> Smoothing:
        """The same below another bound."""
        return Smoothing(*(min(value, high_s) for value in (self.best_s, self.low_s, self.high_s)))


def effort_smoothing(table: TorqueTable, friction: Mapping[str, Friction]) -> dict[str, Smoothing]:
    """How far the effort of each joint is smoothed: as all joints together tell, but for those that clearly differ.

    Args:
        table: the log, its effort without the torque of the commanded tool force, its model that of the rigid bodies.
        friction: sliding friction at (k,) speeds, by joint.

    Returns:
        By joint; empty where none moves for long enough.
    """
    log = _Stretches.of(table)

    def of_joints(calm_s: float, *margins_s: float) -> list[dict[str, Smoothing]]:
        found = by_name(lambda joint: log.explained(joint, friction[joint], margins_s, calm_s), friction)
        by_margin = [
            {joint: one for joint, each in found.items() if (one := each[k]) is not None} for k in range(len(margins_s))
        ]
        return [_of_each(one, friction) if one else {} for one in by_margin]

    one_way, about_reversals = of_joints(0.0, _REVERSAL_S, 0.0)
    if not one_way:  # friction that turns gradually looks smoothed: that bounds, and shows nothing
        return {joint: replace(one, low_s=0.0) for joint, one in about_reversals.items()}
    seems = any(one.best_s >= _SHOWN_S for one in one_way.values())
    calmed = of_joints(_CALM_S, _REVERSAL_S)[0] if seems else {}
    shown_s = {joint: calmed[joint].low_s if joint in calmed else 0.0 for joint in one_way}
    return {
        joint: replace(one, low_s=shown_s[joint]).at_most(about_reversals[joint].high_s)
        for joint, one in one_way.items()
    }


def _of_each(found: Mapping[str, _Explained], joints: Iterable[str]) -> dict[str, Smoothing]:
    """What all joints together tell, of each joint that does not clearly differ."""
    own = {j: _interval([one]) for j, one in found.items()}
    best_s = _interval(list(found.values())).best_s
    apart = {j: one for j, one in own.items() if not one.low_s <= best_s <= one.high_s}
    alike = [one for j, one in found.items() if j not in apart]
    arm = _interval(alike) if alike else max(own.values(), key=lambda one: one.high_s)
    return {j: apart.get(j, arm) for j in joints}


@dataclass(frozen=True, slots=True, eq=False)
class _Explained:
    """One joint's effort, and what each window explains of it.

    Attributes:
        products: (blocks, c, c) sums over blocks of time: one, model torque and friction by each window, and the effort
            behind by each delay.
        coefficients: (windows, 3, shifts) of each window's columns for the effort at each delay.
        totals: (windows, shifts) sums of squares that are left; of an effort without noise what rounding leaves.
        scale: mean square that the best window leaves.
    """

    products: FloatArray
    coefficients: FloatArray
    totals: FloatArray
    scale: float

    @classmethod
    def of(cls, effort: FloatArray, windows: Sequence[FloatArray], block: IntArray) -> _Explained:
        """Of (k, shifts) efforts, (k, 2) torque and friction by each window, and the block (k,) of each sample."""
        every = np.column_stack([np.ones(len(effort)), *windows, effort])
        products = products_of(every[:, None], block, _BLOCKS)[:, 0]
        total = products.sum(axis=0)
        squares = np.diag(total)[_EFFORTS:]
        found = [explained(total[np.ix_(own, own)], total[own, _EFFORTS:], squares) for own in _COLUMNS]
        totals = np.maximum([left for _, left in found], _ROUNDING * squares)
        return cls(products, np.array([x for x, _ in found]), totals, float(totals.min()) / len(effort))

    def chance(self, best: int, delays: IntArray) -> FloatArray:
        """(windows, blocks) sums of r d, r what the best window leaves and r + d what each does, at its delay."""
        left = np.zeros((len(delays), self.products.shape[1]))
        for window, (own, delay) in enumerate(zip(_COLUMNS, delays, strict=True)):
            left[window, own] = -self.coefficients[window, :, delay]
            left[window, _EFFORTS + delay] = 1.0
        return np.asarray(np.einsum("c,bcd,kd->kb", left[best], self.products, left - left[best], optimize=True))


#: Of the products of :class:`_Explained` the columns (3,) that each window explains by, and the first effort.
_COLUMNS = [np.array([0, 2 * window + 1, 2 * window + 2]) for window in range(_WINDOWS_S.size)]
_EFFORTS = 2 * _WINDOWS_S.size + 1


@dataclass(frozen=True, slots=True, eq=False)
class _Stretches:
    """Pieces of a table that are long enough and in which something moves, evenly over a long log.

    Attributes:
        table: the log.
        pieces: ranges of its rows.
        shifts: (s,) delays that are tried, in rows.
    """

    table: TorqueTable
    pieces: list[Span]
    shifts: IntArray

    @classmethod
    def of(cls, table: TorqueTable) -> _Stretches:
        least, size = (round(t / table.period_s) for t in (_LEAST_S, _PIECE_S))
        known = zip(*run_bounds(np.asarray(np.isfinite(table.model).all(axis=1))), strict=True)
        pieces = [Span(a, min(a + size, stop)) for start, stop in known for a in range(start, stop, size)]
        moves = np.asarray((np.abs(table.motion[1]) > MOVING_RAD_S).any(axis=1))
        pieces = [piece for piece in pieces if len(piece) >= least and moves[piece.slice].any()]
        some = max(1, ceil(sum(map(len, pieces)) * table.period_s / _IN_ALL_S))
        shifts = np.arange(round(_EARLIEST_S / table.period_s), round(_LATEST_S / table.period_s) + 1)
        return cls(table, pieces[::some], shifts)

    def explained(
        self, joint: str, law: Friction, margins_s: Sequence[float], calm_s: float
    ) -> list[_Explained | None]:
        """One joint's effort in motion, for each time kept from reversals; None without such motion or effort.

        ``margins_s``: time about a reversal that does not count, s, as friction is not yet sliding. ``calm_s``: by what
        effort, torque and friction are smoothed alike before they are compared, s.
        """
        j, step_s = self.table.joints.index(joint), self.table.period_s
        effort, speed = self.table.effort[:, j], np.nan_to_num(self.table.motion[1][:, j])
        slides = [one_way(speed, MOVING_RAD_S, round(margin_s / step_s)) for margin_s in margins_s]
        uses = [self._reached(mask, effort, calm_s) for mask in slides]
        if max(use.size for use in uses) * step_s < _LEAST_S:
            return [None] * len(uses)
        parts = np.nan_to_num(np.column_stack([effort, self.table.model[:, j], law(speed)]))
        calm = self._smoothed(parts, calm_s / step_s)
        windows = [self._smoothed(calm[:, 1:], window / step_s) for window in _WINDOWS_S]
        return [self._explained_at(use, calm[:, 0], windows) for use in uses]

    def _explained_at(self, use: IntArray, effort: FloatArray, windows: Sequence[FloatArray]) -> _Explained | None:
        """An effort (m,) at some rows, and what is explained there by model torque and friction (m, 2), smoothed."""
        if use.size * self.table.period_s < _LEAST_S:
            return None
        use = use[:: -(-use.size // _MOST)]
        measured = effort[use[:, None] + self.shifts]
        if np.ptp(measured) == 0.0:
            return None
        block = np.searchsorted(np.linspace(0, effort.size, _BLOCKS + 1)[1:-1], use, side="right")
        return _Explained.of(measured, [smoothed[use] for smoothed in windows], block)

    def _reached(self, mask: BoolArray, effort: FloatArray, calm_s: float) -> IntArray:
        """Marked rows about which the effort is known at all delays, within one piece."""
        reach = int(3.0 * calm_s / self.table.period_s)
        first, last = int(self.shifts[0]) - reach, int(self.shifts[-1]) + reach
        holes = np.concatenate([[0], np.cumsum(~np.isfinite(effort))])
        rows = [np.arange(piece.start - first, piece.stop - last) for piece in self.pieces]
        near = np.concatenate([*rows, np.zeros(0)]).astype(np.int64)
        near = near[mask[near]]
        return np.asarray(near[holes[near + last + 1] == holes[near + first]])

    def _smoothed(self, parts: FloatArray, window: float) -> FloatArray:
        """(m, c) columns smoothed by a window, in rows, each piece by itself."""
        if window == 0.0:
            return parts
        out = np.zeros_like(parts)
        for piece in self.pieces:
            for column, smoothed in zip(parts[piece.slice].T, out[piece.slice].T, strict=True):
                smoothed[:] = gaussian_smoothed(column, window)
        return out


def _interval(joints: Sequence[_Explained]) -> Smoothing:
    """From below the best window to above it, half a step before the next that clearly leaves more.

    With r what the best window leaves and r + d what another one does, that leaves sum(d² + 2 r d) more. Of this only
    r d is chance; its error is that of blocks of time.

    Args:
        joints: those whose efforts are smoothed alike; each counts in units of what its own best window leaves.
    """
    total = np.sum([one.totals / one.scale for one in joints], axis=0)
    delay = total.argmin(axis=1)
    more = total[np.arange(len(total)), delay]
    best = int(more.argmin())
    chance = np.sum([one.chance(best, delay) / one.scale for one in joints], axis=0)
    error = 2.0 * np.sqrt(np.sum(chance**2, axis=1))
    worse = np.flatnonzero(more - more[best] > student_quantile(_BLOCKS - 1, 0.975) * error)
    below, above = worse[worse < best], worse[worse > best]
    between = np.sqrt(_WINDOWS_S[:-1] * _WINDOWS_S[1:])
    bounded = above.size > 0 and delay[best] < total.shape[1] - 1
    clear = below.size > 0 and more[0] > _MATERIAL * more[best]
    low_s = float(between[below[-1]]) if clear else 0.0
    return Smoothing(float(_WINDOWS_S[best]), low_s, float(between[above[0] - 1]) if bounded else np.inf)


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
