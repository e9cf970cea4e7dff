"""A day's script as a measure: what an engineer with Pinocchio and an afternoon leaves on motion that was not fitted.

Joint by joint, one linear regression: the full rigid-body regressor, Coulomb, viscous and square-root friction, rotor
inertia and an offset, made robust by reweighting (Huber 1964). No priors, no choice of a model, no look at the log.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import butter, filtfilt

from collaudit.core.data.signals import Signals
from collaudit.core.errors import NotJudgedError
from collaudit.core.robot.robot_model import RobotModel

CUT_HZ, EVERY_S, MOVING_RAD_S, SHARE = 10.0, 0.008, 0.02, 0.6
_MARGIN, _ROUNDS, _RIDGE, _HUBER = 10, 6, 1e-3, 1.5


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """What the script sees of a log.

    Attributes:
        rows: (k,) rows of the signals that it uses.
        columns: (k, j, p) of each joint's regression.
        torque_nm: (k, j) measured, filtered.
        moving: (k, j) faster than :data:`MOVING_RAD_S`.
    """

    rows: np.ndarray
    columns: np.ndarray
    torque_nm: np.ndarray
    moving: np.ndarray

    def part(self, chosen: np.ndarray) -> Samples:
        """Some of the samples."""
        return Samples(self.rows[chosen], self.columns[chosen], self.torque_nm[chosen], self.moving[chosen])


def samples_of(signals: Signals, model: RobotModel) -> Samples:
    """Filter, differentiate twice, and set up the regression of every joint."""
    position, torque = np.asarray(signals.position_rad), np.asarray(signals.measured_nm)
    known = np.flatnonzero(np.isfinite(position).all(axis=1) & np.isfinite(torque).all(axis=1))
    if known.size < 2 * _MARGIN:
        raise NotJudgedError("no stretch of the log has the torque of every joint: the script cannot be fitted")
    period = float(np.median(np.diff(signals.time_s[known])))
    b, a = butter(2, min(CUT_HZ * 2 * period, 0.9))

    def smooth(values: np.ndarray) -> np.ndarray:
        return np.asarray(filtfilt(b, a, values, axis=0))

    q, torque = smooth(position[known]), smooth(torque[known])
    speed = np.gradient(q, period, axis=0)
    acceleration, speed = smooth(np.gradient(speed, period, axis=0)), smooth(speed)
    used = np.arange(_MARGIN, known.size - _MARGIN, max(1, round(EVERY_S / period)))
    q, v, a2 = q[used], speed[used], acceleration[used]
    rigid = model.torque_regressor(q, v, a2)
    moving = np.abs(v) > MOVING_RAD_S
    own = np.stack([np.sign(v) * moving, v, np.sign(v) * np.sqrt(np.abs(v)), a2, np.ones_like(v)], axis=2)
    return Samples(known[used], np.concatenate([rigid, own], axis=2), torque[used], moving)


def split(samples: Samples, share: float = SHARE) -> tuple[Samples, Samples]:
    """The first part, to fit, and the rest."""
    first = np.arange(samples.rows.size) < share * samples.rows.size
    return samples.part(first), samples.part(~first)


def left_over(fitted: Samples, judged: Samples) -> np.ndarray:
    """(k, j) N·m: what regressions of the one leave of the other's torque."""
    out = np.empty_like(judged.torque_nm)
    for j in range(out.shape[1]):
        scale = np.abs(np.concatenate([fitted.columns[:, j], judged.columns[:, j]])).max(axis=0) + 1e-9
        x = fitted.columns[:, j] / scale
        found = _robust(x, fitted.torque_nm[:, j])
        out[:, j] = judged.torque_nm[:, j] - judged.columns[:, j] / scale @ found
    return out


def _robust(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Iteratively reweighted least squares with a little ridge, for columns that say the same."""
    count = x.shape[1]
    ridge = _RIDGE * np.sqrt(len(x)) * np.eye(count)
    weight = np.ones(len(x))
    found = np.zeros(count)
    for _ in range(_ROUNDS):
        found = np.linalg.lstsq(np.r_[x * weight[:, None], ridge], np.r_[y * weight, np.zeros(count)], rcond=None)[0]
        error = np.abs(y - x @ found)
        weight = np.sqrt(1.0 / np.maximum(1.0, error / (_HUBER * 1.4826 * np.median(error) + 1e-9)))
    return found
