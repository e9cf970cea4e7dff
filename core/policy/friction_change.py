"""Change of a joint's friction, with its uncertainty: between two fits, or against the nights of a store."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit as student_quantile

from collaudit.core.data.friction_result import FrictionFit
from collaudit.core.friction_laws.law_registry import law_named
from collaudit.core.history.joint_series import reading_of
from collaudit.core.history.log_record import LogRecord
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.stats import NORMAL_QUANTILE_975
from collaudit.core.policy.baseline import BaselineLog, level_key

_SPEEDS = 9
#: Friction is compared with so many of the earliest logs: a mean that moved along would hide wear.
_FIRST_LOGS = 10
#: So many tell how much the level scatters from log to log.
_LEAST_LOGS = 3


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


def change_over_nights(joint: str, tonight: LogRecord, before: Sequence[BaselineLog]) -> FrictionChange | str:
    """How much a joint's friction differs from the earliest logs of its history; or why nothing can be told.

    Levels are compared at one speed. The 95 % interval is that of the difference between one more log and the mean of
    n ≥ 3 logs: Student's t with n − 1 degrees of freedom times sqrt(max(s, se)² + s²/n), s their scatter and se the
    log's own error; with fewer logs the normal quantile times both errors. Errors of the friction laws are added
    where the logs were judged with different ones; of one law they cancel.

    Args:
        joint: its name.
        tonight: record of the log in question.
        before: its history.
    """
    item = next((item for item in tonight.joints if item.joint == joint), None)
    now = None if item is None else reading_of(tonight, item, "friction", item.law_speed_rad_s)
    if item is None or now is None:
        return "this log does not tell the level of its friction"
    alike = [log.levels[level_key(item)] for log in before if level_key(item) in log.levels]
    if not alike:
        return "the history has no level of its friction at this speed"
    first = alike[:_FIRST_LOGS]
    mean = sum(level.value for level in first) / len(first)
    if mean <= 0:
        return "friction of the history does not oppose the motion"
    other = [level.basis_se for level in first if level.basis != now.basis]
    variance = max(other) ** 2 + now.basis_se**2 if other else 0.0
    if len(first) < _LEAST_LOGS:
        quantile = NORMAL_QUANTILE_975
        variance += now.se**2 + sum(level.se**2 for level in first) / len(first) ** 2
    else:
        scatter = sum((level.value - mean) ** 2 for level in first) / (len(first) - 1)
        quantile = float(student_quantile(len(first) - 1, 0.975))
        variance += max(scatter, now.se**2) + scatter / len(first)
    half, change = quantile * math.sqrt(variance), now.value - mean
    return FrictionChange(change / mean, (change - half) / mean, (change + half) / mean)
