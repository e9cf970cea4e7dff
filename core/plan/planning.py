"""Composition of a plan: limits, sweeps, exciting trajectory, what both should tell, clean hours."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.config import LoadedConfig
from collaudit.core.data.audit_result import Audit, FrictionFile, Provenance
from collaudit.core.data.plan_result import PLAN_SCHEMA, PROPOSAL, JointLimits, JointSweep, PlanFile
from collaudit.core.errors import ConfigError
from collaudit.core.friction.friction_model import FrictionModel
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.parallel import Progress, stage
from collaudit.core.plan.excitation import Unknowns, excite, unknowns_of
from collaudit.core.plan.moves import ArmLimits, Motion, MoveCheck, arm_limits, joined, padded
from collaudit.core.plan.prediction import clean_times, excitation_predictions, sweep_predictions
from collaudit.core.plan.sweeps import PAUSE_S, JointSweeps, choose_sweeps, sweep_moves, time_s
from collaudit.core.robot.arm_shapes import ArmShapes, Surroundings
from collaudit.core.robot.robot_building import build_robot
from collaudit.core.robot.robot_description import Description, describe_robot, unknown_name
from collaudit.core.robot.robot_model import RobotModel

#: Of the time, for sweeps at most, where an exciting trajectory is to follow.
_SWEEPS_SHARE = 0.7
_LONGEST_EXCITING_S = 120.0
_LEAST_MOTION_S = 5.0
#: Poses that are tried where the arm touches something at the middle of its ranges.
_STARTS = 500
#: Least distance between links, and to the table, m.
CLEARANCE_M = 0.02


@dataclass(frozen=True, slots=True)
class PlanRequest:
    """What is asked for.

    Attributes:
        minutes: the motion is no longer.
        joints: to move; None for all.
        speed_scale: share of the highest speeds.
        target: half width, as a share of a friction parameter, that is enough.
        per_hour: false alarms of the arm for the clean hours.
        gamma_nm: threshold for the clean hours; None where none is asked for.
        seed: of the poses that are tried.
    """

    minutes: float = 10.0
    joints: tuple[str, ...] | None = None
    speed_scale: float = 1.0
    target: float = 0.02
    per_hour: float = 1e-3
    gamma_nm: float | None = None
    seed: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """A planned motion and its facts; ``moves`` are its parts, each from rest to rest, with ``PAUSE_S`` after each."""

    file: PlanFile
    robot: RobotModel
    motion: Motion
    moves: tuple[Motion, ...]


def make_plan(
    settings: LoadedConfig,
    friction: FrictionFile | None,
    audits: Sequence[Audit],
    request: PlanRequest,
    provenance: Provenance,
    progress: Progress | None = None,
) -> Plan:
    """Plan a motion for the arm of a configuration.

    Args:
        settings: robot, tool, ``[plan]``.
        friction: what an earlier fit found; None for nothing.
        audits: judged logs, for the clean hours.
        request: what is asked for.
        provenance: versions and hashes.
        progress: called with steps done and in all.

    Raises:
        ConfigError: a limit is missing, the start or the workspace allows nothing. RobotError: no robot.
    """
    check, robot = move_check(settings, friction, request.speed_scale)
    joints = _joints(robot, request)
    seconds = 60.0 * request.minutes
    exciting = robot.has_inertials and len(joints) > 0
    sweeps = choose_sweeps(
        check,
        friction.joints if friction else {},
        joints,
        (_SWEEPS_SHARE if exciting else 1.0) * seconds,
        request.target,
    )
    stage(progress, 0.0, 0.3)(1, 1)
    moves, kept = sweep_moves(check, sweeps, seconds)
    entries = _entries(check.limits, kept, time_s(moves))
    unknowns = unknowns_of(robot, settings.config, friction, check.limits.torque) if exciting else None
    found, begun = None, time_s(moves)
    if unknowns is not None:
        left = min(seconds - begun, _LONGEST_EXCITING_S)
        found = excite(check, unknowns, np.array(joints), left, request.seed)
        moves += found.moves
    stage(progress, 0.3, 1.0)(1, 1)
    if not moves or time_s(moves) < _LEAST_MOTION_S:
        raise ConfigError(
            "nothing that would tell anything has room",
            where="[plan]",
            found=f"no free motion about the start within {request.minutes:g} min",
            hint="state another start, a larger workspace, or more minutes (--minutes)",
        )
    motion = joined(moves, PAUSE_S)
    predictions = [
        *sweep_predictions(check.limits, kept, friction),
        *(excitation_predictions(unknowns, found, friction) if unknowns and found else ()),
    ]
    around = _around(settings)
    file = PlanFile(
        schema=PLAN_SCHEMA,
        statement=PROPOSAL,
        minutes_asked=request.minutes,
        duration_s=motion.duration_s,
        per_hour=request.per_hour,
        gamma_asked_nm=request.gamma_nm,
        limits=_limits(check.limits),
        assumed=check.limits.assumed,
        shapes=check.shapes.described,
        capsules_m=check.shapes.capsules,
        unchecked=check.shapes.unchecked,
        surroundings=_surroundings(around, settings),
        sweeps=entries,
        exciting_s=(begun, time_s(moves)) if found and found.moves else None,
        exciting_moves=len(found.moves) if found else 0,
        predictions=tuple(predictions),
        clean=clean_times(
            robot.joint_names, audits, friction, request.per_hour, motion.duration_s / 3600.0, request.gamma_nm
        ),
        missing=(
            *_strangers(robot, friction),
            *_missing(check, robot, joints, kept, unknowns, request.target),
        ),
        provenance=replace(provenance, model_sha256=robot.sha256),
    )
    return Plan(file, robot, motion, tuple(moves))


def move_check(
    settings: LoadedConfig, friction: FrictionFile | None, speed_scale: float
) -> tuple[MoveCheck, RobotModel]:
    """All limits of the configured arm, and the arm; refusals as of :func:`make_plan`."""
    config = settings.config
    description = describe_robot(config.robot, settings.base_dir)
    if description is None:
        raise ConfigError(
            "no robot is configured", where="[robot]", hint="give --urdf arm.urdf, or [robot] in the configuration"
        )
    robot = build_robot(config.robot, settings.base_dir, config.robot.joints or _arm_joints(description, friction))
    limits = arm_limits(robot, config.robot, config.plan, speed_scale)
    around = _around(settings)
    urdf = settings.base_dir / config.robot.urdf if config.robot.urdf is not None else None
    shapes = ArmShapes(robot, padded(around), urdf)
    touching = shapes.touching(limits.start[None])
    if touching is not None and not config.plan.start_rad:
        limits = _started_free(limits, shapes)
        touching = shapes.touching(limits.start[None])
    if touching is not None:
        raise ConfigError(
            "the motion cannot start where it is to",
            where="[plan] start_rad",
            found=f"closer than {padded(around).clearance_m:.3g} m there: {touching[1]}",
            hint="state a start that is free, the table's height (table_z_m), or the workspace",
        )
    laws = {name: law for name, fit in (friction.joints if friction else {}).items()
            if fit.effort_unit in ("N·m", "N") and (law := FrictionModel.of(fit)) is not None}  # fmt: skip
    check = MoveCheck(robot, limits, shapes, shapes.reach_m(), around.clearance_m, laws)
    still = limits.start[None]
    if robot.has_inertials and np.any(np.abs(check.torque_nm(still, 0 * still, 0 * still)) > limits.torque):
        raise ConfigError("the arm cannot hold its start with the torques that it may use", where="[plan] start_rad",
                          hint="state another start, or check torque_nm and the tool's mass")  # fmt: skip
    return check, robot


def _started_free(limits: ArmLimits, shapes: ArmShapes) -> ArmLimits:
    """The limits with a free start: of poses spread ever wider about the middle of the ranges, the first one."""
    middle, half = 0.5 * (limits.low + limits.high), 0.5 * (limits.high - limits.low)
    spread = np.random.default_rng(0).uniform(-1.0, 1.0, (_STARTS, middle.size))
    for q in middle + np.linspace(0.0, 1.0, _STARTS)[:, None] * spread * half:
        if shapes.touching(q[None]) is None:
            said = [text for text in limits.assumed if not text.startswith("start of ")]
            words = "start: not stated, a free pose near the middle of the ranges, where something touches"
            return replace(limits, start=q, assumed=(*said, words))
    return limits


def _arm_joints(description: Description, friction: FrictionFile | None) -> Sequence[str]:
    """Joints of earlier logs, where there are any, else all that move."""
    known = [name for name in description.movable if friction is not None and name in friction.joints]
    return known or description.movable


def _around(settings: LoadedConfig) -> Surroundings:
    plan, robot = settings.config.plan, settings.config.robot
    corners = plan.workspace_m
    if corners is not None and any(a >= b for a, b in zip(*corners, strict=True)):
        raise ConfigError(
            "the workspace has no inside",
            where="[plan] workspace_m",
            found=f"{corners[0]} to {corners[1]}",
            expected="lowest values below highest ones",
        )
    if plan.tool_tip_m is not None and robot.tool.frame is None:
        raise ConfigError("the tool's tip needs the frame that it is given in", where="[robot.tool] frame")
    tip = (robot.tool.frame, plan.tool_tip_m) if plan.tool_tip_m is not None and robot.tool.frame else None
    return Surroundings(CLEARANCE_M, plan.table_z_m, corners, tip)


def _joints(robot: RobotModel, request: PlanRequest) -> list[int]:
    moved = request.joints or robot.joint_names
    for name in moved:
        if name not in robot.joint_names:
            raise unknown_name("the robot has no such joint", "--joints", name, robot.joint_names)
    return sorted(robot.joint_names.index(name) for name in moved)


def _entries(limits: ArmLimits, kept: Sequence[JointSweeps], end_s: float) -> tuple[JointSweep, ...]:
    """Sweeps of each joint for the file; all are done together, from the start of the motion."""
    return tuple(
        JointSweep(limits.joint_names[one.joint], *one.window, tuple(sorted(one.speeds)), 0.0, end_s) for one in kept
    )


def _limits(limits: ArmLimits) -> dict[str, JointLimits]:
    columns = (limits.low, limits.high, limits.speed, limits.acceleration, limits.jerk, limits.torque, limits.start)
    rows: FloatArray = np.array(columns).T
    return {name: JointLimits(*map(float, row)) for name, row in zip(limits.joint_names, rows, strict=True)}


def _surroundings(around: Surroundings, settings: LoadedConfig) -> tuple[str, ...]:
    plan = settings.config.plan
    stated = "stated" if "table_z_m" in plan.given else "not stated: the plane of the base"
    box = "no workspace is stated: what stands around the arm is not known"
    if around.box_m is not None:
        box = f"workspace from {tuple(around.box_m[0])} to {tuple(around.box_m[1])} m"
    tip = "the tool's tip is not stated: the last link's farthest frame counts" if around.tip is None else (
        f"tool up to {tuple(around.tip[1])} m of {around.tip[0]}")  # fmt: skip
    return f"table at z = {around.table_z_m:g} m ({stated})", box, tip, f"clearance {around.clearance_m:g} m"


def _strangers(robot: RobotModel, friction: FrictionFile | None) -> tuple[str, ...]:
    """A word where the friction is of another arm, or of this one described otherwise."""
    if friction is None or friction.provenance.model_sha256 in (None, robot.sha256):
        return ()
    return ("the friction was fitted with another description of an arm, or with another tool",)


def _missing(
    check: MoveCheck,
    robot: RobotModel,
    joints: Sequence[int],
    kept: Sequence[JointSweeps],
    unknowns: Unknowns | None,
    target: float,
) -> tuple[str, ...]:
    names, out = robot.joint_names, []
    done = {one.joint for one in kept}
    if lacking := [names[j] for j in joints if j not in done]:
        out.append(f"no sweeps of {', '.join(lacking)}: settled already, no room, or no time")
    if wide := [names[one.joint] for one in kept if one.design.measured and not one.settled(target)]:
        out.append(
            f"half widths of {100.0 * target:.2g} % of every friction parameter take more minutes for {', '.join(wide)}"
        )
    if unmeasured := [names[one.joint] for one in kept if not one.design.measured]:
        out.append(
            f"no half widths of {', '.join(unmeasured)} are predicted: no earlier log says how its points scatter"
        )
    if not robot.has_inertials:
        out.append("the robot has no inertials: no torque is checked, and no exciting trajectory is planned")
    if unguarded := [name for name in names if name not in check.friction]:
        out.append(f"friction of {', '.join(unguarded)} is not known: a fifth of the torque is kept free for it")
    if unknowns is not None and not all(unknowns.measured):
        out.append(
            "half widths of inertials, rotors and load friction are not predicted: no earlier log tells the noise"
        )
    return tuple(out)
