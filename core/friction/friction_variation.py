"""Friction variation: with running time, temperature and load on the gear, and over position."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from collaudit.core.data.identification_result import FrictionVariation, RippleFacts, Trend, TrendFit
from collaudit.core.findings import Finding, fact
from collaudit.core.friction.motion_points import Settled
from collaudit.core.friction.slopes import any_law, friction_slope, load_slope
from collaudit.core.numeric.arrays import FloatArray, IntArray
from collaudit.core.numeric.stats import quantile_of

_MIN_RUN_S = 60.0
_MIN_KELVIN = 2.0
_MIN_LOAD = 0.5  # of friction's mean: a smaller span of loads shows nothing
_MOST_CYCLES = 400  # a turn
_FINE_CYCLES = 16
_MOST_SAMPLES = 60_000
_ALONG = "there is too little motion at equal speeds; what went along with the speeds is in the law"


def ripple(position_rad: FloatArray, residual: FloatArray, log: str) -> RippleFacts | None:
    """The strongest harmonic over position, by projection onto sine and cosine at whole cycles a turn.

    Args:
        position_rad, residual: (n,) settled samples.
        log: its name.
    """
    if position_rad.size < 500 or np.ptp(position_rad) < 0.2:
        return None
    step = max(1, position_rad.size // 20_000)
    q, r = position_rad[::step], residual[::step] - residual.mean()
    lowest = int(np.ceil(4 * np.pi / np.ptp(q)))  # two cycles over the range at least
    power = float(np.mean(r**2))
    if power <= 0 or lowest >= _MOST_CYCLES:
        return None
    cycles = np.arange(lowest, _MOST_CYCLES + 1)
    best = int(np.argmax(np.abs(wave_sums(q, r, cycles))))
    amplitude = 2.0 * float(np.abs(np.mean(r * np.exp(-1j * cycles[best] * q))))
    return RippleFacts(amplitude, float(cycles[best]), min(1.0, 0.5 * amplitude**2 / power), log)


def wave_sums(position: FloatArray, values: FloatArray, cycles: IntArray) -> NDArray[np.complex128]:
    """Sums of values · exp(-i · cycle · position) for consecutive cycles, none skipped.

    exp(-i (a + b) q) = exp(-i a q) exp(-i b q): with a in steps of sixteen and b below, the sums are one product of
    matrices. Its rows are powers, each made of the one before: two exponentials a sample are computed in place of 400.
    """
    fine = np.empty((_FINE_CYCLES + 1, position.size), dtype=np.complex128)
    coarse = np.empty((-(-cycles.size // _FINE_CYCLES), position.size), dtype=np.complex128)
    fine[0], fine[1] = 1.0, np.exp(-1j * position)
    for k in range(2, _FINE_CYCLES + 1):
        np.multiply(fine[k - 1], fine[1], out=fine[k])
    coarse[0] = np.exp(-1j * cycles[0] * position) * values
    for k in range(1, coarse.shape[0]):
        np.multiply(coarse[k - 1], fine[-1], out=coarse[k])
    return np.asarray((coarse @ fine[:-1].T).ravel()[: cycles.size])


def joint_variation(name: str, left: Settled) -> FrictionVariation:
    """Friction of one joint against time, temperature, load and position.

    Args:
        name: of the log.
        left: the joint's settled motion in it.
    """
    data = (left.time_s, left.residual, left.friction)
    thin = slice(None, None, max(1, left.time_s.size // _MOST_SAMPLES))
    nuisance = any_law(left.friction[thin], left.speed[thin], left.torque_rate[thin])
    compared = (left.time_s[thin], left.residual[thin], left.friction[thin], nuisance)
    trends, undetermined = [], []
    minutes = float(np.ptp(left.time_s)) / 60.0
    found = friction_slope(*compared, left.time_s[thin] / 60.0) if 60.0 * minutes >= _MIN_RUN_S else None
    if found is not None:
        trends.append(Trend("time", found.per_unit, found.ci95, minutes, name))
    else:
        short = 60.0 * minutes < _MIN_RUN_S
        why = f"{60 * minutes:.0f} s of motion are too short" if short else _ALONG
        undetermined.append(f"change with running time: {why}")
    if left.temperature is not None:
        span = float(np.ptp(left.temperature))
        found = friction_slope(*compared, left.temperature[thin]) if span >= _MIN_KELVIN else None
        if found is not None:
            low, high = float(left.temperature.min()), float(left.temperature.max())
            fit = TrendFit(low, high, found.mean, found.level)
            trends.append(Trend("temperature", found.per_unit, found.ci95, span, name, fit))
        else:
            why = f"it moved by {span:.2g} K only" if span < _MIN_KELVIN else _ALONG
            undetermined.append(f"change with temperature: {why}")
    span = quantile_of(left.load, 0.95) - quantile_of(left.load, 0.05)
    enough = span >= _MIN_LOAD * float(np.mean(np.abs(left.friction)))
    loaded = load_slope(*data, left.load) if enough else None
    if loaded is not None:
        trends.append(Trend("load", *loaded, span, name))
    else:
        undetermined.append(f"change with load: gravity and inertia load the joint too evenly (over {span:.2g} N·m)")
    wave = ripple(left.position, left.residual, name)
    return FrictionVariation(tuple(trends), () if wave is None else (wave,), tuple(undetermined))


def merged(parts: Sequence[dict[str, FrictionVariation]]) -> dict[str, FrictionVariation]:
    """Friction variation of several logs, joint by joint."""
    out: dict[str, FrictionVariation] = {}
    for part in parts:
        for joint, found in part.items():
            before = out.get(joint, FrictionVariation((), (), ()))
            undetermined = tuple(dict.fromkeys((*before.untold, *found.untold)))
            trends, ripples = (*before.trends, *found.trends), (*before.ripple, *found.ripple)
            out[joint] = FrictionVariation(trends, ripples, undetermined)
    return out


def friction_variation_findings(joints: Mapping[str, FrictionVariation]) -> list[Finding]:
    """Trends with time and temperature whose interval excludes zero.

    Load and ripple are said where they are shown well enough to be used: core/friction/gear/correction_fit.py.
    """
    findings = []
    for joint, found in joints.items():
        for trend in found.trends:
            if trend.shown and trend.against in ("time", "temperature"):
                text = f"The friction of joint '{joint}' {trend_words(trend)}."
                findings.append(fact(text, joint=joint))
    return findings


def trend_words(trend: Trend) -> str:
    """A trend as the end of a sentence."""
    low, high = (x or 0.0 for x in trend.ci95)
    if trend.against == "load":
        return (
            f"rises with the load on the gear by {trend.per_unit:.2g} N·m per N·m (95 %: {low:.2g} to {high:.2g}, "
            f"over {trend.span:.2g} N·m of load)"
        )
    unit = "a minute of running" if trend.against == "time" else "a kelvin"
    return (
        f"changes by {100 * trend.per_unit:.2g} % {unit} (95 %: {100 * low:.2g} to {100 * high:.2g} %, "
        f"over {trend.span:.2g} {'min' if trend.against == 'time' else 'K'})"
    )
