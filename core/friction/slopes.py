"""Slopes of what friction laws leave, beside what else may be in it, with intervals from stretches of time."""

from __future__ import annotations

import numpy as np
from scipy.special import stdtrit as student_quantile

from collaudit.core.data.identification_result import Bounds
from collaudit.core.numeric.arrays import FloatArray, IntArray

_BLOCK_S = 2.0
_MIN_BLOCKS = 12
_KNOTS = 8
_TOGETHER = 4  # neighbouring blocks err alike
_SHARE_LEFT = 1e-4  # of the column's power, to be separated from a law


#: Share of friction per unit with its interval, and a point of the line: the mean of the other, and what is off there.
Slope = tuple[float, Bounds, float, float]


def friction_slope(
    time_s: FloatArray, residual: FloatArray, friction: FloatArray, nuisance: FloatArray, against: FloatArray
) -> Slope | None:
    """Slope of residual/friction over something else, compared at equal speeds (t interval over stretches of time).

    Args:
        time_s, residual, friction: (n,) settled samples: time, torque that is left, friction as fitted, signed.
        nuisance: (n, k) what may be in the residual besides, from :func:`any_law`.
        against: (n,) what friction may go with.

    Returns:
        The line; None with too little time, or nothing to compare.
    """
    weight = float(friction @ friction)
    if not weight > 0:
        return None
    middle = float(friction**2 @ against) / weight
    found = _over_time(time_s, friction * (against - middle), residual, nuisance)
    return None if found is None else (*found, middle, float(residual @ friction) / weight)


def load_slope(
    time_s: FloatArray, residual: FloatArray, friction: FloatArray, nuisance: FloatArray, load: FloatArray
) -> tuple[float, Bounds] | None:
    """N·m of friction per N·m of the gear's load (n,), a torque's size; compared as by :func:`friction_slope`."""
    return _over_time(time_s, np.sign(friction) * (load - load.mean()), residual, nuisance)


def _over_time(
    time_s: FloatArray, column: FloatArray, target: FloatArray, others: FloatArray
) -> tuple[float, Bounds] | None:
    blocks, label = np.unique(np.floor(time_s / _BLOCK_S), return_inverse=True)
    return jackknifed(column, target, others, label // _TOGETHER) if blocks.size >= _MIN_BLOCKS else None


def any_law(friction: FloatArray, speed: FloatArray, torque_rate: FloatArray) -> FloatArray:
    """(n, k) columns of what a law of speed, an effort stamped late or early, and a constant can explain.

    The law was fitted on the same motion: where the other rises while the speeds do, as in an experiment that goes
    through the speeds while the arm warms up, the law has taken up part of the trend. What any law of speed could
    take up (hats over speed) is therefore left aside; where that leaves little, the interval is wide.
    """
    log = np.log(np.maximum(speed, 1e-6))
    knots = np.unique(np.quantile(log, np.linspace(0.0, 1.0, _KNOTS)))
    hats = [np.interp(log, knots, row) for row in np.eye(knots.size)]
    return np.column_stack([np.ones_like(speed), torque_rate, *(np.sign(friction) * hat for hat in hats)])


def jackknifed(
    column: FloatArray, target: FloatArray, others: FloatArray, cluster: IntArray
) -> tuple[float, Bounds] | None:
    """Coefficient of one column beside others, its 95 % interval from leaving stretches of time out in turn.

    A stretch that alone separates some of the others from the column weighs as it should: without it the coefficient
    moves (MacKinnon, Nielsen and Webb, J. Appl. Econometrics 38, 2023: the cluster jackknife).

    Args:
        column, target: (n,); others: (n, k).
        cluster: (n,) number of the stretch that a sample belongs to.
    """
    power = float(column @ column)
    if not power > 0:
        return None
    squares, products = _normal_equations(column, target, others, cluster)
    inverse, total = _inverse(squares.sum(axis=0)), products.sum(axis=0)
    own = 1.0 / inverse[0, 0] if inverse[0, 0] > 0 else 0.0  # what the others leave of the column
    if own < _SHARE_LEFT:
        return None
    without = _without_each(squares, products)
    share = np.einsum("i,cij,j->c", inverse[0] * own, squares, inverse[0] * own)
    freedom = max(1.0, float(share.sum() ** 2 / (share @ share)) - 1.0)
    scatter = (len(squares) - 1) / len(squares) * float(np.sum((without - without.mean()) ** 2))
    slope = float(inverse[0] @ total)
    half = float(student_quantile(freedom, 0.975)) * float(np.sqrt(scatter))
    size = float(np.sqrt(power))
    return slope / size, ((slope - half) / size, (slope + half) / size)


def held_out_slopes(column: FloatArray, target: FloatArray, others: FloatArray, fold: IntArray) -> FloatArray:
    """(f,) coefficient of one column beside others by the samples that are not of each fold.

    Args:
        column, target, others: as of :func:`jackknifed`.
        fold: (n,) number of the fold that a sample belongs to, from 0 on, none without samples.
    """
    squares, products = _normal_equations(column, target, others, fold)
    return _without_each(squares, products) / max(float(np.linalg.norm(column)), 1e-300)


def _normal_equations(
    column: FloatArray, target: FloatArray, others: FloatArray, cluster: IntArray
) -> tuple[FloatArray, FloatArray]:
    """(c, k, k) and (c, k) of each cluster, of columns of length one; the column that is asked for is the first."""
    columns = np.column_stack([column, others])
    columns /= np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    order = np.argsort(cluster, kind="stable")
    parts = np.split(order, np.flatnonzero(np.diff(cluster[order])) + 1)
    squares = np.array([columns[rows].T @ columns[rows] for rows in parts])
    return squares, np.array([columns[rows].T @ target[rows] for rows in parts])


def _without_each(squares: FloatArray, products: FloatArray) -> FloatArray:
    """(c,) coefficient of the first column without each cluster: its share is taken off the sums of all."""
    inverse = _inverse(squares.sum(axis=0) - squares)
    return np.asarray(np.einsum("ck,ck->c", inverse[:, 0], products.sum(axis=0) - products))


def _inverse(square: FloatArray) -> FloatArray:
    """Pseudo-inverse of one symmetric matrix (k, k), or of each of a stack."""
    return np.asarray(np.linalg.pinv(square, rcond=1e-9, hermitian=True))
