"""The scalar energy detector: power of all external torques, over speed.

With kinetic energy T = p·v / 2 and d(T)/dt = v·(tau - tau_s - f - G - tau_e), the external power is
v·tau_e = v·(tau - tau_s - f - G) - dT/dt. Its kernel needs no acceleration: K/(s + K) of the first term less
s K/(s + K) of T. Divided by the smoothed speed it is an effective torque in N·m: the external torque's component
along the motion. It sees nothing across the motion or at rest, and does not tell which joint was met.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from collaudit.core.config.schema import DetectConfig
from collaudit.core.data.signals import State
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.friction.friction_model import FrictionModel
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.kernel import Kernel, first_order
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.residual.balance import Balance, KnownTorques, friction_velocity, start_mask
from collaudit.core.residual.detector import Detector
from collaudit.core.residual.detectors.direct import direct_residual
from collaudit.core.residual.friction_bounds import friction_bounds
from collaudit.core.residual.isolation import WholeArm
from collaudit.core.residual.residual import SIGMAS, Residual, ResidualInputs

#: Slower than this the arm does too little work for power to mean anything, rad/s.
SLOW_RAD_S = 0.1


def energy_residual(prepared: Prepared, inputs: ResidualInputs, config: DetectConfig) -> Residual:
    """The scalar residual, N·m, in every joint's column; states say where it is evidence.

    Every joint of the model takes part in the energy, so each needs friction and torque; where one is unknown, all are.
    What is known of each joint (states, friction levels) is the direct detector's.

    Args:
        prepared: the log.
        inputs: friction laws, joints that contradict the model.
        config: gain, causality.
    """
    series, judged, torques = prepared.series, prepared.judged_series, KnownTorques.of(prepared)
    by_joint = direct_residual(prepared, inputs, config)
    kernel = first_order(config.observer_gain_per_s, config.causal)
    balance = Balance(kernel, None, by_joint.balance.velocity_rad_s, start_mask(series, kernel))
    unknown = replace(
        by_joint,
        torque_nm=np.full_like(by_joint.torque_nm, np.nan),
        effort_nm=None,
        hidden_nm=None,
        span_nm=None,
        levels={},
        balance=balance,
        isolation=WholeArm(judged.joint_names, np.ones(len(judged.joint_names)), judged.velocity_rad_s),
    )
    if len(prepared.judged) < len(series.joint_names) or any(joint not in inputs.laws for joint in series.joint_names):
        return replace(unknown, state=np.maximum(by_joint.state, State.NO_FRICTION))
    if torques is None:
        return unknown
    v = friction_velocity(series, kernel)
    low, high, slack = _friction_power(series, v, inputs.laws, by_joint)
    speed = np.sqrt(_smooth(kernel, series, (v**2).sum(axis=1)) + SLOW_RAD_S**2)
    power = _power(prepared, torques, v, kernel)
    low, high = _smooth(kernel, series, low), _smooth(kernel, series, high)
    beyond = np.maximum(power - high, 0.0) + np.minimum(power - low, 0.0)
    state = _state(series, by_joint.state, balance)
    state[(speed < 2.0 * SLOW_RAD_S) & (state == State.JUDGED)] = State.FRICTION_INTERVAL
    columns = np.ones((1, len(series.joint_names)))
    hidden = np.nan_to_num((high - low) / speed)
    return replace(
        unknown,
        torque_nm=(beyond / speed)[:, None] * columns,
        effort_nm=series.effort,
        state=np.repeat(state[:, None], columns.size, axis=1),
        hidden_nm=hidden[:, None] * columns,
        uncertainty_nm=np.nan_to_num((_smooth(kernel, series, slack) / speed)[:, None] * columns),
        levels=by_joint.levels,
    )


def _power(prepared: Prepared, torques: KnownTorques, v: FloatArray, kernel: Kernel) -> FloatArray:
    """(n,) smoothed external power with friction still in it, W."""
    series, measured = prepared.series, torques.measured_nm()
    if not kernel.causal:
        return _smooth(kernel, series, (v * (measured - torques.rigid_nm)).sum(axis=1))
    gravity = prepared.robot.gravity_torque(series.position_rad)
    momentum, _ = prepared.robot.momentum(series.position_rad, v)
    kinetic = 0.5 * (v * momentum).sum(axis=1)
    work = _smooth(kernel, series, (v * (measured - gravity)).sum(axis=1))
    return work - kernel.slope(kinetic[:, None], series.segments, series.period_s)[:, 0]


def _friction_power(
    series: UniformSeries,
    v: FloatArray,
    laws: Mapping[str, FrictionModel],
    by_joint: Residual,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Bounds of the friction's power over all joints, and what its level may be wrong by, W."""
    low, high, slack = (np.zeros(series.time_s.size) for _ in range(3))
    for j, joint in enumerate(series.joint_names):
        band = friction_bounds(series, j, v[:, j], laws[joint])
        level = by_joint.levels[joint]
        scale = 1.0 + level.deviation
        ends = (scale * band.low_nm * v[:, j], scale * band.high_nm * v[:, j])
        low += np.minimum(*ends)
        high += np.maximum(*ends)
        slack += SIGMAS * level.sd * np.abs(band.sliding_nm * v[:, j])
    return low, high, slack


def _state(series: UniformSeries, states: NDArray[np.int8], balance: Balance) -> NDArray[np.int8]:
    """(n,) one state: the worst of the joints, but a single joint's reversal does not stop the sum being evidence."""
    worst = np.where(states == State.FRICTION_INTERVAL, np.int8(State.JUDGED), states).max(axis=1)
    worst[balance.unsettled] = np.maximum(worst[balance.unsettled], State.EDGE)
    unusable: BoolArray = np.asarray(worst >= State.SATURATED)
    blocked = balance.kernel.reach(unusable[:, None], series.segments, series.period_s)[:, 0]
    worst[blocked & (worst < State.SATURATED)] = State.NOT_A_NUMBER
    return np.asarray(worst)


def _smooth(kernel: Kernel, series: UniformSeries, x: FloatArray) -> FloatArray:
    return kernel.apply(x[:, None], series.segments, series.period_s)[:, 0]


DETECTOR = Detector(
    name="energy",
    equation="r = K/(s + K) [dq^T tau_e] / sqrt(K/(s + K) [|dq|²] + v0²): external power over speed",
    source="energy observer (De Luca, Albu-Schäffer, Haddadin and Hirzinger 2006), divided by speed to N·m",
    residual=energy_residual,
    by_joint=False,
)
