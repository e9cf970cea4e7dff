"""Load-dependent friction and gear ripple that are used in the residual: only what time left out confirms.

An error of the inertials looks like friction of the load for as long as loads and directions happen to go together.
So the slope is taken beside such errors (a gain, gravity over the joint's angle, any law of speed), has to stand four
standard errors from zero, errors alike over stretches of time, and has to lessen the residual of blocks left out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from collaudit.core.data.friction_result import FrictionCorrection, LoadFriction
from collaudit.core.findings import Finding, fact
from collaudit.core.friction.friction_model import load_torque
from collaudit.core.friction.friction_variation import any_law, jackknifed
from collaudit.core.friction.gear_ripple import gear_ripple
from collaudit.core.friction.motion_points import Settled
from collaudit.core.numeric.arrays import FloatArray, IntArray
from collaudit.core.numeric.stats import STANDARD_ERRORS_95
from collaudit.core.torque_table.block_sums import solutions

_STRETCH_S, _FOLDS = 4.0, 5
_FEWEST_STRETCHES = 10
_MOST_SAMPLES = 60_000
#: Standard errors that a term must lie from zero, beside what time left out says.
_SURE = 4.0
#: Share of the residual's RMS that a term must take away on blocks left out.
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
    fold, left = cluster % _FOLDS, data.residual
    ripple = gear_ripple(data.position, left, cluster, (data.friction < 0).astype(np.int64), _SURE)
    if ripple is not None:
        columns = ripple.columns(data.position, (data.friction < 0).astype(np.int64))
        after = _held_out(columns, columns, np.ones((left.size, 1)), left, fold)
        ripple, left = (None, left) if after is None else (ripple, after)
    load = _load_friction(replace(data, residual=left), cluster, fold)
    if load is None and ripple is None:
        return None
    if load is not None:
        left = left - load_torque(load, data.load, np.sign(data.friction) * data.speed)
    return FrictionCorrection(load, () if ripple is None else ripple.waves, _rms(data.residual), _rms(left))


def _held_out(
    columns: FloatArray, used: FloatArray, others: FloatArray, residual: FloatArray, fold: IntArray
) -> FloatArray | None:
    """(n,) what each fold is left with by a term as fitted without it; None where that is not clearly less.

    Args:
        columns: (n, k) of the term in the fit; used: (n, k) those taken off.
        others: (n, o) what may be in the residual besides.
        residual, fold: (n,).
    """
    every = np.column_stack([columns, others, residual])
    own = np.array([rows.T @ rows for rows in (every[fold == k] for k in range(_FOLDS))])
    without = solutions(own.sum(axis=0) - own, tuple(range(every.shape[1] - 1)))[0][:, : columns.shape[1]]
    after = residual - np.sum(used * without[fold], axis=1)
    better = [_rms(after[fold == k]) < _rms(residual[fold == k]) for k in range(_FOLDS)]
    return after if sum(better) >= _FOLDS - 1 and _rms(after) <= (1.0 - _WORTH) * _rms(residual) else None


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
    if _held_out(column[:, None], change[:, None], nuisance, data.residual, fold) is None:
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
