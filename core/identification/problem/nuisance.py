"""What a joint's torque holds besides the rigid body, as columns that identification projects out.

A law of friction that is too poor biases what it is projected from: what sliding friction does at low speed has the
sign of the motion, as the torque of a ramp has, and friction that follows the speed late (frictional lag: Rabinowicz,
Proc. Phys. Soc. 71, 1958; LuGre: Canudas de Wit et al., IEEE Trans. Automatic Control 40, 1995) has the shape of
inertia. So the columns are sgn v, v and 1; |v|, which tells the directions apart; sgn v·exp(-|v|/w) for two widths;
and a·exp(-|v|/w) for the lag. The offset may wander: hat functions over each log. A spring or counterbalance adds a
polynomial in one joint's angle.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.linalg import block_diag

from collaudit.core.data.identification_result import DEGREE, AngleTorque, scaled_angle
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.stats import interval_95

OFFSET = 2
_LAW = 7
_COUPLED = 3
_LOW_SPEEDS = (0.03, 0.1)  # rad/s: Stribeck velocities of gears lie between
_KNOT_S = 30.0
_MOST_KNOTS = 20
_RANK = 1e-10
#: rad (or m) that a joint must cover for its angle to tell anything.
_LEAST_RANGE = 0.2


def friction_columns(velocity: FloatArray, acceleration: FloatArray) -> FloatArray:
    """(n, 7) sgn v, v, 1, |v|, two that fade with speed, and the lag, for one joint.

    Args:
        velocity: (n,) rad/s; acceleration: (n,) rad/s².
    """
    sign, speed = np.sign(velocity), np.abs(velocity)
    fading = [sign * np.exp(-speed / width) for width in _LOW_SPEEDS]
    lag = acceleration * np.exp(-speed / _LOW_SPEEDS[-1])
    return np.column_stack([sign, velocity, np.ones_like(speed), speed, *fading, lag])


def drift_columns(times_s: Sequence[FloatArray]) -> FloatArray:
    """(n, d) hats about every half minute of each log, less their mean, so that the offset is the mean over time.

    Args:
        times_s: of each log, (n_k,) times of its samples, ascending.
    """
    parts = []
    for k, time in enumerate(times_s):
        # a log of less than half a minute has no drift: a trend would take what gravity does in the few poses it has
        count = min(int(float(time[-1] - time[0]) / _KNOT_S), _MOST_KNOTS) if time.size else 0
        knots = np.linspace(time[0], time[-1], count + 1) if time.size else np.array([0.0])
        # the first log lacks one hat: all hats together are the offset itself
        hats = [np.interp(time, knots, row) for row in np.eye(count + 1)[int(k == 0) :]]
        parts.append(np.array(hats).reshape(len(hats), time.size).T)
    out = block_diag(*parts)
    return np.asarray(out - out.mean(axis=0))


def nuisance_columns(
    velocity: FloatArray, acceleration: FloatArray, drift: FloatArray, moving: BoolArray, coupled: FloatArray
) -> tuple[FloatArray, BoolArray]:
    """(j, n, 7 + 3 c + d) columns of every joint, and (j,) which joints move one way only.

    Of those friction and offset are one: what is the same both ways is left to friction.

    Args:
        velocity, acceleration, moving: (n, j).
        drift: (n, d).
        coupled: (c, j) weights of the joints in the speeds of axes that turn with several: their friction and drive
            inertia are columns of each of these joints.
    """
    joints = velocity.shape[1]
    first = _LAW + _COUPLED * coupled.shape[0]
    out = np.zeros((joints, velocity.shape[0], first + drift.shape[1]))
    one_way = np.zeros(joints, dtype=bool)
    for j in range(joints):
        out[j, :, :_LAW] = friction_columns(velocity[:, j], acceleration[:, j])
        for c in np.flatnonzero(coupled[:, j]):
            s = velocity @ coupled[c]
            at = _LAW + _COUPLED * c
            out[j, :, at : at + _COUPLED] = np.column_stack([np.sign(s), s, acceleration @ coupled[c]])
        out[j, :, first:] = drift
        ahead = np.count_nonzero(velocity[moving[:, j], j] > 0)
        total = np.count_nonzero(moving[:, j])
        one_way[j] = min(ahead, total - ahead) < 0.01 * total
        if one_way[j]:
            out[j][:, [OFFSET, OFFSET + 1]] = 0.0
    return out, one_way


def generalised_inverse(gram: FloatArray) -> FloatArray:
    """(k, k) generalised inverse of weighted products (k, k) of columns: those alike or zero share or have no part."""
    size = np.sqrt(np.maximum(np.diag(gram), 1e-300))
    size[np.diag(gram) <= 0] = 1.0
    inverse = np.linalg.pinv(gram / np.outer(size, size), rcond=_RANK, hermitian=True)
    return np.asarray(inverse / np.outer(size, size))


def angle_columns(position: FloatArray, moving: BoolArray) -> FloatArray:
    """(n, 4) Legendre polynomials of the angle over the range seen, less their means; zero where it is too small.

    Args:
        position: (n,) of one joint; moving: (n,) where it counts.
    """
    found = _range(position, moving)
    out = np.zeros((position.size, DEGREE))
    if found is None:
        return out
    every = _polynomials(position, *found)
    return np.asarray(every - every[moving].mean(axis=0))


def angle_torque(
    position: FloatArray, moving: BoolArray, coefficients: FloatArray, covariance: FloatArray | None
) -> AngleTorque | None:
    """The torque that coefficients stand for; None where the motion tells none.

    Args:
        position, moving: as of :func:`angle_columns`.
        coefficients: (4,) of its columns; covariance: (4, 4) of them, None without intervals.
    """
    found = _range(position, moving)
    if found is None:
        return None
    nodes = np.linspace(*found, DEGREE + 1)
    columns = _polynomials(nodes, *found) - _polynomials(position[moving], *found).mean(axis=0)
    torque = columns @ coefficients
    angles = tuple(nodes.tolist())
    if covariance is None:
        return AngleTorque(angles, tuple(torque.tolist()))
    sd = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", columns, covariance, columns), 0.0))
    return AngleTorque(angles, tuple(torque.tolist()), tuple(map(interval_95, torque, sd)))


def _range(position: FloatArray, moving: BoolArray) -> tuple[float, float] | None:
    if not moving.any():
        return None
    low, high = float(position[moving].min()), float(position[moving].max())
    return (low, high) if high - low >= _LEAST_RANGE else None


def _polynomials(position: FloatArray, low: float, high: float) -> FloatArray:
    every = np.polynomial.legendre.legvander(np.clip(scaled_angle(position, low, high), -1.0, 1.0), DEGREE)
    return np.asarray(every[:, 1:])
