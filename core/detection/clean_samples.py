"""Samples of a joint that were judged and lie away from its collisions, and how large its residual is there."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from collaudit.core.data.audit_result import ResidualStats
from collaudit.core.data.signals import Signals, State
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.numeric.arrays import BoolArray
from collaudit.core.numeric.stats import quantile_of

_AROUND_EVENT_S = 0.5


def clean_samples(signals: Signals, collision_times: Sequence[tuple[float, float]], joint: str) -> BoolArray:
    """(n,) samples of a joint that were judged and lie half a second away from its collisions.

    Args:
        signals: of an audit.
        collision_times: start and end of the joint's collisions, s.
        joint: its name.
    """
    k = signals.joint_names.index(joint)
    clean: BoolArray = np.asarray(signals.state[:, k] == State.JUDGED)
    for start, end in collision_times:
        a, b = np.searchsorted(signals.time_s, [start - _AROUND_EVENT_S, end + _AROUND_EVENT_S])
        clean[a:b] = False
    return clean


def residual_stats(
    series: UniformSeries, signals: Signals, collision_times: Sequence[tuple[float, float]], joint: str
) -> ResidualStats:
    """Level of one joint's residual over what was judged, and over its clean samples, at its temperature.

    Args:
        series: the judged joints.
        signals, collision_times, joint: as of :func:`clean_samples`.
    """
    k = signals.joint_names.index(joint)
    judged = signals.state[:, k] == State.JUDGED
    seconds = float(np.count_nonzero(judged)) * series.period_s
    residual = signals.residual_nm[:, k]
    mean_c, range_c = series.mean_temperature_c(joint), series.temperature_range_c(joint)
    x = residual[judged]
    if x.size == 0:
        return ResidualStats(None, None, None, None, seconds, temperature_c=mean_c, temperature_range_c=range_c)
    np.abs(x, out=x)
    mean, rms, most = float(np.mean(x)), float(np.sqrt(np.mean(x**2))), float(np.max(x))
    p99 = quantile_of(x, 0.99)
    x = residual[clean_samples(signals, collision_times, joint)]
    np.abs(x, out=x)
    return ResidualStats(
        mean_abs_nm=mean,
        rms_nm=rms,
        p99_nm=p99,
        max_abs_nm=most,
        judged_s=seconds,
        clean_mean_abs_nm=float(np.mean(x)) if x.size else None,
        clean_s=float(x.size) * series.period_s,
        temperature_c=mean_c,
        temperature_range_c=range_c,
    )
