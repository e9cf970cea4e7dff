"""What a joint's threshold is made of: noise, friction at reversals, model, ripple, drift, lag, each in N·m.

A cause is measured by what the threshold would fall without it: by the level that the clean residual sustains for n
samples once in a while, before and after its part is taken out. Parts are fitted on one half of the time and taken out
of the other, by turns of five seconds: what is fitted to chance then takes nothing out. Causes overlap.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from collaudit.core.data.rule_study_result import ThresholdParts
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.runs import lowest_in_row, widened
from collaudit.core.rule_study.joint_plane import excess

_BLOCK_S, _TURN_S, _DRIFT_S = 1.0, 5.0, 20.0
#: Less clean time than this says nothing.
_LEAST_S = 20.0
#: The level is one that is sustained once in so long: a minute where there are ten of them.
_SELDOM_S, _OFTEN_S, _ENOUGH_S = 60.0, 20.0, 600.0
#: Samples this close to an interval of friction are part of a reversal.
_MARGIN_S = 0.2
#: Bins of position of one gear's ripple, rad (m), and of speed.
_BIN_RAD, _SPEED_BINS = 0.005, 16
_RIDGE = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class PartInputs:
    """One joint over time.

    Attributes:
        residual_nm, uncertainty_nm: (n,).
        clean: (n,) samples without contact at which the rule can fire.
        interval: (n,) samples at which friction is an interval.
        position_rad, velocity_rad_s: (n,) of the joint.
        gravity_nm, inertial_nm: (n,) parts of the model's torque.
        motion: (n, m) accelerations of all joints.
        noise: (n,) made up, like the white noise that the sensor leaves in the residual: what as much again would add.
        period_s: sample period, s.
    """

    residual_nm: FloatArray
    uncertainty_nm: FloatArray
    clean: BoolArray
    interval: BoolArray
    position_rad: FloatArray
    velocity_rad_s: FloatArray
    gravity_nm: FloatArray
    inertial_nm: FloatArray
    motion: FloatArray
    noise: FloatArray
    period_s: float


def threshold_parts(joint: PartInputs, n: int) -> ThresholdParts | None:
    """The causes of one joint's threshold; None with too little clean time."""
    seconds = float(np.count_nonzero(joint.clean)) * joint.period_s
    if seconds < _LEAST_S:
        return None
    every = _SELDOM_S if seconds >= _ENOUGH_S else _OFTEN_S
    residual = np.nan_to_num(joint.residual_nm)

    def level(left_nm: FloatArray, clean: BoolArray = joint.clean) -> float:
        return _seldom_level(left_nm, joint.uncertainty_nm, clean, n, joint.period_s, every)

    whole = level(residual)
    turns = (np.arange(residual.size) * joint.period_s // _TURN_S).astype(np.int64) % 2 == 0
    sliding = joint.clean & ~widened(joint.interval, round(_MARGIN_S / joint.period_s))
    explained = {
        "drift": _drift(residual, joint.clean, joint.period_s),
        "lag": _cross_fitted(residual, sliding, turns, _lag_columns(joint)),
        "model": _cross_fitted(residual, sliding, turns, _model_columns(joint)),
        "friction": _cross_binned(residual, sliding, turns, _speed_bins(joint.velocity_rad_s)),
        "ripple": _ripple(residual, sliding, turns, joint),
    }
    falls = {cause: whole - level(residual - part) for cause, part in explained.items()}
    falls["noise"] = level(residual + joint.noise) - whole
    falls["reversal"] = whole - level(residual, sliding)
    falls["rest"] = level(residual - sum(explained.values()), sliding)
    ranked = sorted(((cause, max(0.0, fall)) for cause, fall in falls.items()), key=lambda each: -each[1])
    return ThresholdParts(whole, dict(ranked))


def _seldom_level(
    residual: FloatArray, uncertainty: FloatArray, clean: BoolArray, n: int, period_s: float, every_s: float
) -> float:
    """The level that is sustained for n samples in one of so many seconds of clean time; at least 0."""
    lowest = lowest_in_row(excess(residual, uncertainty, clean), n)
    length = max(1, round(_BLOCK_S / period_s))
    if lowest.size == 0:
        return 0.0
    starts = np.arange(0, lowest.size, length)
    peaks = np.maximum.reduceat(lowest, starts)
    peaks = np.sort(peaks[np.isfinite(peaks)])[::-1]
    if peaks.size == 0:
        return 0.0
    return max(0.0, float(peaks[min(peaks.size - 1, int(peaks.size * _BLOCK_S / every_s))]))


def _drift(residual: FloatArray, clean: BoolArray, period_s: float) -> FloatArray:
    """(n,) mean of the clean residual around each sample."""
    half = round(0.5 * _DRIFT_S / period_s)
    total = np.concatenate(([0.0], np.cumsum(np.where(clean, residual, 0.0))))
    count = np.concatenate(([0], np.cumsum(clean)))
    at = np.arange(residual.size)
    high, low = np.minimum(at + half + 1, residual.size), np.maximum(at - half, 0)
    return np.asarray((total[high] - total[low]) / np.maximum(count[high] - count[low], 1))


def _lag_columns(joint: PartInputs) -> FloatArray:
    """(n, 1) what the residual would be if effort were a second later than the motion: the model's rate of change."""
    total: FloatArray = np.nan_to_num(joint.gravity_nm + joint.inertial_nm)
    return np.asarray(np.gradient(total, joint.period_s))[:, None]


def _model_columns(joint: PartInputs) -> FloatArray:
    """(n, m) torques that an error of the inertials leaves, to first order."""
    q = joint.position_rad
    own = [joint.gravity_nm, joint.inertial_nm, np.sin(q), np.cos(q), np.ones_like(q)]
    return np.asarray(np.nan_to_num(np.column_stack([*own, joint.motion])))


def _cross_fitted(residual: FloatArray, use: BoolArray, turns: BoolArray, columns: FloatArray) -> FloatArray:
    """(n,) least-squares prediction of each half of the time from the other."""
    out = np.zeros_like(residual)
    for half in (turns, ~turns):
        rows = use & half
        if np.count_nonzero(rows) <= 4 * columns.shape[1]:
            continue
        a = columns[rows]
        gram = a.T @ a
        gram += _RIDGE * np.diag(np.diag(gram) + 1e-12)
        out[~half] = columns[~half] @ np.linalg.lstsq(gram, a.T @ residual[rows], rcond=None)[0]
    return out


def _speed_bins(velocity: FloatArray) -> IntArray:
    """(n,) bin of speed and direction, even in the logarithm."""
    speed = np.clip(np.abs(np.nan_to_num(velocity)), 1e-3, None)
    step = np.log(max(float(speed.max()), 2e-3) / 1e-3) / _SPEED_BINS
    place = np.minimum((np.log(speed / 1e-3) / step).astype(np.int64), _SPEED_BINS - 1)
    return np.asarray(np.where(velocity < 0, place, place + _SPEED_BINS), dtype=np.int64)


def _ripple(residual: FloatArray, use: BoolArray, turns: BoolArray, joint: PartInputs) -> FloatArray:
    """(n,) what repeats with the position, less what goes slowly with it."""
    q = np.nan_to_num(joint.position_rad)
    place = ((q - q.min()) / _BIN_RAD).astype(np.int64)
    wide = place // 40
    fast = residual - _cross_binned(residual, use, turns, wide)
    side = np.where(np.nan_to_num(joint.velocity_rad_s) < 0, 0, 1)
    return _cross_binned(fast, use, turns, 2 * place + side)


def _cross_binned(residual: FloatArray, use: BoolArray, turns: BoolArray, bins: IntArray) -> FloatArray:
    """(n,) mean of the other half of the time in each bin, drawn to 0 where few turns speak for it."""
    out = np.zeros_like(residual)
    size = int(bins.max(initial=0)) + 1
    for half in (turns, ~turns):
        rows = use & half
        count = np.bincount(bins[rows], minlength=size)
        total = np.bincount(bins[rows], residual[rows], minlength=size)
        out[~half] = (total / (count + 5.0))[bins[~half]]
    return out
