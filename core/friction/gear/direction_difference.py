"""Friction that differs between the directions, in pairs of sections: half their sum, which eq. (15) throws away.

Half the difference of a pair is the mean friction of both directions. Half its sum is gravity, the effort's zero, and
half of what forward friction exceeds backward friction. Gravity is the model's. A difference that is the same at every
speed cannot be told from the effort's zero; what changes with speed can, beside a zero that drifts and errors of the
model.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit as student_quantile

from collaudit.core.data.friction_result import DirectionDifference
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.prepare.effort.channel_shift import basis_of

_FEWEST_PAIRS = 14
#: One-sided level at which the change with speed counts. Two shapes are tried: of a hundred joints that are the same
#: both ways less than one is said to differ.
_LEVEL = 0.9999
#: The zero of an effort drifts as a polynomial in time of this degree, in each log.
_DRIFT = 3
#: Friction near standstill fades within so many times the slowest speed.
_FADING = 2.5
_RANK, _LEAST_FREEDOM = 1e-6, 6


@dataclass(frozen=True, slots=True)
class PairSum:
    """Half the sum of a pair of sections less the model's torque, which is half of what the directions differ by.

    Attributes:
        speed_rad_s: of both.
        half_nm: in the unit of the effort; the effort's zero is in it.
        se_nm: its standard error, from blocks of positions.
        time_s: the middle of both sections.
        position_rad: the middle of the common stroke.
        model_nm: the model's torque, half the sum of both.
    """

    speed_rad_s: float
    half_nm: float
    se_nm: float
    time_s: float
    position_rad: float
    model_nm: float


def direction_difference(logs: Sequence[Sequence[PairSum]]) -> DirectionDifference | None:
    """How far friction of the directions parts from the slowest to the fastest pair; None where that is not shown.

    Args:
        logs: the pairs of one joint, log by log; a log counts from a few pairs on, as its zero drifts by itself.
    """
    used = [pairs for pairs in logs if len(pairs) > _DRIFT + 1]
    pairs = [pair for log in used for pair in log]
    if len(pairs) < _FEWEST_PAIRS:
        return None
    speed, half, se = (np.array([getattr(p, n) for p in pairs]) for n in ("speed_rad_s", "half_nm", "se_nm"))
    q, model = (np.array([getattr(p, n) for p in pairs]) for n in ("position_rad", "model_nm"))
    nuisance = np.column_stack([_drift(used), model, np.cos(q), np.sin(q)])  # gain, gravity over the joint's angle
    weight = 1.0 / np.sqrt(se**2 + float(np.median(se)) ** 2 + 1e-12)
    slow, fast = float(speed.min()), float(speed.max())
    shapes = list(weight * _shapes(speed, slow))
    columns, basis = np.stack([*shapes, weight * half], axis=1), basis_of(weight[:, None] * nuisance)
    left = columns - basis @ (basis.T @ columns)
    freedom = len(pairs) - basis.shape[1]
    if freedom < _LEAST_FREEDOM or not any(_shows(left[:, k], left[:, 2], shapes[k], freedom - 1) for k in (0, 1)):
        return None
    apart = 2.0 * np.diff(_shapes(np.array([slow, fast]), slow))[:, 0]
    change, half_width = _change(left[:, :2], left[:, 2], apart, freedom - 2)
    return DirectionDifference(slow, fast, change, (change - half_width, change + half_width))


def _shows(column: FloatArray, target: FloatArray, whole: FloatArray, freedom: int) -> bool:
    """Whether one shape alone stands clear of zero: if nothing differs, that is wrong at the stated level only."""
    power = float(column @ column)
    if power < _RANK * float(whole @ whole):
        return False
    slope = float(column @ target) / power
    sd = float(np.sqrt(np.sum((target - slope * column) ** 2) / freedom / power))
    return abs(slope) > float(student_quantile(freedom, _LEVEL)) * sd


def _change(columns: FloatArray, target: FloatArray, apart: FloatArray, freedom: int) -> tuple[float, float]:
    """The change and half of its 95 % interval, with either shape allowed: which of them it is, is not known."""
    inverse = np.linalg.pinv(columns.T @ columns)
    estimate = inverse @ (columns.T @ target)
    scale = float(np.sum((target - columns @ estimate) ** 2)) / freedom
    error = float(np.sqrt(scale * apart @ inverse @ apart))
    return float(apart @ estimate), float(student_quantile(freedom, 0.975)) * error


def _shapes(speed: FloatArray, slowest: float) -> FloatArray:
    """(2, n) of a difference in viscous friction, and of one in what fades from standstill."""
    return np.stack([speed, np.exp(-speed / (_FADING * slowest))])


def _drift(logs: Sequence[Sequence[PairSum]]) -> FloatArray:
    """(n, …) polynomials in time, one a log."""
    blocks = []
    for k, pairs in enumerate(logs):
        time = np.array([p.time_s for p in pairs])
        x = 2.0 * (time - time.min()) / max(float(np.ptp(time)), 1e-9) - 1.0
        block = np.zeros((len(pairs), (_DRIFT + 1) * len(logs)))
        block[:, k * (_DRIFT + 1) : (k + 1) * (_DRIFT + 1)] = np.polynomial.legendre.legvander(x, _DRIFT)
        blocks.append(block)
    return np.concatenate(blocks)
