"""Change of a joint's friction between two fits, with its uncertainty."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from collaudit.core.data.friction_result import FrictionFit
from collaudit.core.friction_laws.law_registry import law_named
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.stats import NORMAL_QUANTILE_975

_SPEEDS = 9


@dataclass(frozen=True, slots=True)
class FrictionChange:
    """Mean friction over the speeds that both fits measured: relative change and its 95 % interval, as shares."""

    share: float
    low: float
    high: float


def friction_change(before: FrictionFit, after: FrictionFit) -> FrictionChange | str:
    """How much the mean of a joint's friction curve changed; or why nothing can be told.

    The mean runs over both directions and evenly over the speeds that both fits cover. Its standard error follows from
    each fit's covariance to first order, J Σ Jᵀ with J by central differences, and both are taken as independent.

    Args:
        before, after: fits of the same joint, in the same unit.
    """
    if before.parameters == after.parameters and before.model == after.model and before.model is not None:
        return FrictionChange(0.0, 0.0, 0.0)
    if before.model is None or after.model is None:
        return "friction was not fitted"
    if before.effort_unit != after.effort_unit:
        return f"friction in {before.effort_unit} and in {after.effort_unit} cannot be compared"
    ranges = (before.speed_range_rad_s, after.speed_range_rad_s)
    if ranges[0] is None or ranges[1] is None:
        return "a fit does not say at which speeds it was measured"
    low, high = max(ranges[0][0], ranges[1][0]), min(ranges[0][1], ranges[1][1])
    if low > high:
        return "the two fits share no speed"
    speeds = np.linspace(low, high, _SPEEDS)
    (old, old_se), (new, new_se) = (_level(fit, speeds) for fit in (before, after))
    if old_se is None or new_se is None:
        return "a fit states no uncertainty"
    if old <= 0:
        return "friction of the baseline does not oppose the motion"
    half = NORMAL_QUANTILE_975 * float(np.hypot(old_se, new_se))
    return FrictionChange((new - old) / old, (new - old - half) / old, (new - old + half) / old)


def _level(fit: FrictionFit, speeds: FloatArray) -> tuple[float, float | None]:
    """Mean friction over speeds and directions, and its standard error."""
    assert fit.model is not None
    values = fit.parameters
    mean = _mean(fit.model, values, speeds)
    if fit.covariance is None:
        return mean, None
    names = list(values)
    covariance = np.asarray(fit.covariance, dtype=float)
    if covariance.shape != (len(names), len(names)) or not np.isfinite(covariance).all():
        return mean, None
    slope = np.zeros(len(names))
    for k, name in enumerate(names):
        step = max(1e-4 * abs(values[name]), 1e-7)
        up, down = ({**values, name: values[name] + sign * step} for sign in (1, -1))
        slope[k] = (_mean(fit.model, up, speeds) - _mean(fit.model, down, speeds)) / (2 * step)
    variance = float(slope @ covariance @ slope)
    return mean, float(np.sqrt(variance)) if variance > 0 else None


def _mean(model: str, parameters: dict[str, float], speeds: FloatArray) -> float:
    values = {name.partition("_")[0]: value for name, value in parameters.items()}
    law = law_named(model)
    curves = [law.curve(values, speeds, np.full(speeds.shape, direction)) for direction in (1.0, -1.0)]
    return float(np.mean(curves))
