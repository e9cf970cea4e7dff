"""One joint's signals at a time: what drawings are made from, without holding all joints in memory at once.

Numbers have the steps that ``signals.parquet`` keeps them in, powers of two. The last 16 bits of a 32-bit measurement
are noise that no compression removes: rounded to a multiple of 2^-k they become zeros, which cost nothing, and the
numbers stay ordinary 32-bit floats for whoever reads the file.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from collaudit.core.data.signals import Signals, State
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.stats import quantile_of

Series = NDArray[np.floating[Any]]


@dataclass(frozen=True, slots=True, eq=False)
class JointTrace:
    """One joint's signals over the log; fields as in :class:`Signals`, arrays (n,).

    Attributes:
        gamma_nm: threshold in force, NaN where there is none.
        least_nm, most_nm: range of the residual where friction is an interval; None where that is not told.
        cycle: number of the cycle and place on its path; None where nothing repeats.
    """

    joint: str
    time_s: FloatArray
    position_rad: Series
    velocity_rad_s: Series
    measured_nm: Series
    residual_nm: FloatArray
    state: NDArray[np.int8]
    gamma_nm: NDArray[np.float32]
    least_nm: Series | None = None
    most_nm: Series | None = None
    cycle: tuple[NDArray[np.int32], Series] | None = None

    @property
    def judged(self) -> BoolArray:
        """(n,) alarms above γ."""
        return np.asarray(self.state == State.JUDGED)

    @property
    def standing(self) -> BoolArray:
        """(n,) friction only known as a range."""
        return np.asarray(self.state == State.FRICTION_INTERVAL)

    @property
    def period_s(self) -> float:
        """Mean distance of two samples; 1 where there are fewer than two."""
        n = len(self.time_s)
        return float(self.time_s[-1] - self.time_s[0]) / (n - 1) if n > 1 else 1.0

    def part(self, start: int, stop: int) -> JointTrace:
        """Some of the samples, which do not keep the others in memory."""
        values = {one.name: getattr(self, one.name) for one in fields(self)}
        cut: dict[str, Any] = {name: x[start:stop].copy() for name, x in values.items() if isinstance(x, np.ndarray)}
        return replace(self, **cut, cycle=None)


def size(force: Series) -> FloatArray:
    """(n,) length of vectors (n, 3)."""
    return np.asarray(np.sqrt(np.einsum("ij,ij->i", force, force, dtype=np.float64)))


#: A torque's step is at most this share of gamma, and at most this share of the residual's own spread.
GAMMA_SHARE = 1.0 / 1000.0
SPREAD_SHARE = 1.0 / 16.0
#: 2 µrad or µm, of an encoder with 22 bits a turn; 15 µrad/s or µm/s; 8 mN and 2 mN·m of a wrist sensor.
POSITION_STEP = 2.0**-19
VELOCITY_STEP = 2.0**-16
FORCE_STEP_N = 2.0**-7
MOMENT_STEP_NM = 2.0**-9

_SAMPLED = 4096


def torque_step_nm(residual_nm: FloatArray, gamma_nm: NDArray[np.float32]) -> float:
    """The step of a joint's torques, N·m; 0 where there is no threshold: as fine as 32 bits are.

    Args:
        residual_nm: (n,), whose spread (half of what holds 68 %, of some thousand samples spread over time) bounds it.
        gamma_nm: (n,) threshold in force, NaN where there is none.
    """
    least = float(np.fmin.reduce(gamma_nm, initial=np.inf))
    seen = residual_nm[:: max(1, residual_nm.size // _SAMPLED)]
    seen = seen[np.isfinite(seen)]
    if not 0.0 < least < np.inf or seen.size == 0:
        return 0.0
    low, high = quantile_of(seen, 0.16), quantile_of(seen, 0.84)
    largest = min(GAMMA_SHARE * least, SPREAD_SHARE * 0.5 * (high - low))
    return 2.0 ** math.floor(math.log2(largest)) if largest > 1e-12 else 0.0


def in_steps(x: FloatArray, step: float) -> np.ndarray[tuple[int], np.dtype[np.float32]]:
    """The values rounded to multiples of a step, a power of two; 0 only takes them into 32 bits."""
    if step == 0.0:
        return x.astype(np.float32)
    out = np.multiply(x, 1.0 / step, dtype=np.float64)
    np.rint(out, out=out)
    out *= step
    return out.astype(np.float32)


def limits_nm(
    signals: Signals, column: int, rows: slice = slice(None), name: str = "residual_nm"
) -> tuple[NDArray[np.float32], ...]:
    """(n,) the levels of one joint that no residual of that name may be rounded across: of alarm and near miss."""
    if name == "cycle_nm" and signals.cycles is not None:
        return (signals.cycles.gamma_nm[rows, column],)
    gamma = signals.gamma_nm[rows, column]
    return gamma, gamma - np.float32(signals.near_below_nm[column])


def in_steps_within(
    x: FloatArray, step: float, limits: Sequence[NDArray[np.float32]]
) -> np.ndarray[tuple[int], np.dtype[np.float32]]:
    """(n,) as of :func:`in_steps`, but a size above a limit (n,) stays above, and one up to it does not pass it.

    What a step would carry across a limit keeps all of its 32 bits.
    """
    out = in_steps(x, step)
    above = [np.abs(x) > limit for limit in limits]
    crossed = np.logical_or.reduce([(np.abs(out) > limit) != its for limit, its in zip(limits, above, strict=True)])
    out[crossed] = x[crossed].astype(np.float32)
    for limit, its in zip(limits, above, strict=True):
        level = its & (np.abs(out) <= limit)
        out[level] = np.copysign(np.nextafter(limit[level], np.float32(np.inf)), x[level])
    return out


def stored(
    name: str, values: np.ndarray[Any, Any], step: float, limits: Sequence[NDArray[np.float32]]
) -> np.ndarray[Any, Any]:
    """(n,) a quantity of one joint as the file of signals holds it.

    Args:
        name: of the quantity: position_rad, velocity_rad_s, state, gamma_nm, or one of the torques.
        values: (n,).
        step: of the joint's torques, N·m.
        limits: of :func:`limits_nm`, of these samples.
    """
    if name in ("state", "gamma_nm", "cycle_gamma_nm"):
        return values
    if name in ("residual_nm", "cycle_nm"):
        return in_steps_within(values, step, limits)
    return in_steps(values, {"position_rad": POSITION_STEP, "velocity_rad_s": VELOCITY_STEP}.get(name, step))


def extremes(values: Series, points: int) -> IntArray:
    """Samples with the least and the greatest finite value of each of ``points`` / 2 stretches.

    MinMaxLTTB is not used: its second stage may drop one of two spikes that fall into the same stretch.
    """
    from tsdownsample import MinMaxDownsampler

    finite = np.isfinite(values)
    if len(values) <= points or not finite.any():
        return np.flatnonzero(finite)
    clean = np.where(finite, values, np.nan)
    index = MinMaxDownsampler().downsample(clean, n_out=2 * max(2, points // 2))  # type: ignore[no-untyped-call]
    index = np.unique(index.astype(np.int64))
    return np.asarray(index[finite[index]])


def thin(time_s: FloatArray, values: FloatArray, points: int) -> tuple[FloatArray, FloatArray]:
    """Reduce a curve so that its highest and lowest sample of every pixel column stay in it.

    Args:
        time_s: (n,) ascending.
        values: (n,) NaN or infinite where there is no curve.
        points: about how many points to keep.

    Returns:
        Time and value of the points kept, with a NaN wherever the curve is interrupted.
    """
    finite = np.isfinite(values)
    if len(values) <= points:
        return time_s, np.where(finite, values, np.nan)
    index = extremes(values, points)
    breaks = np.flatnonzero(np.diff(np.cumsum(~finite)[index]) > 0) + 1
    kept_time, kept = time_s[index], values[index]
    return np.insert(kept_time, breaks, kept_time[breaks - 1]), np.insert(kept, breaks, np.nan)


def column_edges(count: int, columns: int) -> IntArray:
    """(k + 1,) first sample of each of ``columns`` equal stretches, at most as many as samples, and their number."""
    return np.linspace(0, count, min(columns, count) + 1).astype(np.int64)


def column_shares(mask: BoolArray, edges: IntArray) -> FloatArray:
    """(k,) share of True in each stretch."""
    return np.asarray(np.add.reduceat(mask, edges[:-1], dtype=np.float64) / np.diff(edges))


def column_extremes(values: Series, mask: BoolArray, edges: IntArray) -> tuple[FloatArray, FloatArray]:
    """(k,) least and greatest of the masked finite values of each stretch; NaN where there is none."""
    shown = np.where(mask & np.isfinite(values), values, np.nan)
    return np.fmin.reduceat(shown, edges[:-1]), np.fmax.reduceat(shown, edges[:-1])
