"""What was judged and what was not: seconds by joint and reason, and the longer stretches."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from collaudit.core.data.audit_result import Coverage, JointCoverage, NotJudgedSpan
from collaudit.core.data.signals import State
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.detection.rule_settings import Watch
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.parallel import by_name
from collaudit.core.numeric.runs import range_exceeds
from collaudit.core.prepare.quiet_level import STILL_TRAVEL

_LISTED_SPAN_S = 0.5
_LISTED_SPANS = 200
_STANDING_RAD_S = 1e-3
#: A joint that gets no further in this time than it would at that speed dithers, s.
_DITHER_S = 0.5
#: Faster than this a joint whose friction is known only as a range is moving, not standing: it was not judged in full.
_CREEPING_RAD_S = 0.03


def joints_in_motion(series: UniformSeries, state: NDArray[np.int8]) -> dict[str, BoolArray]:
    """By joint the samples (n,) at which it moved while it was watched; states are (n, j)."""

    def of_joint(joint: str) -> BoolArray:
        j = series.column(joint)
        speed = np.abs(travelling_velocity(series, j))
        moving = speed > _STANDING_RAD_S
        moving &= (state[:, j] != State.FRICTION_INTERVAL) | (speed > _CREEPING_RAD_S)
        moving &= state[:, j] != State.NOT_WATCHED
        return moving

    return by_name(of_joint, series.joint_names)


def measure_coverage(
    series: UniformSeries, state: NDArray[np.int8], watch: Mapping[str, Watch], moving: Mapping[str, BoolArray]
) -> Coverage:
    """Add up the states (n, j) of every joint; ``moving``: of :func:`joints_in_motion`.

    ``moving_s`` counts recorded time in motion that was to be judged, motion below the speeds at which
    friction was measured included. Time in state FRICTION_INTERVAL is listed apart, since a joint that
    rests hides torque below its breakaway friction and is never "clean"; so is time in which the joint was
    not watched, with the reason.
    """
    recorded = sum(len(s) for s in series.segments)

    def of_joint(joint: str) -> JointCoverage:
        return _joint(series, state[:, series.column(joint)], moving[joint], watch[joint])

    joints = by_name(of_joint, series.joint_names)
    count = series.time_s.size
    unrecorded_s = (count - recorded) * series.period_s
    beyond_s = float(series.time_s[-1] - series.time_s[0]) - (count - 1) * series.period_s  # long gaps, cut on the grid
    if beyond_s > 0.5 * series.period_s:
        unrecorded_s += beyond_s
    return Coverage(recorded * series.period_s, unrecorded_s, joints)


def _joint(series: UniformSeries, state: NDArray[np.int8], moving: BoolArray, watch: Watch) -> JointCoverage:
    period = series.period_s
    starts = np.concatenate(([0], np.flatnonzero(state[1:] != state[:-1]) + 1))
    stops, states = np.append(starts[1:], state.size), state[starts]
    count = np.zeros(len(State), dtype=np.int64)
    np.add.at(count, states, stops - starts)
    return JointCoverage(
        watched=watch.watched,
        why=watch.why,
        moving_s=float(np.count_nonzero(moving)) * period,
        judged_s=float(count[State.JUDGED]) * period,
        standing_s=float(count[State.FRICTION_INTERVAL]) * period,
        not_judged_s={
            code.code: float(count[code]) * period for code in State if code > State.FRICTION_INTERVAL and count[code]
        },
        spans=_spans(series.time_s, (starts, stops, states), period),
    )


def travelling_velocity(series: UniformSeries, j: int) -> FloatArray:
    """(n,) velocity of a joint, 0 where it only dithers about its place, as by a step of its encoder."""
    position = series.position_rad[:, j]
    width = max(3, round(_DITHER_S / series.period_s))
    if np.nanmax(position, initial=-np.inf) - np.nanmin(position, initial=np.inf) < STILL_TRAVEL:
        return np.zeros(position.size)  # as everywhere: it never moves
    known = position if np.isfinite(position.sum()) else np.where(np.isfinite(position), position, 0.0)
    travels = range_exceeds(known, width, _STANDING_RAD_S * _DITHER_S)
    return np.where(travels, series.velocity_rad_s[:, j], 0.0)


def _spans(
    time_s: FloatArray, runs: tuple[IntArray, IntArray, NDArray[np.int8]], period_s: float
) -> tuple[NotJudgedSpan, ...]:
    """The longest stretches not judged, in time order; runs of one state: starts, stops, states."""
    starts, stops, states = runs
    listed = np.flatnonzero((states > State.FRICTION_INTERVAL) & ((stops - starts) * period_s >= _LISTED_SPAN_S))
    listed = listed[np.argsort(states[listed], kind="stable")]
    spans = [
        NotJudgedSpan(float(time_s[starts[k]]), float(time_s[stops[k] - 1] + period_s), State(int(states[k])).code)
        for k in listed
    ]
    longest = sorted(spans, key=lambda s: s.start_s - s.end_s)[:_LISTED_SPANS]
    return tuple(sorted(longest, key=lambda s: s.start_s))
