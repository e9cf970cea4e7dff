"""Harmonics of the residual over a joint's position: found on most of the time, kept where the rest confirms them."""

from __future__ import annotations

import numpy as np

from collaudit.core.data.friction_correction import RippleWave
from collaudit.core.friction.friction_variation import wave_sums
from collaudit.core.numeric.arrays import FloatArray, IntArray

#: Slower waves have the shape of errors of the inertials, of cables and of contacts; gears are faster.
_FEWEST_CYCLES, _MOST_CYCLES = 40, 500
_MOST_WAVES = 4
#: Share of the residual's RMS that a wave must take away on blocks left out.
_WORTH = 0.01
_SPECTRUM_SAMPLES = 20_000
_LEAST_TRAVEL_RAD = 0.2
_LEAST_SAMPLES = 500


def ripple_waves(
    position_rad: FloatArray, direction: FloatArray, residual: FloatArray, cluster: IntArray, fold: IntArray
) -> tuple[tuple[RippleWave, ...], FloatArray]:
    """Waves one after the other, and what each block is left with by the waves fitted without it.

    Args:
        position_rad, direction, residual: (n,) settled samples; direction is the sign of the velocity.
        cluster: (n,) number of the stretch of time, within which errors are alike.
        fold: (n,) fold of that stretch.
    """
    waves: list[RippleWave] = []
    left = residual
    if position_rad.size < _LEAST_SAMPLES or np.ptp(position_rad) < _LEAST_TRAVEL_RAD:
        return (), left
    for _ in range(_MOST_WAVES):
        cycles = _strongest(position_rad, left - left.mean())
        if cycles is None or any(cycles == wave.cycles_per_turn for wave in waves):
            break
        columns = _columns(position_rad, direction, cycles)
        after = np.empty_like(left)
        for k in np.unique(fold):
            rest = fold != k
            after[~rest] = left[~rest] - columns[~rest] @ _fit(columns[rest], left[rest])[:4]
        better = [np.mean(after[fold == k] ** 2) < np.mean(left[fold == k] ** 2) for k in np.unique(fold)]
        if sum(better) < len(better) - 1 or np.mean(after**2) > (1.0 - _WORTH) ** 2 * np.mean(left**2):
            break
        a, b, c, d = (float(x) for x in _fit(columns, left)[:4])
        waves.append(RippleWave(cycles, (a, b), (c, d), _amplitude_sd(columns, left, cluster)))
        left = after
    return tuple(waves), left


def ripple_torque(waves: tuple[RippleWave, ...], position_rad: FloatArray, velocity: FloatArray) -> FloatArray:
    """(n,) torque of the waves, N·m; at rest only the part that is the same both ways."""
    out = np.zeros(position_rad.shape)
    direction = np.sign(velocity)
    for wave in waves:
        angle = wave.cycles_per_turn * position_rad
        out += (wave.same_nm[0] + wave.against_nm[0] * direction) * np.cos(angle)
        out += (wave.same_nm[1] + wave.against_nm[1] * direction) * np.sin(angle)
    return out


def _strongest(position_rad: FloatArray, residual: FloatArray) -> float | None:
    """Whole cycles a turn with the largest amplitude, of those with two cycles over the range at least."""
    step = max(1, position_rad.size // _SPECTRUM_SAMPLES)
    q, r = position_rad[::step], residual[::step]
    lowest = max(_FEWEST_CYCLES, int(np.ceil(4.0 * np.pi / np.ptp(q))))
    if lowest >= _MOST_CYCLES:
        return None
    cycles = np.arange(lowest, _MOST_CYCLES + 1)
    return float(cycles[int(np.argmax(np.abs(wave_sums(q, r, cycles))))])


def _columns(position_rad: FloatArray, direction: FloatArray, cycles: float) -> FloatArray:
    """(n, 6): the four columns of a wave, and the mean and mean friction beside them."""
    wave = np.column_stack([np.cos(cycles * position_rad), np.sin(cycles * position_rad)])
    return np.column_stack([wave, direction[:, None] * wave])


def _fit(columns: FloatArray, target: FloatArray) -> FloatArray:
    """Coefficients beside a mean, which is the model's error and not the wave's."""
    design = np.column_stack([columns, np.ones(columns.shape[0])])
    return np.asarray(np.linalg.lstsq(design, target, rcond=None)[0])


def _amplitude_sd(columns: FloatArray, target: FloatArray, cluster: IntArray) -> float:
    """Standard error of a wave's amplitude, errors alike within a stretch (sandwich estimator)."""
    inverse = np.linalg.pinv(columns.T @ columns)
    error = target - target.mean() - columns @ (inverse @ (columns.T @ (target - target.mean())))
    count = int(cluster.max()) + 1
    score = np.stack([np.bincount(cluster, weights=error * x, minlength=count) for x in columns.T], axis=1)
    covariance = inverse @ (score.T @ score) @ inverse
    return float(np.sqrt(max(np.trace(covariance), 0.0) / 2.0))
