"""A fitted friction law as a function of velocity."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import stdtrit as student_quantile

from collaudit.core.data.friction_result import FrictionCorrection, FrictionFit, LoadFriction, RippleWave
from collaudit.core.data.identification_result import Trend
from collaudit.core.friction.law_candidates import parameter_symbol
from collaudit.core.friction_laws.friction_law import FrictionLaw
from collaudit.core.friction_laws.law_registry import law_named
from collaudit.core.numeric.arrays import LARGEST, BoolArray, FloatArray
from collaudit.core.numeric.stats import STANDARD_ERRORS_95, median_of, robust_sd

#: Breakaway may exceed the friction at the slowest measured speed by this factor where it is not determined.
UNKNOWN_BREAKAWAY = 1.5
_STANDSTILL = 1e-9
_LEVEL = 0.975


@dataclass(frozen=True, slots=True)
class FrictionModel:
    """f(v) = sgn(v)·curve(|v|) of any law in :mod:`collaudit.core.friction_laws.law_registry`.

    Attributes:
        name: of the law.
        values: parameters by symbol, in the units of the fit.
        speed_range: slowest and fastest speed measured.
        breakaway_known: whether friction towards zero speed is determined.
        temperature_trend: how friction goes with the joint's temperature, where that is to be used.
        spread: how far its points determine the curve: covariance (k, k) of the parameters in their order, and
            Student's t of a 95 % interval; None where that is not known.
        load, ripple: what it is corrected by.
    """

    name: str
    values: Mapping[str, float]
    speed_range: tuple[float, float]
    breakaway_known: bool
    temperature_trend: Trend | None = None
    spread: tuple[FloatArray, float] | None = None
    load: LoadFriction | None = None
    ripple: tuple[RippleWave, ...] = ()

    @classmethod
    def of(cls, fit: FrictionFit) -> FrictionModel | None:
        """The law of a fit, or None when there is none."""
        if fit.model is None or fit.speed_range_rad_s is None:
            return None
        values = {parameter_symbol(key): value for key, value in fit.parameters.items()}
        breakaway_known = fit.identifiable and law_named(fit.model).breakaway
        spread = None
        if fit.covariance is not None:
            shared_offset = any(point.source == "model" for point in fit.points)
            freedom = max(1, fit.n_points - len(fit.parameters) - shared_offset)
            spread = np.asarray(fit.covariance), float(student_quantile(freedom, _LEVEL))
        return cls(fit.model, values, fit.speed_range_rad_s, breakaway_known, spread=spread)

    def torque(self, velocity: FloatArray) -> FloatArray:
        """Friction at each velocity (any shape), zero at zero velocity."""
        direction = np.sign(velocity)
        speed = np.maximum(np.abs(velocity), _STANDSTILL)
        return np.asarray(direction * law_named(self.name).curve(self.values, speed))

    def sliding(self, velocity: FloatArray, load_nm: FloatArray | None, heat_c: FloatArray | None) -> FloatArray:
        """(n,) steady friction by speed and, where the law goes with them and they are known, load and temperature.

        Args:
            velocity: (n,) of the joint.
            load_nm: (n,) size of the torque on the gear.
            heat_c: (n,) temperatures.
        """
        torque = self.torque(velocity)
        if self.load is not None and load_nm is not None:
            torque = torque + load_torque(self.load, load_nm, velocity)
        if self.temperature_trend is not None and heat_c is not None:
            torque = torque * temperature_share(self.temperature_trend, heat_c)
        return torque

    @property
    def hold(self) -> float:
        """Largest friction of a joint at rest or presliding: breakaway, or a stated factor above the slowest."""
        slow = self.speed_range[0]
        ends = np.array([_STANDSTILL, slow, -_STANDSTILL, -slow])
        towards_zero, at_slow = np.max(np.abs(self.torque(ends)).reshape(2, 2), axis=0)
        if self.breakaway_known:
            return float(max(towards_zero, at_slow))
        return UNKNOWN_BREAKAWAY * float(at_slow)


def unusable(fit: FrictionFit) -> str | None:
    """What keeps the parameters of a fit, read from a file, from being a curve; None where nothing does."""
    beyond = [key for key, value in fit.parameters.items() if not abs(value) <= LARGEST]
    if beyond:
        return f"{beyond[0]} is {fit.parameters[beyond[0]]:g}"
    law = FrictionModel.of(fit)
    if law is None:
        return None
    try:
        law.torque(np.array(law.speed_range))
    except KeyError as error:
        return f"the law {law.name} without its parameter {error.args[0]}"
    return None


def temperature_share(trend: Trend, temperature_c: FloatArray) -> FloatArray:
    """(n,) friction as a share of its law at (n,) temperatures; what is missing lies between its neighbours.

    A straight line over the temperatures it was fitted on, held at its ends beyond them.
    """
    level = 0.0 if trend.fit is None else trend.fit.level
    return np.asarray(1.0 + level + trend.per_unit * _from_the_mean(trend, temperature_c))


def temperature_doubt(trend: Trend, temperature_c: FloatArray) -> float:
    """The largest standard error that the line's slope leaves in the shares."""
    sd = 0.5 * ((trend.ci95[1] or 0.0) - (trend.ci95[0] or 0.0)) / STANDARD_ERRORS_95
    return sd * float(np.max(np.abs(_from_the_mean(trend, temperature_c)), initial=0.0))


def _from_the_mean(trend: Trend, temperature_c: FloatArray) -> FloatArray:
    """(n,) K that temperatures, held within those of the fit, are from its mean."""
    assert trend.fit is not None
    known, values = np.flatnonzero(np.isfinite(temperature_c)), temperature_c
    if known.size < temperature_c.size:
        values = np.interp(np.arange(temperature_c.size), known, temperature_c[known])
    return np.asarray(np.clip(values, trend.fit.lowest, trend.fit.highest) - trend.fit.mean)


