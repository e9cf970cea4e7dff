"""One joint's signals at a time: what drawings are made from, without holding all joints in memory at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from collaudit.core.data.signals import Signals, State
from collaudit.core.numeric.arrays import BoolArray, FloatArray

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


class SignalSource(Protocol):
    """Where traces come from: signals in memory, or a run's file."""

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Joints there are signals of."""

    @property
    def end_s(self) -> float | None:
        """Time of the last sample; None without samples."""

    def trace(self, column: int) -> JointTrace:
        """One joint's signals."""

    def force_n(self) -> tuple[FloatArray, FloatArray] | None:
        """Time and size of the force at the wrist sensor (n,); None without one."""


@dataclass(frozen=True, slots=True, eq=False)
class TracesInMemory:
    """Traces of signals that are in memory."""

    signals: Signals

    @property
    def joint_names(self) -> tuple[str, ...]:
        """See :class:`SignalSource`."""
        return self.signals.joint_names

    @property
    def end_s(self) -> float | None:
        """See :class:`SignalSource`."""
        return float(self.signals.time_s[-1]) if len(self.signals.time_s) else None

    def trace(self, column: int) -> JointTrace:
        """See :class:`SignalSource`; what a run's file keeps in 7 digits has 7 digits here too."""
        s = self.signals
        return JointTrace(
            s.joint_names[column],
            s.time_s,
            s.position_rad[:, column].astype(np.float32),
            s.velocity_rad_s[:, column].astype(np.float32),
            s.measured_nm[:, column].astype(np.float32),
            s.residual_nm[:, column],
            s.state[:, column],
            float(s.gamma_nm[column]),
            None if s.least_nm is None else s.least_nm[:, column],
            None if s.most_nm is None else s.most_nm[:, column],
        )

    def force_n(self) -> tuple[FloatArray, FloatArray] | None:
        """See :class:`SignalSource`."""
        wrench = self.signals.wrench
        return None if wrench is None else (self.signals.time_s, size(wrench[:, :3].astype(np.float32)))


def size(force: Series) -> FloatArray:
    """(n,) length of vectors (n, 3)."""
    return np.asarray(np.sqrt(np.einsum("ij,ij->i", force, force, dtype=np.float64)))
