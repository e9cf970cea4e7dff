"""The scalar energy detector: power of all external torques, over speed.

With kinetic energy T = p·v / 2 and d(T)/dt = v·(tau - tau_s - f - G - tau_e), the external power is
v·tau_e = v·(tau - tau_s - f - G) - dT/dt. Its kernel needs no acceleration: K/(s + K) of the first term less
s K/(s + K) of T. Divided by the smoothed speed it is an effective torque in N·m: the external torque's component
along the motion. It sees nothing across the motion or at rest, and does not tell which joint was met.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from collaudit.core.config.schema import DetectConfig
from collaudit.core.data.signals import State
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.friction.friction_model import FrictionModel
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.kernel import Kernel
from collaudit.core.prepare.prepared import Prepared, judged_series
from collaudit.core.residual.balance import kernel_of, start_mask
from collaudit.core.residual.friction_bounds import friction_bounds
from collaudit.core.residual.judged_balance import judged_balance
from collaudit.core.residual.residual import SIGMAS, Residual, compute_residual

#: Slower than this the arm does too little work for power to mean anything, rad/s.
SLOW_RAD_S = 0.1


def energy_residual(
    prepared: Prepared, laws: Mapping[str, FrictionModel], contradicted: frozenset[str], config: DetectConfig
) -> Residual:
    """The scalar residual, N·m, in every joint's column; states say where it is evidence.

    Every joint of the model takes part in the energy, so each needs friction and torque; where one is unknown, all are.

    Args:
        prepared: the log.
        laws: friction by joint.
        contradicted: joints whose effort contradicts the model.
        config: gain, causality, friction interval.
    """
    series = prepared.series
    judged = judged_series(prepared)
    direct = compute_residual(judged, judged_balance(prepared, config, "direct"), laws, contradicted, config)
    kernel = kernel_of(config, series.bandwidth_hz, "energy")
    if len(judged.joint_names) < len(series.joint_names) or any(j not in laws for j in series.joint_names):
        direct.state[:] = np.maximum(direct.state, State.NO_FRICTION)
        return Residual(np.full_like(direct.torque_nm, np.nan), None, direct.state, direct.uncertainty_nm, {})
    if prepared.rigid_nm is None or series.effort is None or series.effort_unit != "Nm":
        return direct
    measured = series.effort if prepared.contact_nm is None else series.effort - prepared.contact_nm
    raw = series.raw_velocity_rad_s
    v = series.velocity_rad_s if raw is None or not config.causal else raw
    low, high, slack = _friction_power(series, v, laws, direct, config)
    speed = np.sqrt(_smooth(kernel, series, (v**2).sum(axis=1)) + SLOW_RAD_S**2)
    power = _power(prepared, measured, v, kernel, config.causal)
    low, high = _smooth(kernel, series, low), _smooth(kernel, series, high)
    beyond = np.maximum(power - high, 0.0) + np.minimum(power - low, 0.0)
    state = _state(series, direct.state, kernel)
    still = np.zeros_like(state, dtype=bool)
    still[:] = speed < 2.0 * SLOW_RAD_S
    state[still & (state == State.JUDGED)] = State.FRICTION_INTERVAL
    columns = np.ones((1, len(judged.joint_names)))
    scalar = (beyond / speed)[:, None] * columns
    uncertain = (_smooth(kernel, series, slack) / speed)[:, None] * columns
    return Residual(scalar, series.effort, _broadcast(state, columns.shape[1]), np.nan_to_num(uncertain), direct.levels)


def _power(prepared: Prepared, measured: FloatArray, v: FloatArray, kernel: Kernel, causal: bool) -> FloatArray:
    """(n,) smoothed external power with friction still in it, W."""
    series = prepared.series
    if not causal:
        assert prepared.rigid_nm is not None
        return _smooth(kernel, series, (v * (measured - prepared.rigid_nm)).sum(axis=1))
    gravity = prepared.robot.gravity_torque(series.position_rad)
    momentum, _ = prepared.robot.momentum(series.position_rad, v)
    kinetic = 0.5 * (v * momentum).sum(axis=1)
    work = _smooth(kernel, series, (v * (measured - gravity)).sum(axis=1))
    return work - kernel.slope(kinetic[:, None], series.segments, series.period_s)[:, 0]


def _friction_power(
    series: UniformSeries,
    v: FloatArray,
    laws: Mapping[str, FrictionModel],
    direct: Residual,
    config: DetectConfig,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Bounds of the friction's power over all joints, and what its level may be wrong by, W."""
    low, high, slack = (np.zeros(series.time_s.size) for _ in range(3))
    for j, joint in enumerate(series.joint_names):
        band = friction_bounds(series, j, v[:, j], laws[joint], config.slow_speed_rad_s, config.reversal_travel_rad)
        scale = 1.0 + direct.levels[joint].deviation
        ends = (scale * band.low_nm * v[:, j], scale * band.high_nm * v[:, j])
        low += np.minimum(*ends)
        high += np.maximum(*ends)
        slack += SIGMAS * direct.levels[joint].sd * np.abs(band.sliding_nm * v[:, j])
    return low, high, slack


def _state(series: UniformSeries, states: NDArray[np.int8], kernel: Kernel) -> NDArray[np.int8]:
    """(n,) one state: the worst of the joints, but a single joint's reversal does not stop the sum being evidence."""
    worst = np.where(states == State.FRICTION_INTERVAL, np.int8(State.JUDGED), states).max(axis=1)
    unsettled = start_mask(series, kernel)
    worst[unsettled] = np.maximum(worst[unsettled], State.EDGE)
    blocked = kernel.reach((worst >= State.SATURATED)[:, None], series.segments, series.period_s)[:, 0]
    worst[blocked & (worst < State.SATURATED)] = State.NOT_A_NUMBER
    return np.asarray(worst)


def _broadcast(state: NDArray[np.int8], columns: int) -> NDArray[np.int8]:
    return np.repeat(state[:, None], columns, axis=1)


def _smooth(kernel: Kernel, series: UniformSeries, x: FloatArray) -> FloatArray:
    return kernel.apply(x[:, None], series.segments, series.period_s)[:, 0]
