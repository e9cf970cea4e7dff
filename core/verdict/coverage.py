"""What was judged and what was not: seconds by joint and reason, and the longer stretches."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from collaudit.core.data.audit_result import Coverage, JointCoverage, NotJudgedSpan
from collaudit.core.data.signals import State
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.detection.watch import Watch
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.runs import run_bounds
from collaudit.core.numeric.sliding_extremes import centred_range

_LISTED_SPAN_S = 0.5
_LISTED_SPANS = 200
_STANDING_RAD_S = 1e-3
#: A joint that gets no further in this time than it would at that speed dithers, s.
_DITHER_S = 0.5
#: Faster than this a joint whose friction is known only as a range is moving, not standing: it was not judged in full.
_CREEPING_RAD_S = 0.03


def measure_coverage(series: UniformSeries, state: NDArray[np.int8], watch: Mapping[str, Watch]) -> Coverage:
    """Add up the states of every joint.

    ``moving_s`` counts recorded time in motion that was to be judged, motion below the speeds at which
    friction was measured included. Time in state FRICTION_INTERVAL is listed apart, since a joint that
    rests hides torque below its breakaway friction and is never "clean"; so is time in which the joint was
    not watched, with the reason.
    """
    recorded = sum(len(s) for s in series.segments)
    joints = {
        joint: _joint(series, state[:, j], travelling_velocity(series, j), watch[joint])
        for j, joint in enumerate(series.joint_names)
    }
    count = series.time_s.size
    unrecorded_s = (count - recorded) * series.period_s
    beyond_s = float(series.time_s[-1] - series.time_s[0]) - (count - 1) * series.period_s  # long gaps, cut on the grid
    if beyond_s > 0.5 * series.period_s:
        unrecorded_s += beyond_s
    return Coverage(recorded * series.period_s, unrecorded_s, joints)


def _joint(series: UniformSeries, state: NDArray[np.int8], velocity: FloatArray, watch: Watch) -> JointCoverage:
    period = series.period_s
    count = np.bincount(state, minlength=len(State))
    moving = moving_samples(velocity, state)
    return JointCoverage(
        watched=watch.watched,
        why=watch.why,
        moving_s=float(np.count_nonzero(moving)) * period,
        judged_s=float(count[State.JUDGED]) * period,
        standing_s=float(count[State.FRICTION_INTERVAL]) * period,
        not_judged_s={
            code.code: float(count[code]) * period for code in State if code > State.FRICTION_INTERVAL and count[code]
        },
        spans=_spans(series.time_s, state, period),
    )


def travelling_velocity(series: UniformSeries, j: int) -> FloatArray:
    """(n,) velocity of a joint, 0 where it only dithers about its place, as by a step of its encoder."""
    position = series.position_rad[:, j]
    width = max(3, round(_DITHER_S / series.period_s))
    known = np.where(np.isfinite(position), position, 0.0)
    way = centred_range(known, width)
    return np.where(way <= _STANDING_RAD_S * _DITHER_S, 0.0, series.velocity_rad_s[:, j])


def moving_samples(velocity: FloatArray, state: NDArray[np.int8]) -> BoolArray:
    """(n,) samples at which a joint with these velocities and states moved while it was watched."""
    standing = np.where(state == State.FRICTION_INTERVAL, _CREEPING_RAD_S, _STANDING_RAD_S)
    return np.asarray((np.abs(np.nan_to_num(velocity)) > standing) & (state != State.NOT_WATCHED))


def _spans(time_s: FloatArray, state: NDArray[np.int8], period_s: float) -> tuple[NotJudgedSpan, ...]:
    """The longest stretches not judged, in time order."""
    spans = []
    for code in State:
        if code <= State.FRICTION_INTERVAL:
            continue
        starts, stops = run_bounds(state == code)
        for a, b in zip(starts, stops, strict=True):
            if (b - a) * period_s >= _LISTED_SPAN_S:
                spans.append(NotJudgedSpan(float(time_s[a]), float(time_s[b - 1] + period_s), code.code))
    longest = sorted(spans, key=lambda s: s.start_s - s.end_s)[:_LISTED_SPANS]
    return tuple(sorted(longest, key=lambda s: s.start_s))
