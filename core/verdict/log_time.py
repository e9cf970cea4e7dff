"""What is lost of the time of a log, and when its joints moved: moving, at rest, or unknown.

Lost time was motion unless the joint rested at one place before and after it. What the verdict says of coverage and of
what would have been noticed reads this alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil

import numpy as np
from numpy.typing import NDArray

from collaudit.core.data.signals import State
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.detection.detector_run import DetectorRun
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.parallel import by_name
from collaudit.core.numeric.runs import covered, marked, range_exceeds, run_bounds, widened
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.prepare.quiet_level import STILL_TRAVEL

_STANDING_RAD_S = 1e-3
#: A joint that gets no further in this time than it would at that speed dithers, s.
_DITHER_S = 0.5
_STANDING_TRAVEL = _STANDING_RAD_S * _DITHER_S
#: Faster than this a joint whose friction is known only as a range is moving, not standing: it was not judged in full.
_CREEPING_RAD_S = 0.03


@dataclass(frozen=True, slots=True, eq=False)
class LogTime:
    """What a pass takes for known of the time of a log.

    Attributes:
        lost: (n,) samples without a row, or without a measurement of a watched joint: for a pass they are gaps.
        moving: by joint the samples (n,) at which it moved while it was watched, or may have moved while that is lost.
        position_rad: (n, j) positions of all joints of the model, held where a row is lost.
        state: (n, j) codes of :class:`State`, with what is lost of any joint, and what settles next to it, on top.
        off_grid_s: lost time that has no sample on the grid, s.
    """

    lost: BoolArray
    moving: dict[str, BoolArray]
    position_rad: FloatArray
    state: NDArray[np.int8]
    off_grid_s: float


def log_time(prepared: Prepared, run: DetectorRun, watched: Sequence[str]) -> LogTime:
    """What is lost of a log, and when it moved: what is lost was motion unless its ends prove rest.

    A row that lacks one watched joint's measurement is, for a pass, as good as no row. What the other joints show there
    still alarms: the states that they are judged by stay as they are.

    Args:
        prepared: the log.
        run: what its judged joints were judged by.
        watched: those whose residual is judged, and that no finding forbids judging.
    """
    series, state = prepared.judged_series, run.detected.state
    recorded = covered(series.segments, series.time_s.size)
    unmeasured = np.zeros(recorded.size, dtype=np.bool_)
    for j in map(series.column, watched):
        unmeasured |= state[:, j] == State.NOT_A_NUMBER
        if series.effort is not None:
            unmeasured |= ~np.isfinite(series.effort[:, j])
    unmeasured &= recorded
    lost = unmeasured | ~recorded
    if unmeasured.any():
        margin = max(series.settling, ceil(run.residual.balance.kernel.settle_s / series.period_s))
        state = np.where(widened(unmeasured, margin)[:, None], np.maximum(state, np.int8(State.EDGE)), state)
        state[unmeasured] = State.NOT_A_NUMBER
    position = prepared.series.position_rad
    if not recorded.all():
        position = position[np.maximum.accumulate(np.where(recorded, np.arange(recorded.size), 0))]

    def of_joint(joint: str) -> BoolArray:
        own, judged = position[:, prepared.series.column(joint)], run.detected.state[:, series.column(joint)]
        moving = known_motion(series, joint, own, judged)
        return np.asarray(moving | (_may_have_moved(lost, own, moving) & (judged != State.NOT_WATCHED)))

    return LogTime(lost, by_name(of_joint, series.joint_names), position, state, series.off_grid_s)


def known_motion(series: UniformSeries, joint: str, position: FloatArray, state: NDArray[np.int8]) -> BoolArray:
    """(n,) samples at which a joint is known to have moved while it was watched; its positions are held (n,)."""
    width = max(3, round(_DITHER_S / series.period_s))
    if np.ptp(position) < STILL_TRAVEL:
        return np.zeros(position.size, dtype=np.bool_)  # as everywhere: it never moves
    speed = np.abs(series.velocity_rad_s[:, series.column(joint)])
    moving = range_exceeds(position, width, _STANDING_TRAVEL) & (speed > _STANDING_RAD_S)
    moving &= (state != State.FRICTION_INTERVAL) | (speed > _CREEPING_RAD_S)
    return np.asarray(moving & (state != State.NOT_WATCHED))


def _may_have_moved(lost: BoolArray, position: FloatArray, moving: BoolArray) -> BoolArray:
    """(n,) lost samples but those of stretches before and after which the joint rested at the same place."""
    starts, stops = run_bounds(lost)
    before, after = np.maximum(starts - 1, 0), np.minimum(stops, lost.size - 1)
    travel = STILL_TRAVEL if np.ptp(position) < STILL_TRAVEL else _STANDING_TRAVEL
    rested = (np.abs(position[after] - position[before]) <= travel) & ~moving[before] & ~moving[after]
    rested &= (starts > 0) & (stops < lost.size)
    return marked(starts[~rested], stops[~rested], lost.size)
