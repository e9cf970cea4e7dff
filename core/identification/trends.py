"""What moves while a log runs: friction warming up, and ripple of the gear over position."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from collaudit.core.findings import Finding
from collaudit.core.friction.model import FrictionModel
from collaudit.core.identification.motion_points import settled_residual
from collaudit.core.prepare import Prepared
from collaudit.core.result import FrictionFit
from collaudit.core.series import FloatArray

_BLOCK_S = 2.0
_MIN_BLOCKS = 12
_MIN_RUN_S = 60.0
_MOST_CYCLES = 400  # a turn
_NOTEWORTHY = 0.1


@dataclass(frozen=True, slots=True)
class WarmUp:
    """Change of friction with running time: share of friction a minute and its interval."""

    per_minute: float
    ci95: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Ripple:
    """The strongest harmonic of the residual over a joint's position.

    Attributes:
        amplitude_nm: its amplitude.
        cycles_per_turn: its frequency; m^-1 times 2 pi for a prismatic joint.
        explained: share of the settled residual's variance that it explains.
    """

    amplitude_nm: float
    cycles_per_turn: float
    explained: float


def warm_up(time_s: FloatArray, residual: FloatArray, friction: FloatArray) -> WarmUp | None:
    """Slope of residual/friction over time, from means over blocks of two seconds (t interval).

    Args:
        time_s, residual, friction: (n,) settled samples: time, torque that is left, friction as fitted, signed.
    """
    if time_s.size == 0 or np.ptp(time_s) < _MIN_RUN_S:
        return None
    ids, label = np.unique(np.floor(time_s / _BLOCK_S), return_inverse=True)
    if ids.size < _MIN_BLOCKS:
        return None
    level = np.bincount(label, weights=residual * friction) / np.bincount(label, weights=friction**2)
    weight = np.bincount(label, weights=friction**2)
    clock = np.bincount(label, weights=time_s) / np.bincount(label)
    centre = float(np.sum(weight * clock) / weight.sum())
    mean = float(np.sum(weight * level) / weight.sum())
    power = float(np.sum(weight * (clock - centre) ** 2))
    slope = float(np.sum(weight * (clock - centre) * (level - mean))) / power
    score = weight * (clock - centre) * (level - mean - slope * (clock - centre))
    # neighbouring blocks err alike: sums of four blocks are taken as one error
    together = np.add.reduceat(score, np.arange(0, score.size, 4))
    from scipy.stats import t

    se = float(np.sqrt(np.sum(together**2) * together.size / max(1, together.size - 2))) / power
    half = float(t.ppf(0.975, max(1, together.size - 2))) * se
    return WarmUp(60.0 * slope, (60.0 * (slope - half), 60.0 * (slope + half)))


def ripple(position_rad: FloatArray, residual: FloatArray) -> Ripple | None:
    """The strongest harmonic over position, by projection onto sine and cosine at whole cycles a turn."""
    if position_rad.size < 500 or np.ptp(position_rad) < 0.2:
        return None
    step = max(1, position_rad.size // 20_000)
    q, r = position_rad[::step], residual[::step] - residual.mean()
    lowest = int(np.ceil(4 * np.pi / np.ptp(q)))  # two cycles over the range at least
    power = float(np.mean(r**2))
    if power <= 0 or lowest >= _MOST_CYCLES:
        return None
    cycles = np.arange(lowest, _MOST_CYCLES + 1)
    wave = np.array([np.mean(r * np.exp(-1j * n * q)) for n in cycles])
    best = int(np.argmax(np.abs(wave)))
    amplitude = 2.0 * float(np.abs(wave[best]))
    return Ripple(amplitude, float(cycles[best]), min(1.0, 0.5 * amplitude**2 / power))


def trend_findings(prepared: Prepared, fits: Mapping[str, FrictionFit]) -> list[Finding]:
    """Warm-up and ripple of every joint whose friction is known, where they are worth a word."""
    findings = []
    for joint, fit in fits.items():
        law = FrictionModel.of(fit)
        if law is None or joint not in prepared.judged or fit.effort_unit == "raw":
            continue
        left = settled_residual(prepared, joint, law)
        if left is None:
            continue
        time_s, position, residual, friction = left
        trend = warm_up(time_s, residual, friction)
        if trend is not None and (trend.ci95[0] > 0 or trend.ci95[1] < 0):
            low, high = (100 * x for x in trend.ci95)
            text = (
                f"The friction of joint '{joint}' changes with running time by {100 * trend.per_minute:.2g} % a minute "
                f"(95 %: {low:.2g} to {high:.2g} %)."
            )
            findings.append(Finding("friction-warm-up", "info", text, joint=joint))
        wave = ripple(position, residual)
        if wave is not None and wave.explained > _NOTEWORTHY:
            text = (
                f"A ripple of {wave.amplitude_nm:.2g} {fit.effort_unit} with {wave.cycles_per_turn:.0f} cycles a turn "
                f"explains {100 * wave.explained:.0f} % of what friction and model leave on joint '{joint}'."
            )
            findings.append(Finding("friction-ripple", "info", text, joint=joint))
    return findings
