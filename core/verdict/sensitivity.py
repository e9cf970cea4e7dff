"""How little would have alarmed on a log: torque by joint and force along the arm, over time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.config.schema import Config, PolicyConfig
from collaudit.core.config.schema_policy import PUSH_S
from collaudit.core.data.sensitivity_result import (
    TOOL,
    AskedTorque,
    ForceTime,
    JointSensitivity,
    Sensitivity,
    TorqueLevel,
)
from collaudit.core.data.signals import State
from collaudit.core.detection.detector_run import DetectionInputs, DetectorRun
from collaudit.core.detection.rule_reach import known_limits
from collaudit.core.detection.rule_settings import stated_by_joint
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.parallel import by_name
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.robot.arm_places import RequiredForce, arm_places, asked_forces
from collaudit.core.verdict.coverage import LogTime
from collaudit.core.verdict.noticed_push import Moments, Push, level_at, longest_unseen, noticed_forces, noticed_torque

#: Moments of the time in motion, and of all recorded time, that are looked at: their share is that of the time to 1 %.
MOMENTS = 500
#: Shares of the time at which a joint's distribution is given.
SHARES = (0.5, 0.8, 0.9, 0.95, 0.99, 1.0)
#: An arm that moves for less than this rests, and is judged over all its time, s.
BRIEF_S = 0.5


def observable_torques(policy: PolicyConfig, joints: tuple[str, ...]) -> dict[str, float]:
    """The torque that must alarm on each joint for which the configuration asks for one.

    Args:
        policy: what is stated.
        joints: those that are judged.

    Raises:
        ConfigError: a torque is stated for a joint that is not judged.
    """
    if policy.observable_nm is None:
        return {}
    problem = "a torque is asked to be observable on a joint that is not judged"
    return stated_by_joint(policy.observable_nm, joints, problem, "[policy] observable_nm")


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
    log = _PushedLog.at(prepared, run, inputs, config, time)
    moving = time.moving
    observable = observable_torques(config.policy, tuple(inputs.rule.gamma_nm))
    joints = by_name(lambda joint: _of_joint(log, joint, observable.get(joint)), log.joints)
    places = arm_places(prepared.robot, prepared.judged, config.robot.tool.frame)
    if not places or not log.joints:
        return Sensitivity(joints, push_alarms=log.push.alarms)
    moved = np.logical_or.reduce([moving[joint] for joint in log.joints])
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
    def at(
        cls, prepared: Prepared, run: DetectorRun, inputs: DetectionInputs, config: Config, time: LogTime
    ) -> _PushedLog:
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
