"""The torque that coupled axes take on the way to the joints, and how much of it is in doubt.

The friction of a motor that turns with several joints is a function of its own speed s, not of theirs. It is taken off
the effort, so that what remains is a joint's own, whatever detector or fit follows.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from collaudit.core.data.coupled_friction import CoupledFriction
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.runs import run_bounds

#: Below this speed of the axis, rad/s, its direction is not told.
STILL_RAD_S = 0.02


def axis_speed(series: UniformSeries, weights: Mapping[str, float], of: FloatArray) -> FloatArray:
    """(n,) weighted sum of the joints' columns.

    Args:
        series: says the columns.
        weights: by joint.
        of: (n, j) velocity, acceleration or position.
    """
    total = np.zeros(of.shape[0])
    for joint, weight in weights.items():
        total += weight * of[:, series.column(joint)]
    return total


def coupled_torque(series: UniformSeries, coupled: Mapping[str, CoupledFriction]) -> FloatArray:
    """(n, j) torque of all coupled axes at the joints, N·m.

    Args:
        series: the motion; velocity and acceleration as conditioned.
        coupled: by the motor's own joint.
    """
    out = np.zeros(series.velocity_rad_s.shape, order="F")
    for axis in coupled.values():
        s = axis_speed(series, axis.weights, series.velocity_rad_s)
        torque = axis.coulomb_nm * np.tanh(s / STILL_RAD_S) + axis.viscous_nm_s_per_rad * s
        if axis.inertia_kg_m2 is not None:
            torque += axis.inertia_kg_m2 * axis_speed(series, axis.weights, series.acceleration_rad_s2)
        for joint, weight in axis.weights.items():
            out[:, series.column(joint)] += weight * torque
    return out


def coupled_doubt(series: UniformSeries, coupled: Mapping[str, CoupledFriction], travel_rad: float) -> FloatArray:
    """(n, j) by how much the coupled torque may be off (95 %), N·m.

    After a reversal of the axis its friction is anywhere between both directions' until it has travelled.

    Args:
        series: the motion.
        coupled: by the motor's own joint.
        travel_rad: travel of an axis until its friction is steady.
    """
    out = np.zeros(series.velocity_rad_s.shape, order="F")
    for axis in coupled.values():
        s = axis_speed(series, axis.weights, series.velocity_rad_s)
        loose = _loose(series, axis, s, travel_rad)
        half = {name: 0.5 * ((high or 0.0) - (low or 0.0)) for name, (low, high) in axis.ci95.items()}
        doubt = np.hypot(half.get("coulomb_nm", 0.0), half.get("viscous_nm_s_per_rad", 0.0) * s)
        doubt[loose] += axis.coulomb_nm * (1.0 + np.abs(np.tanh(s[loose] / STILL_RAD_S)))
        for joint, weight in axis.weights.items():
            out[:, series.column(joint)] += abs(weight) * np.nan_to_num(doubt)
    return out


def _loose(series: UniformSeries, axis: CoupledFriction, s: FloatArray, travel_rad: float) -> BoolArray:
    """(n,) the axis rests, or has not travelled far enough since it rested or reversed."""
    out = np.ones(s.size, dtype=np.bool_)
    angle = axis_speed(series, axis.weights, series.position_rad)
    for direction in (s > STILL_RAD_S, s < -STILL_RAD_S):
        for start, stop in zip(*run_bounds(direction), strict=True):
            out[start:stop] = np.abs(angle[start:stop] - angle[start]) < travel_rad
    return out
