"""Columns of a joint's torque beside the rigid body's: friction, axes that turn with several joints, angles, offsets.

A law of friction that is too poor biases what it stands beside: what sliding friction does at low speed has the
sign of the motion, as the torque of a ramp has, and friction that follows the speed late (frictional lag: Rabinowicz,
Proc. Phys. Soc. 71, 1958; LuGre: Canudas de Wit et al., IEEE Trans. Automatic Control 40, 1995) has the shape of
inertia. So the columns are sgn v, v and 1; |v|, which tells the directions apart; sgn v·exp(-|v|/w) for two widths;
and a·exp(-|v|/w) for the lag. A spring or counterbalance is a polynomial in one joint's angle. The offset may wander:
hat functions over each log.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.linalg import block_diag

from collaudit.core.data.identification_result import DEGREE, AngleTorque, scaled_angle
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.stats import interval_95

#: Columns of friction and offset of a joint, and which of them is the offset.
FRICTION_COLUMNS, OFFSET = 7, 2
_LOW_SPEEDS = (0.03, 0.1)  # rad/s: Stribeck velocities of gears lie between
#: rad (or m) that a joint must cover for its angle to tell anything.
_LEAST_RANGE = 0.2
_KNOT_S, _MOST_KNOTS = 30.0, 12  # of an offset that wanders


def friction_columns(velocity: FloatArray, acceleration: FloatArray) -> FloatArray:
    """(n, 7) sgn v, v, 1, |v|, two that fade with speed, and the lag, for one joint.

    Args:
        velocity: (n,) rad/s; acceleration: (n,) rad/s².
    """
    sign, speed = np.sign(velocity), np.abs(velocity)
    fading = [sign * np.exp(-speed / width) for width in _LOW_SPEEDS]
    lag = acceleration * np.exp(-speed / _LOW_SPEEDS[-1])
    return np.column_stack([sign, velocity, np.ones_like(speed), speed, *fading, lag])


def axis_columns(velocity: FloatArray, acceleration: FloatArray, weights: FloatArray) -> FloatArray:
    """(n, 3) sign, speed and acceleration of an axis that turns with several joints (n, j) by their weights (j,)."""
    speed = velocity @ weights
    return np.column_stack([np.sign(speed), speed, acceleration @ weights])


def drift_columns(times_s: Sequence[FloatArray]) -> FloatArray:
    """(n, d) hats about every half minute of each log, less their mean, so that the offset is the mean over time.

    Args:
        times_s: of each log, (n_k,) times of its samples, ascending.
    """
    parts, most = [], max(1, _MOST_KNOTS // len(times_s))
    for k, time in enumerate(times_s):
        # a log of less than half a minute has no drift: a trend would take what gravity does in the few poses it has
        count = min(int(float(time[-1] - time[0]) / _KNOT_S), most) if time.size else 0
        knots = np.linspace(time[0], time[-1], count + 1) if time.size else np.array([0.0])
        # the first log lacks one hat: all hats together are the offset itself
        hats = [np.interp(time, knots, row) for row in np.eye(count + 1)[int(k == 0) :]]
        parts.append(np.array(hats).reshape(len(hats), time.size).T)
    out = block_diag(*parts)
    return np.asarray(out - out.mean(axis=0))


def angle_columns(position: FloatArray, moving: BoolArray) -> FloatArray:
    """(n, 4) Legendre polynomials of the angle over the range seen, less their means; zero where it is too small.

    Args:
        position: (n,) of one joint; moving: (n,) where it counts.
    """
    found = angles_seen(position, moving)
    out = np.zeros((position.size, DEGREE))
    if found is None:
        return out
    low, high, *mean = found
    return _polynomials(position, low, high) - mean


def angles_seen(position: FloatArray, moving: BoolArray) -> tuple[float, ...] | None:
    """Least and largest angle, and the means of the four polynomials; None where the range is too small."""
    if not moving.any():
        return None
    low, high = float(position[moving].min()), float(position[moving].max())
    return (low, high, *_polynomials(position[moving], low, high).mean(axis=0)) if high - low >= _LEAST_RANGE else None


def angle_torque(
    seen: tuple[float, ...] | None, coefficients: FloatArray, covariance: FloatArray | None
) -> AngleTorque | None:
    """The torque that coefficients stand for; None where the motion tells none.

    Args:
        seen: of :func:`angles_seen`.
        coefficients: (4,) of its columns; covariance: (4, 4) of them, None without intervals.
    """
    if seen is None:
        return None
    low, high, *mean = seen
    nodes = np.linspace(low, high, DEGREE + 1)
    columns = _polynomials(nodes, low, high) - mean
    torque = columns @ coefficients
    angles = tuple(nodes.tolist())
    if covariance is None:
        return AngleTorque(angles, tuple(torque.tolist()))
    sd = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", columns, covariance, columns), 0.0))
    return AngleTorque(angles, tuple(torque.tolist()), tuple(map(interval_95, torque, sd)))


def _polynomials(position: FloatArray, low: float, high: float) -> FloatArray:
    every = np.polynomial.legendre.legvander(np.clip(scaled_angle(position, low, high), -1.0, 1.0), DEGREE)
    return np.asarray(every[:, 1:])
