"""Load-dependent friction and gear ripple that are used in the residual: only what time left out confirms.

An error of the inertials looks like friction of the load for as long as loads and directions happen to go together.
So the slope is taken beside such errors (a gain, gravity over the joint's angle, any law of speed), has to stand four
standard errors from zero, errors alike over stretches of time, and has to lessen the residual of blocks left out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from collaudit.core.data.friction_result import FrictionCorrection, LoadFriction, RippleWave
from collaudit.core.findings import Finding, fact
from collaudit.core.friction.friction_model import load_torque
from collaudit.core.friction.gear.section_ripple import strongest_wave
from collaudit.core.friction.motion_points import Settled
from collaudit.core.friction.slopes import any_law, held_out_slopes, jackknifed
from collaudit.core.numeric.arrays import FloatArray, IntArray
from collaudit.core.numeric.stats import STANDARD_ERRORS_95
from collaudit.core.torque_table.block_sums import estimate, products_of, solutions

_STRETCH_S, _FOLDS = 4.0, 5
_FEWEST_STRETCHES = 10
_MOST_SAMPLES = 60_000
#: Standard errors that the slope must lie from zero.
_SURE = 4.0
#: Share of the residual's RMS that the load must take away on blocks left out.
_WORTH = 0.005
#: Speeds at which the load that the law has seen is kept.
_SPEEDS = 8
_LEAST_SPAN = 0.5  # of friction's mean: a smaller span of loads shows nothing


def joint_correction(parts: Sequence[Settled]) -> FrictionCorrection | None:
    """Corrections of one joint from its settled samples, one entry a log; None where nothing is shown."""
    step = max(1, sum(p.time_s.size for p in parts) // _MOST_SAMPLES)
    stretch, count = [], 0
    for part in parts:
        _, label = np.unique(np.floor(part.time_s[::step] / _STRETCH_S), return_inverse=True)
        stretch.append(label + count)
        count += int(label.max()) + 1
    if count < _FEWEST_STRETCHES:
        return None
    data, cluster = _joined(parts, step), np.concatenate(stretch).astype(np.int64)
    fold = cluster % _FOLDS
    before = float(np.sqrt(np.mean(data.residual**2)))
    waves, left = ripple_waves(data.position, np.sign(data.friction), data.residual, cluster, fold)
    data = replace(data, residual=left)
    load = _load_friction(data, cluster, fold)
    if load is not None:
        left = left - load_torque(load, data.load, np.sign(data.friction) * data.speed)
    if load is None and not waves:
        return None
    return FrictionCorrection(load, waves, before, float(np.sqrt(np.mean(left**2))))


def _load_friction(data: Settled, cluster: IntArray, fold: IntArray) -> LoadFriction | None:
    low, high = (float(x) for x in np.quantile(data.load, [0.02, 0.98]))
    if high - low < _LEAST_SPAN * float(np.mean(np.abs(data.friction))):
        return None
    sign, held = np.sign(data.friction), np.clip(data.load, low, high)
    errors = np.column_stack([data.torque, np.cos(data.position), np.sin(data.position)])
    nuisance = np.column_stack([any_law(data.friction, data.speed, data.torque_rate), errors])
    column = sign * (held - float(held.mean()))
    found = jackknifed(column, data.residual, nuisance, cluster)
    if found is None:
        return None
    slope, (lower, upper) = found
    sd = 0.5 * ((upper or 0.0) - (lower or 0.0)) / STANDARD_ERRORS_95
    if not slope > _SURE * sd:
        return None
    speeds, usual = _usual_loads(data.speed, held)
    change = sign * (held - np.interp(data.speed, speeds, usual))
    without = held_out_slopes(column, data.residual, nuisance, fold)
    if not np.all(without > 0):
        return None
    after = data.residual - without[fold] * change
    gained = [_rms(after[fold == k]) < _rms(data.residual[fold == k]) for k in range(_FOLDS)]
    if sum(gained) < _FOLDS - 1 or _rms(after) > (1.0 - _WORTH) * _rms(data.residual):
        return None
    return LoadFriction(slope, sd, tuple(map(float, speeds)), tuple(map(float, usual)), (low, high))


def _usual_loads(speed: FloatArray, load: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Speeds, rising, and the mean load that came with each."""
    edges = np.unique(np.quantile(speed, np.linspace(0.0, 1.0, _SPEEDS + 1)))
    place = np.clip(np.searchsorted(edges, speed, side="right") - 1, 0, max(edges.size - 2, 0))
    count = np.maximum(np.bincount(place), 1)
    return np.bincount(place, weights=speed) / count, np.bincount(place, weights=load) / count


