"""Columns of a torque that depends on one joint's angle alone, and that torque from their coefficients."""

from __future__ import annotations

import numpy as np

from collaudit.core.data.identification_result import DEGREE, AngleTorque, scaled_angle
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.stats import interval_95

#: rad (or m) that a joint must cover for its angle to tell anything.
_LEAST_RANGE = 0.2


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
