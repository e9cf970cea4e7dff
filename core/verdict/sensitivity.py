"""How little would have alarmed on a log: torque by joint and force along the arm, over time.

The push is played to the rule at moments of the log: the smallest that would have alarmed there is what is told.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.config.schema import Config
from collaudit.core.config.schema_judging import PUSH_S
from collaudit.core.data.sensitivity_result import (
    TOOL,
    AskedForce,
    AskedTorque,
    ForceLevel,
    ForceTime,
    JointSensitivity,
    NoticedForce,
    Sensitivity,
    TorqueLevel,
)
from collaudit.core.data.signals import State
from collaudit.core.detection.detector_run import DetectionInputs, DetectorRun
from collaudit.core.detection.rule_settings import known_limits, stated_by_joint
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray, blocks, lowest_in_row, run_bounds
from collaudit.core.numeric.filters import Kernel, gaussian_smoothed, window_reach
from collaudit.core.numeric.parallel import by_name
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.robot.arm_places import Place, RequiredForce, alarming_forces, arm_places, asked_forces
from collaudit.core.robot.robot_model import RobotModel
from collaudit.core.verdict.coverage import LogTime

#: Of a push less than this share of its height is not waited for in the detector's filter.
_LEAST_RESPONSE = 0.05
#: Samples that are looked at together.
_AT_ONCE = 1 << 18


@dataclass(frozen=True, slots=True, eq=False)
class Push:
    """A rectangular push as a detector shows it.

    Attributes:
        duration_s: of the push.
        response: (w,) share of its height that passes the detector's kernel, sample by sample.
        lead: samples of ``response`` before the push begins, of a kernel that runs both ways.
        n: persistence, samples.
    """

    duration_s: float
    response: FloatArray
    lead: int
    n: int

    @classmethod
    def of(cls, duration_s: float, kernel: Kernel, n: int, period_s: float, smoothed_s: float = 0.0) -> Push:
        """A push through a kernel, of the whole samples that fall into its duration at least.

        Args:
            duration_s: of the push.
            kernel: of the detector.
            n: persistence, samples.
            period_s: sample period, s.
            smoothed_s: standard deviation of the window by which the effort is smoothed besides; nothing passes an
                infinite one.
        """
        response, begin = kernel.push_response(int(duration_s / period_s + 1e-6), period_s)
        if np.isinf(smoothed_s):
            response = response[:0]
        elif smoothed_s > 0.0:
            deviation = smoothed_s / period_s
            response = gaussian_smoothed(np.pad(response, window_reach(deviation)), deviation)
            begin += window_reach(deviation)
        shown = np.flatnonzero(response > _LEAST_RESPONSE * response.max(initial=0.0))
        if not shown.size:
            return cls(duration_s, response[:0], 0, n)
        return cls(duration_s, response[shown[0] : shown[-1] + 1], begin - int(shown[0]), n)

    @property
    def alarms(self) -> bool:
        """Whether it can alarm at any height: no filter or persistence can be longer, no two samples further apart."""
        return self.response.size >= self.n

    def moments(self, mask: BoolArray, most: int) -> IntArray:
        """At most so many of the marked samples (n,), evenly spread, at which the whole push lies within the log."""
        fits = mask[: max(0, mask.size - (self.response.size - self.lead) + 1)]
        samples = np.flatnonzero(fits)
        samples = samples[samples >= self.lead]
        if samples.size <= most:
            return samples
        return np.asarray(samples[((np.arange(most) + 0.5) * samples.size / most).astype(np.int64)])


def noticed_torque(run: DetectorRun, j: int, push: Push, moments: IntArray) -> FloatArray:
    """(k,) smallest torque of one joint, N·m (N), that would have alarmed if it began at the moments (k,).

    A push of height h shows as h·g(t). It alarms where, for ``n`` samples in a row, that and the log's own residual r
    exceed the threshold, and besides the range of friction where it is known only as a range, since the torque may act
    against it: h·g > γ + hidden - r, and with +r for the other sign. The larger of the two counts. Infinite where no
    push would alarm: too short for filter and persistence, or not judged. The difference to other cycles
    counts where it notices less, and only where its reference rests on nights that passed.

    Args:
        run: residual, threshold, states.
        j: column.
        push: the push.
        moments: of :meth:`Push.moments`.
    """
    residual, gamma = run.residual.torque_nm[:, j], run.gamma_nm[:, j]
    out = np.empty(moments.size)
    for part in blocks(moments.size, max(1, _AT_ONCE // max(1, push.response.size))):
        rows = moments[part, None] + np.arange(-push.lead, push.response.size - push.lead)
        level, state = gamma[rows].astype(np.float64), run.detected.state[rows, j]
        if run.residual.hidden_nm is not None:
            level += run.residual.hidden_nm[rows, j]
        own = np.where(state == State.JUDGED, residual[rows], 0.0)
        unknown = (state > State.FRICTION_INTERVAL) | np.isnan(level)
        out[part] = _both_signs(np.where(unknown, np.inf, level), own, push)
        if run.cycles is not None and run.cycles.proven.any():
            its = run.cycles.signals
            known = run.cycles.proven[rows] & (state == State.JUDGED) & np.isfinite(its.torque_nm[rows, j])
            level = np.where(known, its.gamma_nm[rows, j], np.inf)
            beside = _both_signs(level, np.where(known, its.torque_nm[rows, j], 0.0), push)
            out[part] = np.minimum(out[part], beside)
    return out


def _both_signs(level_nm: FloatArray, own_nm: FloatArray, push: Push) -> FloatArray:
    """(k,) smallest height of a push of either sign on top of what is there (k, w)."""
    return np.maximum(_height(level_nm - own_nm, push), _height(level_nm + own_nm, push))


def _height(needed_nm: FloatArray, push: Push) -> FloatArray:
    """(k,) smallest height of a push that exceeds what is needed (k, w) for ``n`` samples in a row."""
    peaks = -lowest_in_row(-np.maximum(needed_nm, 0.0) / push.response, push.n)
    return peaks.min(axis=1) if peaks.shape[1] else np.full(len(needed_nm), np.inf)


#: Shares of the time at which the distribution is given, besides that which the policy asks for.
_TIME_SHARES = (0.5, 0.95)


@dataclass(frozen=True, slots=True, eq=False)
class Moments:
    """What the joints of an arm would have noticed at some moments of a log.

    Attributes:
        time_s: (k,) of the log.
        position_rad: (k, j) of all joints of the model.
        noticed_nm: (k, j) smallest torque of each that would have alarmed; infinite where none would.
        watched: (k, j) whether it was watched.
        spans_s: time that the moments stand for.
        lost_s: time besides, off the grid, in which nothing would have alarmed.
    """

    time_s: FloatArray
    position_rad: FloatArray
    noticed_nm: FloatArray
    watched: BoolArray
    spans_s: float
    lost_s: float


def noticed_forces(
    robot: RobotModel,
    places: Sequence[Place],
    counted: Moments,
    whole: Moments,
    asked: Mapping[str, RequiredForce],
    share: float,
) -> tuple[NoticedForce, ...]:
    """What force would have alarmed at each place.

    Args:
        robot: the arm.
        places: on it.
        counted: moments of the time that counts: in motion, of an arm that moved.
        whole: moments of all time, what is lost included.
        asked: force that must alarm, by place.
        share: of the time that counts, in which it must.

    Returns:
        One for each place before which a joint was watched at any of the moments, or at which a force is asked for.
    """
    out = []
    for place in places:
        watched: BoolArray = np.asarray(counted.watched.any(axis=0) | whole.watched.any(axis=0))
        joints = tuple(robot.joint_names[k] for k in place.columns if watched[k])
        if joints or place.name in asked:
            out.append(_at(robot, place, joints, counted, whole, asked.get(place.name), share))
    return tuple(out)


def _at(
    robot: RobotModel,
    place: Place,
    joints: tuple[str, ...],
    counted: Moments,
    whole: Moments,
    asked: RequiredForce | None,
    share: float,
) -> NoticedForce:
    here = alarming_forces(robot, place, counted.position_rad, counted.noticed_nm, counted.watched)
    count = here.force_n.size * (1.0 + (counted.lost_s / counted.spans_s if counted.spans_s > 0 else 0.0))
    shares = sorted({*_TIME_SHARES, share})
    known = here.force_n[np.isfinite(here.force_n)]
    levels = tuple(ForceLevel(x, level) for x, level in zip(shares, level_at(known, count, shares), strict=True))
    found = None
    if asked is not None and here.force_n.size:
        missed = here.force_n > asked.force_n
        limiting = here.first[missed & np.isfinite(here.force_n)]
        always = alarming_forces(robot, place, whole.position_rad, whole.noticed_nm, whole.watched)
        seen = always.force_n <= asked.force_n
        each_s = whole.spans_s / max(1, whole.time_s.size)
        found = AskedForce(
            force_n=asked.force_n,
            by=asked.by,
            share=float(np.count_nonzero(~missed)) / count,
            noticed_s=each_s * float(np.count_nonzero(seen)),
            unnoticed_s=each_s * float(np.count_nonzero(~seen)),
            longest_unnoticed_s=longest_unseen(whole.time_s[always.felt], seen),
            limited_by=robot.joint_names[int(np.bincount(limiting).argmax())] if limiting.size else None,
            directions=here.noticed(asked.force_n),
        )
    return NoticedForce(place.name, place.link, place.frame, joints, levels, here.unfelt, found)


def level_at(known: FloatArray, count: float, shares: Sequence[float]) -> list[float | None]:
    """The smallest of the known values that a share of all ``count`` values does not exceed; None: too few are known.

    Args:
        known: (k,) finite values, k <= count.
        count: how many there are with the unknown ones, which exceed everything.
        shares: above 0, to 1.
    """
    places = [max(int(np.ceil(share * count - 1e-9)), 1) - 1 for share in shares]
    value = {place: float(np.partition(known, place)[place]) for place in set(places) if place < known.size}
    return [value.get(place) for place in places]


def longest_unseen(time_s: FloatArray, seen: BoolArray) -> float:
    """Longest time, s, from one seen moment (k,) to the next, or the first or last of all, with unseen ones between."""
    starts, stops = run_bounds(~seen)
    if not starts.size:
        return 0.0
    return float((time_s[np.minimum(stops, seen.size - 1)] - time_s[np.maximum(starts - 1, 0)]).max())


#: Moments of the time in motion, and of all recorded time, that are looked at: their share is that of the time to 1 %.
MOMENTS = 500
#: Shares of the time at which a joint's distribution is given.
SHARES = (0.5, 0.8, 0.9, 0.95, 0.99, 1.0)
#: An arm that moves for less than this rests, and is judged over all its time, s.
BRIEF_S = 0.5


def measure_sensitivity(
    prepared: Prepared,
    run: DetectorRun,
    inputs: DetectionInputs,
    config: Config,
    time: LogTime,
) -> Sensitivity:
    """How little would have alarmed on a log.

    Args:
        prepared: the log.
        run: residual, threshold, states.
        inputs: the rule, watched joints.
        config: what is to be noticeable.
        time: what is lost of the log, in which nothing can be told, and when it moved.

    Raises:
        ConfigError: something is to be noticeable on a joint that is not judged, or at a place that the arm lacks.
    """
    log = _PushedLog.at(prepared, run, inputs, time)
    observable: dict[str, float] = {}
    if config.policy.observable_nm is not None:
        problem = "a torque is asked to be observable on a joint that is not judged"
        where, judged = "[policy] observable_nm", tuple(inputs.rule.gamma_nm)
        observable = stated_by_joint(config.policy.observable_nm, judged, problem, where)
    joints = by_name(lambda joint: _of_joint(log, joint, observable.get(joint)), log.joints)
    places = arm_places(prepared.robot, prepared.judged, config.robot.tool.frame)
    if not places or not log.joints:
        return Sensitivity(joints, push_alarms=log.push.alarms)
    moved = np.logical_or.reduce([time.moving[joint] for joint in log.joints])
    moves = float(np.count_nonzero(moved)) * log.period_s >= BRIEF_S
    any_watched = np.asarray(np.logical_or.reduce([log.watched(joint) for joint in log.joints]))
    whole = log.moments(any_watched)
    counted = log.moments(moved) if moves else whole
    asked: dict[str, RequiredForce] = {}
    if config.policy.observable_n or not observable.keys() >= set(log.joints):
        asked = asked_forces(config.policy, prepared.robot, places, counted.position_rad, known_limits(prepared))
    share = config.policy.observable_share
    forces = noticed_forces(prepared.robot, places, counted, whole, asked, share)
    if prepared.contact_nm is not None:
        forces = tuple(replace(force, before_sensor=force.kind == TOOL) for force in forces)
    looked_at = ForceTime(log.push.duration_s, share, moves, counted.spans_s + counted.lost_s)
    return Sensitivity(joints, forces, looked_at, log.push.alarms)


@dataclass(frozen=True, slots=True, eq=False)
class _PushedLog:
    """A judged log, for what a push would have shown in it.

    Attributes:
        prepared, run: the log; its states with what is lost of any joint on top.
        joints: watched ones.
        time: what is lost of it, and when it moved.
        push: as asked for, through the detector's filter.
        shown: the same by joint, behind what smooths its effort besides.
        period_s: sample period, s.
    """

    prepared: Prepared
    run: DetectorRun
    joints: tuple[str, ...]
    time: LogTime
    push: Push
    shown: Mapping[str, Push]

    @classmethod
    def at(cls, prepared: Prepared, run: DetectorRun, inputs: DetectionInputs, time: LogTime) -> _PushedLog:
        series, rule = prepared.judged_series, inputs.rule
        known = (PUSH_S, run.residual.balance.kernel, rule.n, series.period_s)
        shown = {joint: Push.of(*known, smoothing.high_s) for joint, smoothing in prepared.effort_smoothing.items()}
        push = Push.of(*known)
        run = replace(run, detected=replace(run.detected, state=time.state))
        return cls(prepared, run, rule.watch, time, push, {joint: shown.get(joint, push) for joint in rule.watch})

    @property
    def period_s(self) -> float:
        return self.prepared.judged_series.period_s

    def watched(self, joint: str) -> BoolArray:
        """(n,) samples at which a joint was watched, lost ones included."""
        return np.asarray(self.time.state[:, self.prepared.judged_series.column(joint)] != State.NOT_WATCHED)

    @property
    def longest(self) -> Push:
        """The push that is smoothed most: moments at which it lies within the log suit all."""
        return max(self.shown.values(), key=lambda push: push.response.size, default=self.push)

    def noticed(self, joint: str, samples: IntArray) -> FloatArray:
        """(k,) smallest torque of a joint that would have alarmed."""
        return noticed_torque(self.run, self.prepared.judged_series.column(joint), self.shown[joint], samples)

    def moments(self, mask: BoolArray) -> Moments:
        """What every joint would have noticed at moments of the marked samples (n,)."""
        robot, series = self.prepared.robot, self.prepared.series
        samples = self.longest.moments(mask, MOMENTS)
        position = self.time.position_rad[samples]
        level = np.full((samples.size, len(robot.joint_names)), np.inf)
        watched = np.zeros(level.shape, dtype=np.bool_)
        for joint, found in by_name(lambda joint: self.noticed(joint, samples), self.joints).items():
            column = robot.joint_names.index(joint)
            level[:, column], watched[:, column] = found, self.watched(joint)[samples]
        spans_s = float(np.count_nonzero(mask)) * self.period_s
        return Moments(series.time_s[samples], position, level, watched, spans_s, self.time.off_grid_s)


def _of_joint(log: _PushedLog, joint: str, asked_nm: float | None) -> JointSensitivity:
    """One joint over the time in which it was watched, and over that in which it moved, lost time included."""
    watched, moving, off_grid_s = log.watched(joint), log.time.moving[joint], log.time.off_grid_s
    watched_s, moving_s = (float(np.count_nonzero(mask)) * log.period_s for mask in (watched, moving))
    samples, in_motion = (log.longest.moments(mask, MOMENTS) for mask in (watched, moving))
    level, level_moving = log.noticed(joint, samples), log.noticed(joint, in_motion)
    known = level[np.isfinite(level)]
    count = samples.size * (1.0 + off_grid_s / watched_s) if watched_s > 0 else 0.0
    motion_s = moving_s + off_grid_s if moving_s > 0 else 0.0
    asked = None
    if asked_nm is not None:
        seen = level <= asked_nm
        larger = np.isfinite(level) & ~seen
        asked = AskedTorque(
            torque_nm=asked_nm,
            share=moving_s * _share(level_moving <= asked_nm) / motion_s if motion_s > 0 else 0.0,
            noticed_s=watched_s * _share(seen),
            unnoticed_s=watched_s * _share(larger),
            longest_unnoticed_s=longest_unseen(log.prepared.series.time_s[samples], seen),
        )
    return JointSensitivity(
        levels=tuple(TorqueLevel(*pair) for pair in zip(SHARES, level_at(known, count, SHARES), strict=True)),
        largest_nm=float(known.max()) if known.size else None,
        motion_s=motion_s,
        told_s=moving_s * _share(np.isfinite(level_moving)),
        asked=asked,
    )


def _share(mask: BoolArray) -> float:
    return float(np.mean(mask)) if mask.size else 0.0
