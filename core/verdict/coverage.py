"""What was judged and what was not: seconds by joint and reason, and the longer stretches.

What a verdict does not cover: kinds of contact, gaps, joints not watched, time not judged, hidden torque. Lost time was
motion unless the joint rested at one place before and after it; what would have been noticed reads the same.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import ceil

import numpy as np
from numpy.typing import NDArray

from collaudit.core.data.audit_result import Coverage, JointCoverage, NotJudgedSpan
from collaudit.core.data.joint_log import UniformSeries
from collaudit.core.data.sensitivity_result import FOREARM, TOOL, Sensitivity, listed, place_text
from collaudit.core.data.signals import State, reason_text
from collaudit.core.detection.detector_run import DetectorRun
from collaudit.core.detection.rule_settings import Watch
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import (
    BoolArray,
    FloatArray,
    IntArray,
    covered,
    equal_runs,
    marked,
    range_exceeds,
    run_bounds,
    widened,
)
from collaudit.core.numeric.parallel import by_name
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


_LISTED_SPAN_S = 0.5
_LISTED_SPANS = 200


def measure_coverage(
    series: UniformSeries, state: NDArray[np.int8], watch: Mapping[str, Watch], time: LogTime
) -> Coverage:
    """Add up the states (n, j) of every joint; ``time``: of :func:`log_time`.

    ``moving_s`` counts time in motion that was to be judged, lost time included, and motion below the speeds at which
    friction was measured. Time in state FRICTION_INTERVAL is listed apart, since a joint that rests hides torque below
    its breakaway friction and is never "clean"; so is time in which the joint was not watched, with the reason.
    """
    recorded = sum(len(s) for s in series.segments)
    unrecorded = series.time_s.size - recorded

    def of_joint(joint: str) -> JointCoverage:
        column, period = state[:, series.column(joint)], series.period_s
        starts, stops = equal_runs(column)
        count = np.zeros(len(State), dtype=np.int64)
        np.add.at(count, column[starts], stops - starts)
        unjudged = [code for code in State if code > State.FRICTION_INTERVAL and count[code]]
        return JointCoverage(
            watched=watch[joint].watched,
            why=watch[joint].why,
            moving_s=float(np.count_nonzero(time.moving[joint])) * period,
            judged_s=float(count[State.JUDGED]) * period,
            standing_s=float(count[State.FRICTION_INTERVAL]) * period,
            not_judged_s={code.code: float(count[code]) * period for code in unjudged},
            spans=_spans(series.time_s, (starts, stops, column[starts]), period),
        )

    joints = by_name(of_joint, series.joint_names)
    missing = int(np.count_nonzero(time.lost)) - unrecorded
    gaps_s = unrecorded * series.period_s + time.off_grid_s
    return Coverage(recorded * series.period_s, gaps_s, joints, missing * series.period_s)


def too_much_lost(coverage: Coverage, min_coverage: float) -> bool:
    """Whether more of the log is lost than a policy allows; it asks for this share, 0 to 1."""
    return coverage.lost_s > (1.0 - min_coverage) * coverage.whole_s


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


#: Time that is worth saying, and that next to gaps and ends, which every log has.
_WORTH_SAYING_S, _WORTH_SAYING_OF_EDGES_S = 0.1, 1.0
#: Share of the directions that is worth saying: fewer cross the axes of all joints in any pose.
_WORTH_SAYING_OF_DIRECTIONS = 0.05
#: Computed efforts with some noise look like those of an arm that its model describes well.
_NOT_STATED = (
    "Nothing states that the efforts are measured ([log] effort_kind): contact does not show in efforts that the "
    "controller computes from its own model."
)


def exclusions(
    coverage: Coverage,
    sensitivity: Sensitivity,
    findings: Iterable[Finding] = (),
    units: Mapping[str, str] | None = None,
    effort_stated: bool = True,
    left_out: Sequence[str] = (),
) -> tuple[str, ...]:
    """One sentence for each kind of contact, time or joint that the verdict does not cover.

    Args:
        coverage: seconds by joint and reason.
        sensitivity: of the watched joints and of the arm.
        findings: of the log and its detection; those that exclude a kind of contact are said first.
        units: by joint, of what its drive exerts; N·m where absent.
        effort_stated: whether ``[log] effort_kind`` says what the efforts are.
        left_out: joints of the arm that ``[robot] joints`` does not name.
    """
    out = list(dict.fromkeys(finding.text for finding in findings if finding.excludes))
    if coverage.gaps_s > 0:
        out.append(f"Gaps in the log: {seconds_text(coverage.gaps_s)}.")
    away = [*left_out, *(joint for joint, cover in coverage.joints.items() if not cover.watched)]
    if away:
        out.append(f"Joints not watched: {', '.join(away)}.")
    out += [*_missed(sensitivity), *_not_judged(coverage), *_hidden(sensitivity, coverage.whole_s, units or {})]
    return tuple(out) if effort_stated else (*out, _NOT_STATED)


def _not_judged(coverage: Coverage) -> list[str]:
    """By reason, longest first."""
    watched = {joint: cover for joint, cover in coverage.joints.items() if cover.watched}
    total: dict[str, float] = {}
    for cover in watched.values():
        for reason, seconds in cover.not_judged_s.items():
            total[reason] = max(total.get(reason, 0.0), seconds)
    out = []
    for reason in sorted(total, key=lambda r: (-total[r], r)):
        least = _WORTH_SAYING_OF_EDGES_S if State.of(reason) is State.EDGE else _WORTH_SAYING_S
        joints = {joint: cover.not_judged_s.get(reason, 0.0) for joint, cover in watched.items()}
        said = {joint: seconds for joint, seconds in joints.items() if seconds >= least}
        if said and State.of(reason) is not State.GAP:
            out.append(f"Not judged ({reason_text(reason)}): {by_joint(said, len(watched))}.")
    return out


def _missed(sensitivity: Sensitivity) -> list[str]:
    """Directions from which what is asked for would not have alarmed, or that no watched joint feels.

    Where it would have alarmed from none, the verdict says so by itself.
    """
    missed = [
        f"From {100 * (1.0 - force.asked.directions):.0f} % of the directions {force.asked.force_n:.3g} N at "
        f"{place_text(force)} would not have alarmed."
        for force in sensitivity.forces
        if force.asked is not None and 0.0 < force.asked.directions <= 1.0 - _WORTH_SAYING_OF_DIRECTIONS
    ]
    unfelt = [
        f"From {100 * force.unfelt:.0f} % of the directions a force at {place_text(force)} loads no watched joint."
        for force in sensitivity.forces
        if force.unfelt >= _WORTH_SAYING_OF_DIRECTIONS and force.asked is None and force.kind in (TOOL, FOREARM)
    ]
    return missed + unfelt


def _hidden(sensitivity: Sensitivity, whole_s: float, units: Mapping[str, str]) -> list[str]:
    """Time in which what is asked for would not have alarmed: forces, then torques."""
    where = "at rest, in slow motion, just after a reversal, beyond the fitted speeds or not judged"
    forces = [
        f"{force.asked.force_n:.3g} N at {place_text(force)} for {seconds_text(force.asked.unnoticed_s)}"
        for force in reversed(sensitivity.forces)
        if force.asked is not None and force.asked.unnoticed_s >= _WORTH_SAYING_S
    ]
    torques = [
        f"{s.asked.torque_nm:.3g} {units.get(joint, 'N·m')} on {joint} for {seconds_text(s.asked.unnoticed_s)}"
        for joint, s in sorted(sensitivity.joints.items())
        if s.asked is not None and s.asked.unnoticed_s >= _WORTH_SAYING_S
    ]
    parts = [*forces, *torques]
    return [f"Not noticed {where}: {listed(parts)} of {seconds_text(whole_s)}."] if parts else []


def by_joint(seconds: Mapping[str, float], watched: int) -> str:
    """Seconds of each joint; said once where all watched joints have the same."""
    texts = {joint: seconds_text(value) for joint, value in seconds.items()}
    if len(texts) == watched > 1 and len(set(texts.values())) == 1:
        return f"all {watched} joints {next(iter(texts.values()))}"
    return ", ".join(f"{joint} {text}" for joint, text in texts.items())


def seconds_text(seconds: float) -> str:
    """A time in the unit a reader thinks in."""
    if seconds < 119.95:
        return f"{seconds:.3g} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 120 else f"{minutes // 60} h {minutes % 60} min"
