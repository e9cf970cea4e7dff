"""One joint's signals at a time: what drawings are made from, without holding all joints in memory at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from collaudit.core.data.signals import Signals, State
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.reports.values.signal_steps import FORCE_STEP_N, in_steps, stored, torque_step_nm

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
