"""What friction goes with beside speed: running time, temperature, load on the gear; and gear ripple.

Each is compared at equal speeds. At a judged log's temperatures the laws follow them. Load and ripple correct the
residual where time left out confirms them: an error of the inertials looks like friction of the load for as long as
loads and directions happen to go together. So that slope is taken beside such errors (a gain, gravity over the joint's
angle, any law of speed), has to stand four standard errors from zero, errors alike over stretches of time, and has to
lessen the residual of blocks left out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from collaudit.core.data.friction_result import FrictionCorrection, LoadFriction
from collaudit.core.data.identification_result import Bounds, FrictionVariation, Trend, TrendFit
from collaudit.core.data.joint_log import UniformSeries
from collaudit.core.findings import Finding, fact
from collaudit.core.friction.friction_model import FrictionModel, load_torque
from collaudit.core.friction.gear_ripple import gear_ripple
from collaudit.core.friction.motion_points import Settled
from collaudit.core.numeric.arrays import FloatArray, IntArray
from collaudit.core.numeric.stats import STANDARD_ERRORS_95
from collaudit.core.torque_table.block_sums import BlockSums, solutions

Against = Literal["time", "temperature", "load"]
_MIN_RUN_MIN = 1.0
_MIN_KELVIN = 2.0
_MIN_LOAD = 0.5  # of friction's mean: a smaller span of loads shows nothing
_MOST_SAMPLES = 60_000
_NEAR_K = 1.0  # beyond the fit's temperatures and not worth a word
_ALONG = "there is too little motion at equal speeds; what went along with the speeds is in the law"
_BLOCK_S = 2.0
_KNOTS = 8
_TOGETHER = 4  # neighbouring blocks err alike
_LEAST_OWN = 0.01  # of the column's standard deviation, to be separated from a law
#: Corrections are told from stretches so long, so many at least, and held out by so many folds.
_STRETCH_S, _FEWEST_STRETCHES, _FOLDS = 4.0, 10, 5
#: Standard errors that a term must lie from zero, beside what time left out says.
_SURE = 4.0
#: Share of the residual's RMS that a term must take away on blocks left out.
_WORTH = 0.005
#: Speeds at which the load that the law has seen is kept.
_SPEEDS = 8
#: Share of friction per unit with its interval, and a point of the line: the mean of the other, and what is off there.
Slope = tuple[float, Bounds, float, float]


def joint_variation(name: str, left: Settled) -> FrictionVariation:
    """Friction of one joint against time, temperature and load.

    Args:
        name: of the log.
        left: the joint's settled motion in it.
    """
    thin = slice(None, None, max(1, left.time_s.size // _MOST_SAMPLES))
    time_s, residual, friction = left.time_s[thin], left.residual[thin], left.friction[thin]
    beside = any_law(friction, left.speed[thin], left.torque_rate[thin])
    trends, undetermined = list[Trend](), list[str]()
    asked: list[tuple[Against, FloatArray, FloatArray, float, str]] = [
        ("time", time_s / 60.0, friction, _MIN_RUN_MIN, "min"),
        ("load", left.load[thin], np.sign(friction), _MIN_LOAD * float(np.mean(np.abs(friction))), "N·m"),
    ]
    if left.temperature is not None:
        asked.insert(1, ("temperature", left.temperature[thin], friction, _MIN_KELVIN, "K"))
    for what, against, goes, least, unit in asked:
        low, high = float(against.min()), float(against.max())
        found = friction_slope(time_s, residual, goes, beside, against) if high - low >= least else None
        if found is not None:
            fit = TrendFit(low, high, *found[2:]) if what == "temperature" else None
            trends.append(Trend(what, *found[:2], high - low, name, fit))
        else:
            why = f"it moved by {high - low:.2g} {unit} only" if high - low < least else _ALONG
            undetermined.append(f"change with {what}: {why}")
    return FrictionVariation(tuple(trends), tuple(undetermined))


def of_logs(parts: Sequence[FrictionVariation]) -> FrictionVariation:
    """Friction variation of one joint over several logs."""
    untold = dict.fromkeys(text for part in parts for text in part.untold)
    return FrictionVariation(tuple(trend for part in parts for trend in part.trends), tuple(untold))


def laws_at_temperature(
    laws: Mapping[str, FrictionModel], variation: Mapping[str, FrictionVariation], series: UniformSeries
) -> tuple[dict[str, FrictionModel], list[Finding]]:
    """Laws that follow the log's temperatures, and findings about that.

    Args:
        laws: friction by joint.
        variation: what the friction file knows; of several logs the trend with the narrowest interval counts.
        series: the log to be judged.
    """
    out = dict(laws)
    findings: list[Finding] = []
    unknown: list[str] = []
    for joint, law in laws.items():
        trend = _temperature_trend(variation.get(joint))
        if trend is None:
            continue
        heat = None if series.temperature_c is None else series.temperature_c[:, series.column(joint)]
        if heat is None or not np.isfinite(heat).any():
            unknown.append(joint)
            continue
        out[joint] = replace(law, temperature_trend=trend)
        findings += _temperature_findings(joint, trend, heat[np.isfinite(heat)])
    if unknown:
        names = ", ".join(f"'{joint}'" for joint in unknown)
        text = (
            f"The friction file knows how the friction of {names} goes with temperature, and this log has no "
            "temperature of it: friction was taken as calibrated."
        )
        findings.append(fact(text))
    return out, findings


def _temperature_trend(found: FrictionVariation | None) -> Trend | None:
    """The best known trend with temperature of one joint; None where none is shown, or its place is not on file."""
    shown = [t for t in (found.trends if found is not None else ()) if t.against == "temperature" and t.shown and t.fit]
    return min(shown, key=lambda t: (t.ci95[1] or 0.0) - (t.ci95[0] or 0.0), default=None)


def _temperature_findings(joint: str, trend: Trend, heat: FloatArray) -> list[Finding]:
    assert trend.fit is not None
    low, high = trend.fit.lowest, trend.fit.highest
    here = f"{heat.min():.1f} to {heat.max():.1f} °C"
    least, most = (100 * (end or 0.0) for end in trend.ci95)
    text = (
        f"The friction of joint '{joint}' is taken at its temperature, {here}: in the log it was fitted on it changes "
        f"by {100 * trend.per_unit:.2g} % a kelvin (95 %: {least:.2g} to {most:.2g} %, over {trend.span:.2g} K)."
    )
    findings = [fact(text, joint=joint)]
    beyond = float(np.mean((heat < low - _NEAR_K) | (heat > high + _NEAR_K)))
    if beyond > 0:
        text = (
            f"Joint '{joint}' was at {here}, for {100 * beyond:.0f} % of the log outside the {low:.1f} to "
            f"{high:.1f} °C at which its friction was fitted: there, friction of the nearer end is used."
        )
        findings.append(Finding("evidence-range", "warning", text, joint=joint))
    return findings


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
    if high - low < _MIN_LOAD * float(np.mean(np.abs(data.friction))):
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
