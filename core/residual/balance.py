"""Torque balance before friction, as an engine sees it: smoothed by its kernel, causal or after the fact."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from collaudit.core.config.schema import DetectConfig
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.kernel import BOTH_WAYS, Kernel, butterworth, double_pole
from collaudit.core.numeric.parallel import ordered_map
from collaudit.core.residual.estimators import Engine, engine_named
from collaudit.core.robot.robot_model import RobotModel


@dataclass(frozen=True, slots=True, eq=False)
class Balance:
    """What an engine gives before friction is taken off.

    Attributes:
        engine, kernel: how it was computed.
        total_nm: (n, j) G(s)[tau - tau_s - rigid-body torque]; None without a model or torque.
        velocity_rad_s: (n, j) velocity at which friction is to be taken; it has not passed the kernel.
        unsettled: (n,) samples at the start of a stretch that the kernel still remembers as unknown.
    """

    engine: Engine
    kernel: Kernel
    total_nm: FloatArray | None
    velocity_rad_s: FloatArray
    unsettled: BoolArray


def kernel_of(config: DetectConfig, bandwidth_hz: float, name: str | None = None) -> Kernel:
    """The kernel of the configured engine; the direct engine's has its -3 dB point at ``bandwidth_hz``."""
    engine = engine_named(name or config.detector)
    if engine.name != "direct":
        return engine.make_kernel(config.observer_gain_per_s, config.causal)
    omega = 2.0 * math.pi * bandwidth_hz
    return butterworth(omega, True) if config.causal else double_pole(omega / BOTH_WAYS, False)


def balance_torques(
    series: UniformSeries,
    robot: RobotModel,
    rigid_nm: FloatArray | None,
    contact_nm: FloatArray | None,
    config: DetectConfig,
    name: str | None = None,
) -> Balance:
    """Balance of all joints of a series.

    After the fact (``causal = false``) the kernel runs both ways over eq. (5) with the zero-phase acceleration.
    Causally, signals pass forward filters only: ``direct`` filters position, velocity and effort alike and takes
    acceleration as the filter's own smoothed derivative; all others need none: they take the momentum's slope.

    Args:
        series: every joint of the model; effort in N·m.
        robot: the model.
        rigid_nm: (n, j) rigid-body torque at the zero-phase motion, None without inertials.
        contact_nm: (n, j) J^T F of the meant tool force, or None.
        config: causality and gain.
        name: engine; the configured one when absent.
    """
    engine = engine_named(name or config.detector)
    kernel = kernel_of(config, series.bandwidth_hz, name)
    raw = series.raw_velocity_rad_s
    velocity = series.velocity_rad_s if raw is None or not config.causal else raw
    total = None
    effort = series.effort
    if rigid_nm is not None and effort is not None and series.effort_unit == "Nm":
        if config.causal:
            total = _causal(series, robot, effort, contact_nm, velocity, engine, kernel)
        else:
            total = _after_the_fact(series, effort, rigid_nm, contact_nm, kernel)
    return Balance(engine, kernel, total, velocity, start_mask(series, kernel))


def _after_the_fact(
    series: UniformSeries, effort: FloatArray, rigid: FloatArray, contact: FloatArray | None, kernel: Kernel
) -> FloatArray:
    """Eq. (5) through the kernel, joint by joint, so that what is needed on the way stays small."""
    total = np.empty(effort.shape, order="F")

    def one(j: int) -> None:
        unexplained = effort[:, j] - rigid[:, j]
        if contact is not None:
            unexplained -= contact[:, j]
        kernel.apply(unexplained[:, None], series.segments, series.period_s, total[:, j : j + 1])

    for _ in ordered_map(one, range(effort.shape[1])):
        pass
    return total


def _causal(
    series: UniformSeries,
    robot: RobotModel,
    effort: FloatArray,
    contact: FloatArray | None,
    velocity: FloatArray,
    engine: Engine,
    kernel: Kernel,
) -> FloatArray:
    segments, period = series.segments, series.period_s
    if engine.needs_acceleration:
        q = kernel.apply(series.position_rad, segments, period)
        v = kernel.apply(velocity, segments, period)
        a = kernel.slope(velocity, segments, period)
        measured = effort if contact is None else effort - contact
        out: FloatArray = kernel.apply(measured, segments, period) - robot.inverse_dynamics(q, v, a)
        return out
    momentum, rest = robot.momentum(series.position_rad, velocity)
    total = np.empty(effort.shape, order="F")

    def one(j: int) -> None:
        known = rest[:, j]
        known += effort[:, j]
        if contact is not None:
            known -= contact[:, j]
        kernel.apply(known[:, None], segments, period, total[:, j : j + 1])
        total[:, j] -= kernel.slope(momentum[:, j : j + 1], segments, period)[:, 0]

    for _ in ordered_map(one, range(effort.shape[1])):
        pass
    return total


def start_mask(series: UniformSeries, kernel: Kernel) -> BoolArray:
    """(n,) samples within the kernel's memory of the start of a stretch (and of its end, when run both ways)."""
    out = np.zeros(series.time_s.size, dtype=bool)
    count = math.ceil(kernel.settle_s / series.period_s)
    for span in series.segments:
        out[span.start : min(span.start + count, span.stop)] = True
        if not kernel.causal and count:
            out[max(span.stop - count, span.start) : span.stop] = True
    return out
