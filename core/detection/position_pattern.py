"""Residual that is a function of the joint's position: springs, cables, joints that give, or weights that are wrong.

Such torque comes again at every visit of the same place, as no collision does. The visits of each stretch of positions
are split into two halves by time; what the first half says of a position is held against the second. The mean of each
direction of motion is left aside, so that friction off its law is no pattern.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import ceil

import numpy as np
from numpy.typing import NDArray

from collaudit.core.data.signals import Signals, State
from collaudit.core.findings import Finding
from collaudit.core.friction.motion_points import Settled
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.parallel import by_name
from collaudit.core.numeric.stats import median_of, quantile_of

_BINS = 16
_VISIT_S = 1.0
_LEAST_SHARE = 0.4  # of the later half's variance between positions that the earlier half foretells
_LEAST_BINS = 5
_LEAST_RANGE_RAD = 0.05  # less is an arm that gives where someone leans on it, not a joint that visits places
_LEAST_VISITS = 2  # of a bin, in each half
_MOST_SAMPLES = 200_000  # that are looked at, evenly over a long log
_SAID, _DOUBTED = 0.25, 0.5  # amplitude, as a share of the threshold or of friction
_STRAIGHT = 0.8


@dataclass(frozen=True, slots=True)
class PositionPattern:
    """How a residual follows the position.

    Attributes:
        amplitude_nm: half of the spread between positions.
        share: of the later visits' variance that the earlier ones foretell.
        stiffness_nm_per_rad: slope, where a straight line explains the pattern; else None.
        low_rad, high_rad: where the residual is least and greatest.
    """

    amplitude_nm: float
    share: float
    stiffness_nm_per_rad: float | None
    low_rad: float
    high_rad: float


def position_pattern(
    time_s: FloatArray,
    position: FloatArray,
    residual: FloatArray,
    direction: NDArray[np.generic],
    there: BoolArray,
) -> PositionPattern | None:
    """The pattern of one joint, or None where there is none, or too little motion or too few visits to tell.

    Args:
        time_s, position, residual: (n,) samples.
        direction: (n,) sign of the motion.
        there: (n,) which samples count.
    """
    rows = np.flatnonzero(there)
    if rows.size < 2 * _BINS:
        return None
    rows = rows[:: ceil(rows.size / _MOST_SAMPLES)]
    place, residual, direction = position[rows], residual[rows], direction[rows]
    low, high = quantile_of(place, 0.005), quantile_of(place, 0.995)  # a few positions are no place that is visited
    if not high - low > _LEAST_RANGE_RAD:
        return None
    visit = np.floor(time_s[rows] / _VISIT_S).astype(np.int64)
    middle = float(np.median(visit))
    key = visit * _BINS + np.clip(((place - low) / (high - low) * _BINS).astype(np.int64), 0, _BINS - 1)
    for sign in (-1.0, 1.0):
        way = direction == sign
        if way.any():
            np.subtract(residual, median_of(residual[way]), out=residual, where=way)
    key, label = np.unique(key, return_inverse=True)
    mean = np.bincount(label, weights=residual) / np.bincount(label)
    of_bin, late = key % _BINS, key // _BINS > middle
    early_of, late_of = _by_bin(mean, of_bin, ~late), _by_bin(mean, of_bin, late)
    both = np.isfinite(early_of) & np.isfinite(late_of)
    if np.count_nonzero(both) < _LEAST_BINS:
        return None
    spread = float(np.sum((late_of[both] - late_of[both].mean()) ** 2))
    foretold = early_of[both] - early_of[both].mean()
    missed = float(np.sum((late_of[both] - late_of[both].mean() - foretold) ** 2))
    share = 1.0 - missed / spread if spread > 0 else 0.0
    if share < _LEAST_SHARE:
        return None
    shape, place = 0.5 * (early_of + late_of)[both], (low + (np.arange(_BINS) + 0.5) / _BINS * (high - low))[both]
    slope, straight = np.polyfit(place, shape, 1)[0], np.corrcoef(place, shape)[0, 1] ** 2
    return PositionPattern(
        amplitude_nm=0.5 * float(np.ptp(shape)),
        share=share,
        stiffness_nm_per_rad=float(slope) if straight >= _STRAIGHT else None,
        low_rad=float(place[np.argmin(shape)]),
        high_rad=float(place[np.argmax(shape)]),
    )


def _by_bin(mean: FloatArray, of_bin: IntArray, use: BoolArray) -> FloatArray:
    """(bins,) median over the visits of each bin; NaN where there are too few."""
    visits = (mean[use & (of_bin == b)] for b in range(_BINS))
    return np.array([median_of(one) if one.size >= _LEAST_VISITS else np.nan for one in visits])


def pattern_findings(signals: Signals, gamma_nm: Mapping[str, float]) -> list[Finding]:
    """Joints of a judged log whose residual follows the position, against their thresholds."""

    def of_joint(joint: str) -> list[Finding]:
        j = signals.joint_names.index(joint)
        position, residual, velocity = (
            x[:, j] for x in (signals.position_rad, signals.residual_nm, signals.velocity_rad_s)
        )
        there = (signals.state[:, j] == State.JUDGED) & np.isfinite(residual)
        way = (velocity > 0).view(np.int8) - (velocity < 0).view(np.int8)
        found = position_pattern(signals.time_s, position, residual, way, there)
        return _finding(joint, found, gamma_nm[joint], "the threshold")

    found = by_name(of_joint, [joint for joint in signals.joint_names if joint in gamma_nm])
    return [finding for its in found.values() for finding in its]


def settled_pattern_findings(joint: str, left: Settled) -> list[Finding]:
    """A joint of a fitted log whose torque beyond model and friction follows the position, against friction.

    Args:
        joint: its name.
        left: its settled motion.
    """
    there = np.ones(left.time_s.size, dtype=np.bool_)
    found = position_pattern(left.time_s, left.position, left.residual, np.sign(left.friction), there)
    return _finding(joint, found, float(np.mean(np.abs(left.friction))), "friction's mean")


def _finding(joint: str, found: PositionPattern | None, limit: float, of: str) -> list[Finding]:
    if found is None or found.amplitude_nm < _SAID * limit:
        return []
    text = (
        f"The residual of joint '{joint}' follows its position: ±{found.amplitude_nm:.2g} N·m ({of}: {limit:.2g}), "
        f"least at {found.low_rad:.2f} rad, greatest at {found.high_rad:.2f} rad; the pattern of the log's first half "
        f"explains {100 * found.share:.0f} % of that of the second."
    )
    if found.stiffness_nm_per_rad is not None:
        text += f" It resembles a spring of {found.stiffness_nm_per_rad:.2g} N·m/rad."
    severity = "warning" if found.amplitude_nm >= _DOUBTED * limit else "info"
    return [Finding("residual-position", severity, text, joint=joint)]  # type: ignore[arg-type]
