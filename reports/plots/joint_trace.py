"""One joint's signals at a time: what drawings are made from, without holding all joints in memory at once.

Numbers have the steps that ``signals.parquet`` keeps them in, powers of two. The last 16 bits of a 32-bit measurement
are noise that no compression removes: rounded to a multiple of 2^-k they become zeros, which cost nothing, and the
numbers stay ordinary 32-bit floats for whoever reads the file.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from collaudit.core.data.signals import Signals, State
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.stats import quantile_of

Series = NDArray[np.floating[Any]]


@dataclass(frozen=True, slots=True, eq=False)
class JointTrace:
    """One joint's signals over the log; fields as in :class:`Signals`, arrays (n,).

    Attributes:
        gamma_nm: threshold, NaN where there is none.
        least_nm, most_nm: range of the residual where friction is an interval; None where that is not told.
    """

    joint: str
    time_s: FloatArray
    position_rad: Series
    velocity_rad_s: Series
    measured_nm: Series
    residual_nm: FloatArray
    state: NDArray[np.int8]
    gamma_nm: float
    least_nm: Series | None = None
    most_nm: Series | None = None

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


@dataclass(frozen=True, slots=True, eq=False)
class TracesInMemory:
    """Traces of signals that are in memory; what reads them from a run's file has the same methods."""

    signals: Signals

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Joints there are signals of."""
        return self.signals.joint_names

    @property
    def end_s(self) -> float | None:
        """Time of the last sample; None without samples."""
        return float(self.signals.time_s[-1]) if len(self.signals.time_s) else None

    def trace(self, column: int) -> JointTrace:
        """One joint's signals; numbers have the steps that a run's file keeps them in."""
        s, gamma_nm = self.signals, float(self.signals.gamma_nm[column])
        step = torque_step_nm(s.residual_nm[:, column], gamma_nm)

        def kept(name: str) -> np.ndarray[Any, Any]:
            return stored(name, getattr(s, name)[:, column], step, gamma_nm)

        return JointTrace(
            s.joint_names[column],
            s.time_s,
            kept("position_rad"),
            kept("velocity_rad_s"),
            kept("measured_nm"),
            kept("residual_nm").astype(np.float64),
            s.state[:, column],
            gamma_nm,
            None if s.least_nm is None else kept("least_nm"),
            None if s.most_nm is None else kept("most_nm"),
        )

    def force_n(self) -> tuple[FloatArray, FloatArray] | None:
        """Time and size of the force at the wrist sensor (n,); None without one."""
        wrench = self.signals.wrench
        return None if wrench is None else (self.signals.time_s, size(in_steps(wrench[:, :3], FORCE_STEP_N)))


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


def torque_step_nm(residual_nm: FloatArray, gamma_nm: float) -> float:
    """The step of a joint's torques, N·m; 0 where there is no threshold: as fine as 32 bits are.

    Args:
        residual_nm: (n,), whose spread (half of what holds 68 %, of some thousand samples spread over time) bounds it.
        gamma_nm: threshold, NaN where there is none.
    """
    seen = residual_nm[:: max(1, residual_nm.size // _SAMPLED)]
    seen = seen[np.isfinite(seen)]
    if not gamma_nm > 0.0 or seen.size == 0:
        return 0.0
    low, high = quantile_of(seen, 0.16), quantile_of(seen, 0.84)
    largest = min(GAMMA_SHARE * gamma_nm, SPREAD_SHARE * 0.5 * (high - low))
    return 2.0 ** math.floor(math.log2(largest)) if largest > 1e-12 else 0.0


def in_steps(x: FloatArray, step: float) -> np.ndarray[tuple[int], np.dtype[np.float32]]:
    """The values rounded to multiples of a step, a power of two; 0 only takes them into 32 bits."""
    if step == 0.0:
        return x.astype(np.float32)
    out = np.multiply(x, 1.0 / step, dtype=np.float64)
    np.rint(out, out=out)
    out *= step
    return out.astype(np.float32)


def in_steps_within(x: FloatArray, step: float, limit: float) -> np.ndarray[tuple[int], np.dtype[np.float32]]:
    """(n,) as of :func:`in_steps`, but a size above a limit stays above it, and one up to it does not pass it."""
    out = in_steps(x, step)
    if not limit > 0.0:
        return out
    above = np.abs(x) > limit
    crossed = np.flatnonzero((np.abs(out.astype(np.float64)) > limit) != above)
    for k in crossed.tolist():
        out[k] = math.copysign(_next_to(limit, step, above=bool(above[k])), x[k])
    return out


def _next_to(limit: float, step: float, *, above: bool) -> np.float32:
    """The smallest 32-bit multiple of the step above a limit, or the largest up to it."""
    near = np.float32(limit if step == 0.0 else math.floor(limit / step) * step)
    if (float(near) > limit) == above:
        return near
    further = np.nextafter(near, np.float32(np.inf if above else -np.inf))
    return max(np.float32(near + step), further) if above else min(np.float32(near - step), further)


def stored(name: str, values: np.ndarray[Any, Any], step: float, gamma_nm: float) -> np.ndarray[Any, Any]:
    """(n,) a quantity of one joint as the file of signals holds it.

    Args:
        name: of the quantity: position_rad, velocity_rad_s, state, or one of the torques.
        values: (n,).
        step: of the joint's torques, N·m.
        gamma_nm: the joint's threshold.
    """
    if name == "state":
        return values
    if name == "residual_nm":
        return in_steps_within(values, step, gamma_nm)
    return in_steps(values, {"position_rad": POSITION_STEP, "velocity_rad_s": VELOCITY_STEP}.get(name, step))
