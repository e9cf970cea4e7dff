"""Slopes of what friction laws leave, beside what else may be in it, with intervals from stretches of time."""

from __future__ import annotations

import numpy as np

from collaudit.core.data.identification_result import Bounds
from collaudit.core.numeric.arrays import FloatArray, IntArray
from collaudit.core.torque_table.block_sums import BlockSums

_BLOCK_S = 2.0
_KNOTS = 8
_TOGETHER = 4  # neighbouring blocks err alike
_LEAST_OWN = 0.01  # of the column's standard deviation, to be separated from a law


#: Share of friction per unit with its interval, and a point of the line: the mean of the other, and what is off there.
Slope = tuple[float, Bounds, float, float]


def friction_slope(
    time_s: FloatArray, residual: FloatArray, friction: FloatArray, nuisance: FloatArray, against: FloatArray
) -> Slope | None:
    """Slope of residual/friction over something else, compared at equal speeds (t interval over stretches of time).

    Args:
        time_s, residual: (n,) settled samples: time, torque that is left.
        friction: (n,) what the slope is a share of: friction as fitted, signed; its sign alone for a slope in N·m.
        nuisance: (n, k) what may be in the residual besides, from :func:`any_law`.
        against: (n,) what friction may go with.

    Returns:
        The line; None with too little time, or nothing to compare.
    """
    weight = float(friction @ friction)
    if not weight > 0:
        return None
    middle = float(friction**2 @ against) / weight
    _, label = np.unique(np.floor(time_s / _BLOCK_S), return_inverse=True)
    found = jackknifed(friction * (against - middle), residual, nuisance, label // _TOGETHER)
    return None if found is None else (*found, middle, float(residual @ friction) / weight)


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
    """Coefficient of one column beside others, its 95 % interval from stretches of time.

    A stretch that alone separates some of the others from the column weighs as it should: without it the coefficient
    moves (MacKinnon, Nielsen and Webb, J. Appl. Econometrics 38, 2023: the cluster jackknife).

    Args:
        column, target: (n,); others: (n, k).
        cluster: (n,) number of the stretch that a sample belongs to, rising.
    """
    names = ("left", "column", *map(str, range(others.shape[1])))
    sums = BlockSums.of(cluster, names, np.column_stack([target, column, others]))
    found = sums.slope(*names, least_own=_LEAST_OWN)
    return None if found is None else (found.value, (found.value - found.half, found.value + found.half))
