"""Torque balance before friction, through a detector's kernel: causal, or offline (non-causal) with zero phase.

All linear detectors estimate the same quantity, tau_e of eq. (5). Written with the generalized momentum p = M(q) dq,

    tau_e = tau - tau_s - f + C(q, dq)^T dq - G(q) - dp/dt,

each is a kernel G(s) applied to this: r = G(s) [tau - tau_s - f + C^T dq - G] - s G(s) p. With acceleration at hand
that is G(s) applied to eq. (5); without it, s G(s) is itself a filter. The two forms are tested against each other.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from collaudit.core.data.joint_log import UniformSeries
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.filters import Kernel
from collaudit.core.numeric.parallel import each
from collaudit.core.prepare.prepared import Prepared


@dataclass(frozen=True, slots=True, eq=False)
class Balance:
    """What a kernel leaves of the torques of the judged joints before friction is taken off.

    Attributes:
        kernel: it passed.
        total_nm: (n, j) G(s)[tau - tau_s - rigid-body torque]; None without a model or torque, and for residuals
            that are not made joint by joint.
        velocity_rad_s: (n, j) velocity at which friction is to be taken; it has not passed the kernel.
        unsettled: (n,) samples at the start of a stretch that the kernel still remembers as unknown.
    """

    kernel: Kernel
    total_nm: FloatArray | None
    velocity_rad_s: FloatArray
    unsettled: BoolArray


@dataclass(frozen=True, slots=True, eq=False)
class KnownTorques:
    """Torques of all joints of a log, N·m.

    Attributes:
        effort_nm: (n, j) measured.
        rigid_nm: (n, j) rigid-body torque at the zero-phase motion.
        contact_nm: (n, j) J^T F of the commanded tool force, or None.
    """

    effort_nm: FloatArray
    rigid_nm: FloatArray
    contact_nm: FloatArray | None

    @classmethod
    def of(cls, prepared: Prepared) -> KnownTorques | None:
        """None without inertials, or without effort in N·m."""
        effort = prepared.series.effort
        if prepared.rigid_nm is None or effort is None or prepared.series.effort_unit != "Nm":
            return None
        return cls(effort, prepared.rigid_nm, prepared.contact_nm)

    def measured_nm(self) -> FloatArray:
        """(n, j) measured torque less that of the commanded tool force."""
        return self.effort_nm if self.contact_nm is None else self.effort_nm - self.contact_nm


#: Causal balance (n, j) of all joints of a log through a kernel.
CausalForm = Callable[[Prepared, KnownTorques, Kernel], FloatArray]


def torque_balance(prepared: Prepared, kernel: Kernel, causal_form: CausalForm) -> Balance:
    """Balance of the judged joints.

    Args:
        prepared: the log; the dynamics need all of its joints.
        kernel: G(s); not causal, it runs both ways over eq. (5) with the zero-phase acceleration.
        causal_form: how it is made where the kernel is causal.
    """
    series, torques = prepared.series, KnownTorques.of(prepared)
    total: FloatArray | None = None
    velocity, columns = friction_velocity(series, kernel), prepared.columns()
    if torques is not None:
        total = (causal_form if kernel.causal else _offline)(prepared, torques, kernel)
    if len(columns) < len(series.joint_names):
        velocity = np.asfortranarray(velocity[:, columns])
        total = None if total is None else np.asfortranarray(total[:, columns])
    return Balance(kernel, total, velocity, start_mask(series, kernel))


def friction_velocity(series: UniformSeries, kernel: Kernel) -> FloatArray:
    """(n, j) velocity at which friction is taken: causally the raw one, where there is one."""
    raw = series.raw_velocity_rad_s
    return series.velocity_rad_s if raw is None or not kernel.causal else raw


def start_mask(series: UniformSeries, kernel: Kernel) -> BoolArray:
    """(n,) samples within the kernel's memory of the start of a stretch (and of its end, when run both ways)."""
    out = np.zeros(series.time_s.size, dtype=bool)
    count = math.ceil(kernel.settle_s / series.period_s)
    for span in series.segments:
        out[span.start : min(span.start + count, span.stop)] = True
        if not kernel.causal and count:
            out[max(span.stop - count, span.start) : span.stop] = True
    return out


def _offline(prepared: Prepared, torques: KnownTorques, kernel: Kernel) -> FloatArray:
    """Eq. (5) through a kernel that runs both ways."""
    total = np.empty_like(torques.effort_nm, order="F")

    def fill_joint(j: int) -> None:
        unexplained = torques.effort_nm[:, j] - torques.rigid_nm[:, j]
        if torques.contact_nm is not None:
            unexplained -= torques.contact_nm[:, j]
        smoothed = kernel.apply(unexplained[:, None], prepared.series.segments, prepared.series.period_s)
        total[:, j] = smoothed[:, 0]

    each(fill_joint, range(total.shape[1]))
    return total


def from_acceleration(prepared: Prepared, torques: KnownTorques, kernel: Kernel) -> FloatArray:
    """Position, velocity and effort pass the kernel alike; acceleration is its own smoothed derivative."""
    series = prepared.series
    segments, period, velocity = series.segments, series.period_s, friction_velocity(series, kernel)
    q = kernel.apply(series.position_rad, segments, period)
    v = kernel.apply(velocity, segments, period)
    a = kernel.slope(velocity, segments, period)
    measured = kernel.apply(torques.measured_nm(), segments, period)
    return np.asarray(measured - prepared.robot.inverse_dynamics(q, v, a))


def from_momentum(prepared: Prepared, torques: KnownTorques, kernel: Kernel) -> FloatArray:
    """The momentum's slope, which needs no acceleration."""
    series = prepared.series
    segments, period = series.segments, series.period_s
    momentum, rest = prepared.robot.momentum(series.position_rad, friction_velocity(series, kernel))
    total = np.empty_like(torques.effort_nm, order="F")

    def fill_joint(j: int) -> None:
        known = rest[:, j]
        known += torques.effort_nm[:, j]
        if torques.contact_nm is not None:
            known -= torques.contact_nm[:, j]
        total[:, j] = kernel.apply(known[:, None], segments, period)[:, 0]
        total[:, j] -= kernel.slope(momentum[:, j : j + 1], segments, period)[:, 0]

    each(fill_joint, range(torques.effort_nm.shape[1]))
    return total
