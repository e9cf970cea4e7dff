"""What was judged and what was not: seconds by joint and reason, and the longer stretches.

What a verdict does not cover: kinds of contact, gaps, joints not watched, time not judged, hidden torque.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from collaudit.core.data.audit_result import Coverage, JointCoverage, NotJudgedSpan
from collaudit.core.data.sensitivity_result import FOREARM, TOOL, Sensitivity
from collaudit.core.data.signals import State, reason_text
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.detection.rule_settings import Watch
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.parallel import by_name
from collaudit.core.numeric.runs import equal_runs
from collaudit.core.verdict.log_time import LogTime
from collaudit.core.verdict.noticed_words import listed, place_text

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
        return _joint(series, state[:, series.column(joint)], time.moving[joint], watch[joint])

    joints = by_name(of_joint, series.joint_names)
    missing = int(np.count_nonzero(time.lost)) - unrecorded
    gaps_s = unrecorded * series.period_s + time.off_grid_s
    return Coverage(recorded * series.period_s, gaps_s, joints, missing * series.period_s)


def too_much_lost(coverage: Coverage, min_coverage: float) -> bool:
    """Whether more of the log is lost than a policy allows; it asks for this share, 0 to 1."""
    return coverage.lost_s > (1.0 - min_coverage) * coverage.whole_s


def _joint(series: UniformSeries, state: NDArray[np.int8], moving: BoolArray, watch: Watch) -> JointCoverage:
    period = series.period_s
    starts, stops = equal_runs(state)
    count = np.zeros(len(State), dtype=np.int64)
    np.add.at(count, state[starts], stops - starts)
    return JointCoverage(
        watched=watch.watched,
        why=watch.why,
        moving_s=float(np.count_nonzero(moving)) * period,
        judged_s=float(count[State.JUDGED]) * period,
        standing_s=float(count[State.FRICTION_INTERVAL]) * period,
        not_judged_s={
            code.code: float(count[code]) * period for code in State if code > State.FRICTION_INTERVAL and count[code]
        },
        spans=_spans(series.time_s, (starts, stops, state[starts]), period),
    )


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