def load_torque(load: LoadFriction, load_nm: FloatArray, velocity: FloatArray) -> FloatArray:
    """(n,) friction of the load beyond what the law has of it, signed as friction is.

    Args:
        load: what is known of it.
        load_nm: (n,) size of the torque on the gear.
        velocity: (n,) of the joint.
    """
    return np.asarray(np.sign(velocity) * load.per_nm * (np.clip(load_nm, *load.range_nm) - _usual(load, velocity)))


def load_doubt(load: LoadFriction, load_nm: FloatArray, velocity: FloatArray) -> FloatArray:
    """(n,) half width of its 95 % interval: the slope's error, and all that loads beyond those of the fit could add."""
    held = np.clip(load_nm, *load.range_nm)
    slope = STANDARD_ERRORS_95 * load.per_nm_sd * np.abs(held - _usual(load, velocity))
    return np.asarray(slope + load.per_nm * np.abs(load_nm - held))


def _usual(load: LoadFriction, velocity: FloatArray) -> FloatArray:
    return np.interp(np.abs(velocity), load.speeds_rad_s, load.usual_nm)


def corrected_laws(
    laws: Mapping[str, FrictionModel], corrections: Mapping[str, FrictionCorrection]
) -> dict[str, FrictionModel]:
    """The laws of all joints, those with a correction corrected."""
    out = dict(laws)
    for joint, found in corrections.items():
        if joint in out:
            out[joint] = replace(out[joint], load=found.load, ripple=found.ripple)
    return out


_STEP = 1e-4
#: Speeds at which the doubt above the fastest fitted one is computed; between them it is a straight line.
_SPEEDS_BEYOND = 200
#: Time, s, and strokes that tell how friction goes on above the fastest fitted speed.
_DETERMINED_S, _DETERMINED_STROKES = 2.0, 4


def extrapolation_doubt(law: FrictionModel, velocity: FloatArray) -> FloatArray:
    """(n,) half width of the 95 % interval of friction above the fastest fitted speed, N·m; 0 up to that speed.

    Two parts are added. Friction's growth beyond the range, |f(v) - f(v_max)|: no point says whether it goes on as the
    curve has it, stays, or doubles. And what the curve's own interval (first order in the parameters) grows by.

    Args:
        law: the fitted law.
        velocity: (n,) of the joint.
    """
    out, fastest = np.zeros(velocity.shape), law.speed_range[1]
    for way in (1.0, -1.0):
        with np.errstate(invalid="ignore"):
            rows = np.flatnonzero(way * velocity > fastest)
        if rows.size == 0:
            continue
        speed = np.abs(velocity[rows])
        seen = np.linspace(fastest, float(speed.max()), _SPEEDS_BEYOND)
        friction, half = law.torque(way * seen), half_width(law, way * seen)
        out[rows] = np.interp(speed, seen, np.abs(friction - friction[0]) + np.maximum(half - half[0], 0.0))
    return out


def scatter_beyond(
    law: FrictionModel, velocity: FloatArray, residual_nm: FloatArray, counts: BoolArray, period_s: float
) -> float:
    """What friction above the fastest fitted speed is off by in a log (95 %), N·m, from the bulk of its residual there.

    The median of the residual along the motion is the error of the extrapolated curve, its spread what varies. Less
    than half of the time that counts may be contact. Infinite where a few strokes, or little time, would have to tell.

    Args:
        law: the fitted law.
        velocity, residual_nm: (n,) of the joint.
        counts: (n,) samples that tell something.
        period_s: sample period, s.
    """
    with np.errstate(invalid="ignore"):
        beyond = np.abs(velocity) > law.speed_range[1]
    rows = np.flatnonzero(beyond & counts & np.isfinite(residual_nm))
    strokes = np.count_nonzero(np.diff(rows) > 1) + 1
    if rows.size * period_s < _DETERMINED_S or strokes < _DETERMINED_STROKES:
        return float("inf")
    along = residual_nm[rows] * np.sign(velocity[rows])
    middle = median_of(along)
    return abs(middle) + STANDARD_ERRORS_95 * robust_sd(along - middle)


def half_width(law: FrictionModel, velocity: FloatArray) -> FloatArray:
    """(n,) half width of the curve's 95 % interval by the delta method; 0 where the fit has no covariance.

    sd(v)² = g(v)ᵀ Σ g(v) with g the gradient of the curve with respect to the parameters, times Student's t
    for the points left over (one fewer when directions share an offset, as they may in points that rely on
    the robot model).
    """
    if law.spread is None or law.spread[0].shape[0] != len(law.values):
        return np.zeros(velocity.shape)
    covariance, t = law.spread
    gradient = curve_gradient(law_named(law.name), law.values, np.abs(velocity))
    variance = np.einsum("ni,ij,nj->n", gradient, covariance, gradient)
    return np.asarray(t * np.sqrt(np.maximum(variance, 0.0)))


def curve_gradient(law: FrictionLaw, values: Mapping[str, float], speed: FloatArray) -> FloatArray:
    """(n, k) by how much a law's curve at (n,) speeds grows with each parameter, by central differences."""
    gradient = np.empty((speed.size, len(values)))
    for k, (symbol, value) in enumerate(values.items()):
        step = _STEP * max(abs(value), 1e-3)
        ends = [law.curve({**values, symbol: value + sign * step}, speed) for sign in (1.0, -1.0)]
        gradient[:, k] = (ends[0] - ends[1]) / (2.0 * step)
    return gradient
