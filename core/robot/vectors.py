"""Vectors of three numbers, each a constant or an array (m,) of one number a sample."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

from collaudit.core.numeric.arrays import FloatArray

Scalar: TypeAlias = FloatArray | float
Vector: TypeAlias = tuple[Scalar, Scalar, Scalar]
ZERO: Vector = (0.0, 0.0, 0.0)


def about_z(x: Vector, y: Vector) -> Scalar:
    """x · (y × z)."""
    return x[0] * y[1] - x[1] * y[0]


def add_z(vector: Vector, z: Scalar) -> Vector:
    """The vector with ``z`` added to its third number."""
    return vector[0], vector[1], vector[2] + z


def vector_of(x: FloatArray) -> Vector:
    """A constant vector (3,)."""
    return float(x[0]), float(x[1]), float(x[2])


def plus(x: Vector, y: Vector) -> Vector:
    """x + y."""
    return x[0] + y[0], x[1] + y[1], x[2] + y[2]


def scaled(factor: float, x: Vector) -> Vector:
    """factor · x."""
    return factor * x[0], factor * x[1], factor * x[2]


def cross(x: Vector, y: Vector) -> Vector:
    """x × y."""
    return x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]


def matrix_times(matrix: Sequence[Sequence[Scalar]], x: Sequence[Scalar] | FloatArray) -> Vector:
    """Matrix (3, 3) times x; most entries of a rotation between two joints are 0, and cost nothing."""
    a, b, c = (_row_times(row, x) for row in matrix)
    return a, b, c


def _row_times(row: Sequence[Scalar], x: Sequence[Scalar] | FloatArray) -> Scalar:
    terms = [a * b for a, b in zip(row, x, strict=True) if not (isinstance(a, float) and a == 0.0)]
    return sum(terms[1:], terms[0]) if terms else 0.0