def _rms(x: FloatArray) -> float:
    return float(np.sqrt(np.mean(x**2)))


def _joined(parts: Sequence[Settled], step: int) -> Settled:
    """Every so many of the samples, without temperatures."""
    kept = [name for name in Settled.__slots__ if name != "temperature"]
    columns = {name: np.concatenate([getattr(part, name)[::step] for part in parts]) for name in kept}
    return Settled(**columns, temperature=None)


def correction_findings(corrections: Mapping[str, FrictionCorrection]) -> list[Finding]:
    """What the residual will be corrected by, one finding a joint and part."""
    findings = []
    for joint, found in corrections.items():
        gain = (
            f"the residual of settled motion falls from {found.rms_nm:.3g} to {found.held_out_rms_nm:.3g} N·m (RMS, "
            "on held-out time)"
        )
        if found.load is not None:
            half = STANDARD_ERRORS_95 * found.load.per_nm_sd
            text = (
                f"The friction of joint '{joint}' rises with the load on the gear by {found.load.per_nm:.2g} N·m per "
                f"N·m (± {half:.1g}), which the residual follows; {gain}."
            )
            findings.append(fact(text, joint=joint))
        if found.ripple:
            waves = ", ".join(f"{wave.cycles_per_turn:.0f}" for wave in found.ripple)
            text = f"Gear ripple of joint '{joint}' with {waves} cycles a turn is subtracted from the residual; {gain}."
            findings.append(fact(text, joint=joint))
    return findings


#: Slower waves have the shape of errors of the inertials, of cables and of contacts; gears are faster.
_FEWEST_CYCLES, _MOST_CYCLES = 40, 500
_MOST_WAVES = 4
#: Share of the residual's RMS that a wave must take away on blocks left out.
_WAVE_WORTH = 0.01
_LEAST_TRAVEL_RAD = 0.2
_LEAST_SAMPLES = 500


def ripple_waves(
    position_rad: FloatArray, direction: FloatArray, residual: FloatArray, cluster: IntArray, fold: IntArray
) -> tuple[tuple[RippleWave, ...], FloatArray]:
    """Waves one after the other, and what each block is left with by the waves fitted without it.

    Args:
        position_rad, direction, residual: (n,) settled samples; direction is the sign of the velocity.
        cluster: (n,) number of the stretch of time, within which errors are alike.
        fold: (n,) fold of that stretch, from 0 on, none without samples.
    """
    waves: list[RippleWave] = []
    left = residual
    if position_rad.size < _LEAST_SAMPLES or np.ptp(position_rad) < _LEAST_TRAVEL_RAD:
        return (), left
    fewest = max(_FEWEST_CYCLES, 4.0 * np.pi / np.ptp(position_rad))  # two cycles over the range
    for _ in range(_MOST_WAVES):
        found = strongest_wave(position_rad, left - left.mean(), direction < 0, fewest, _MOST_CYCLES)
        cycles = None if found is None else float(round(found))
        if cycles is None or any(cycles == wave.cycles_per_turn for wave in waves):
            break
        columns = _columns(position_rad, direction, cycles)
        sums = products_of(np.column_stack([columns, np.ones_like(left), left])[:, None], cluster)
        count = np.bincount(cluster).astype(np.float64)[:, None]
        by_fold = np.array([sums[np.unique(cluster[fold == k])].sum(axis=(0, 1)) for k in np.unique(fold)])
        without = solutions(by_fold.sum(axis=0) - by_fold, tuple(range(5)))[0]
        after = left - np.sum(columns * without[fold, :4], axis=1)
        better = [np.mean(after[fold == k] ** 2) < np.mean(left[fold == k] ** 2) for k in np.unique(fold)]
        if sum(better) < len(better) - 1 or np.mean(after**2) > (1.0 - _WAVE_WORTH) ** 2 * np.mean(left**2):
            break
        wave = estimate(sums, count, np.arange(5)[None], np.zeros(5))
        a, b, c, d = (float(x) for x in wave.value[:4])
        sd = float(np.sqrt(np.trace(wave.covariance[:4, :4]) / 2.0))
        waves.append(RippleWave(cycles, (a, b), (c, d), sd))
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


def _columns(position_rad: FloatArray, direction: FloatArray, cycles: float) -> FloatArray:
    """(n, 4) columns of a wave: the same both ways, then against the motion."""
    wave = np.column_stack([np.cos(cycles * position_rad), np.sin(cycles * position_rad)])
    return np.column_stack([wave, direction[:, None] * wave])
