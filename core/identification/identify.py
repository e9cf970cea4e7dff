"""Identification from any motion: drive gains, inertials and tool, held against blocks of time left out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.config.schema import Config
from collaudit.core.errors import ConfigError, NotJudgedError
from collaudit.core.identification.base import BaseMap, base_map
from collaudit.core.identification.consistency import is_consistent, make_consistent
from collaudit.core.identification.problem import Solution, Unknowns, residual, settle, solve
from collaudit.core.identification.samples import Motion, collect
from collaudit.core.identification.tool import identified_tool, point_mass_inertia
from collaudit.core.prepare import Prepared
from collaudit.core.result_identification import BaseParameter, Bounds, Identified, IdentifiedBody, IdentifiedJoint
from collaudit.core.robot.robot import RobotModel
from collaudit.core.series import BoolArray, FloatArray

_Z95 = 1.96
_TOOL_MASS_SD, _TOOL_MOMENT_SD = 5.0, 0.5  # kg, kg·m: next to no prior
_SHOWN = 0.2  # a gain is shown by the motion when its standard error is below this share of it
_HELD_OUT_STEPS = 4
_ARMATURE_SHARE = 0.5  # of a joint's inertia: robot files seldom state rotor inertia at all


def wanted(config: Config) -> tuple[str, ...]:
    """What is to be identified; a tool whose mass is ``estimate`` belongs to it."""
    asked = list(dict.fromkeys(config.fit.estimate))
    if config.robot.tool.mass_kg == "estimate" and "tool" not in asked:
        asked.append("tool")
    return tuple(asked)


def identify(prepared: Sequence[Prepared], config: Config) -> Identified | None:
    """Identify what ``[fit] estimate`` asks for beyond friction; None when that is nothing.

    Raises:
        ConfigError: efforts in an unknown unit without the gain being estimated. NotJudgedError: no inertials, or
            too little motion.
    """
    estimate = wanted(config)
    if not set(estimate) - {"friction"}:
        return None
    robot = prepared[0].robot
    if not robot.has_inertials:
        raise NotJudgedError(
            f"{', '.join(estimate)} cannot be identified: the robot has no inertials",
            hint="give a URDF with <inertial> elements, or masses in the [[robot.dh]] rows",
        )
    if prepared[0].series.effort_unit == "raw" and "gain" not in estimate:
        raise ConfigError(
            "the effort's unit is not known, so its gain must be estimated too",
            where="[fit] estimate",
            found=", ".join(estimate),
            expected='"gain" among them',
        )
    motion = collect(prepared, config.fit.max_samples, config.fit.blocks)
    regressor = robot.torque_regressor(motion.position, motion.velocity, motion.acceleration)
    unknowns = _unknowns(prepared, robot, estimate, config)
    gains = None
    if "gain" in estimate:
        gains = _gains(motion, regressor, unknowns, config, robot)
        motion = replace(motion, moving=np.asarray(motion.moving & np.isfinite(gains.gain)))
        unknowns = replace(unknowns, gain=gains.gain)
    solution = solve(motion, regressor, unknowns)
    unknowns, solution = _repaired(motion, regressor, unknowns, solution, estimate)
    free = np.concatenate([solution.inertials, solution.armature, solution.gain])
    made = make_consistent(free, solution.hessian, solution.free, unknowns.inertials.size // 10)
    final = settle(motion, regressor, _with_free(solution, made.free))
    job = _Job(robot, motion, regressor, unknowns, final, estimate, gains)
    return Identified(
        estimate=estimate,
        joints=_joints(job, config.fit.blocks),
        bodies=_bodies(job),
        base_parameters=_base_parameters(job) if "inertials" in estimate else (),
        tool=identified_tool(job.robot, config, unknowns.inertials, final) if "tool" in estimate else None,
        prior=_prior_words(estimate, config.fit.cad_sd),
        prior_sd=config.fit.cad_sd,
        consistent=made.consistent,
        consistency=made.how,
        samples=motion.count,
        sample_rate_hz=motion.rate_hz,
        loss=motion.loss,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Job:
    robot: RobotModel
    motion: Motion
    regressor: FloatArray
    unknowns: Unknowns
    solution: Solution
    estimate: tuple[str, ...]
    gains: _Gains | None


def _unknowns(prepared: Sequence[Prepared], robot: RobotModel, estimate: tuple[str, ...], config: Config) -> Unknowns:
    inertials = robot.inertial_parameters
    sd = _inertial_sd(inertials, config.fit.cad_sd) if "inertials" in estimate else np.zeros_like(inertials)
    if "tool" in estimate:
        last = 10 * (tool_body(robot, config) + 1)
        sd[last - 10] = _TOOL_MASS_SD
        sd[last - 9 : last - 6] = _TOOL_MOMENT_SD
    names = robot.joint_names
    leader = [robot.bodies.joint_names.index(n) for n in names] if robot.bodies else []
    armature = robot.armature[leader]
    arm_sd = np.zeros(len(names))
    if "inertials" in estimate:
        arm_sd = np.maximum(config.fit.cad_sd * armature, _ARMATURE_SHARE * _joint_inertia(robot, prepared[0]))
    gain = np.ones(len(names))
    if "gain" in estimate:
        for found in prepared[0].gains:
            gain[names.index(found.joint)] = found.gain if abs(found.gain) > 1e-6 else 1.0
    return Unknowns(inertials, sd, armature, arm_sd, gain, np.zeros(len(names)))


@dataclass(frozen=True, slots=True, eq=False)
class _Gains:
    """Gains (j,), NaN where the motion does not show one, and their standard errors."""

    gain: FloatArray
    sd: FloatArray


def _gains(motion: Motion, regressor: FloatArray, unknowns: Unknowns, config: Config, robot: RobotModel) -> _Gains:
    """Drive gains given the description's inertials, a tool beside them where it is asked for.

    No motion tells a common scale of gains from one of inertials; so gains come first and are then held.
    """
    sd = np.zeros_like(unknowns.inertials_sd)
    if "tool" in wanted(config):
        k = 10 * tool_body(robot, config)
        sd[k : k + 4] = unknowns.inertials_sd[k : k + 4]
    count = unknowns.gain.size
    held = replace(unknowns, inertials_sd=sd, armature_sd=0 * unknowns.armature_sd, gain_sd=np.full(count, np.inf))
    first = solve(motion, regressor, held)
    error = np.full(first.free.size, np.inf)
    error[first.free] = np.sqrt(np.diag(first.covariance))
    error = error[-count:]
    return _Gains(np.where(error < _SHOWN * np.abs(first.gain), first.gain, np.nan), error)


def tool_body(robot: RobotModel, config: Config) -> int:
    """Number of the body that carries the tool."""
    assert robot.bodies is not None
    frame = config.robot.tool.frame or robot.bodies.frame_names[-1]
    return robot.bodies.frame_in_joint(frame)[2]


def _inertial_sd(inertials: FloatArray, share: float) -> FloatArray:
    """Share of mass, of mass times size, of mass times size squared; size is the radius of gyration."""
    sd = np.zeros_like(inertials)
    for k in range(0, inertials.size, 10):
        mass, ixx, iyy, izz = (float(inertials[k + i]) for i in (0, 4, 6, 9))
        if mass > 0:
            size = max(float(np.sqrt(0.5 * max(ixx + iyy + izz, 0.0) / mass)), 0.01)
            sd[k : k + 10] = share * mass * np.array([1.0, *[size] * 3, *[size**2] * 6])
    return sd


def _joint_inertia(robot: RobotModel, prepared: Prepared) -> FloatArray:
    """(j,) diagonal of the mass matrix at the middle of the motion, rotor inertia left out."""
    count = len(robot.joint_names)
    middle = np.nanmedian(prepared.series.position_rad, axis=0)
    pose = np.broadcast_to(middle, (count, count)).copy()
    torque = robot.inverse_dynamics(pose, np.zeros((count, count)), np.eye(count)) - robot.gravity_torque(pose)
    leader = [robot.bodies.joint_names.index(n) for n in robot.joint_names] if robot.bodies else []
    out: FloatArray = np.diag(torque) - robot.armature[leader]
    return out


def _repaired(
    motion: Motion, regressor: FloatArray, unknowns: Unknowns, solution: Solution, estimate: tuple[str, ...]
) -> tuple[Unknowns, Solution]:
    """Solve again with negative rotor inertias held at zero, and with the inertia that a point-mass tool has."""
    again = False
    negative = solution.armature < 0
    if negative.any():
        unknowns = replace(
            unknowns,
            armature=np.where(negative, 0.0, unknowns.armature),
            armature_sd=np.where(negative, 0.0, unknowns.armature_sd),
        )
        again = True
    if "tool" in estimate and "inertials" not in estimate:
        unknowns = replace(
            unknowns, inertials=unknowns.inertials + point_mass_inertia(unknowns.inertials, solution.inertials)
        )
        again = True
    return unknowns, solve(motion, regressor, unknowns) if again else solution


def _with_free(solution: Solution, free: FloatArray) -> Solution:
    every = np.concatenate([solution.inertials, solution.armature, solution.gain])
    every[solution.free] = free
    p, j = solution.inertials.size, solution.armature.size
    return replace(solution, inertials=every[:p], armature=every[p : p + j], gain=every[p + j :])


def _joints(job: _Job, blocks: int) -> dict[str, IdentifiedJoint]:
    file_only = replace(
        job.unknowns,
        inertials=job.robot.inertial_parameters,
        inertials_sd=np.zeros_like(job.unknowns.inertials_sd),
        armature_sd=np.zeros_like(job.unknowns.armature_sd),
        armature=_leader_armature(job.robot),
    )
    plain = solve(job.motion, job.regressor, file_only)
    moving = job.motion.moving
    gain = job.solution.gain
    rms = [_rms(residual(job.motion, job.regressor, s), moving) for s in (plain, job.solution)]
    out = [_held_out(job, unknowns, blocks) for unknowns in (file_only, job.unknowns)]
    joints = {}
    for j, name in enumerate(job.robot.joint_names):
        offset, known = float(job.solution.nuisance[j, 2]), bool(np.isfinite(gain[j]))
        joints[name] = IdentifiedJoint(
            gain=float(gain[j]) if known else None,
            gain_ci95=_interval(float(gain[j]), float(job.gains.sd[j])) if job.gains is not None and known else None,
            offset_nm=offset if known else 0.0,
            offset_ci95=_interval(offset, float(job.solution.nuisance_sd[j, 2])) if known else (None, None),
            armature_kg_m2=float(job.solution.armature[j]),
            armature_file_kg_m2=float(file_only.armature[j]),
            samples=int(np.count_nonzero(moving[:, j])),
            rms_file_nm=rms[0][j],
            rms_nm=rms[1][j],
            held_out_rms_file_nm=out[0][j],
            held_out_rms_nm=out[1][j],
        )
    return joints


def _leader_armature(robot: RobotModel) -> FloatArray:
    assert robot.bodies is not None
    return robot.armature[[robot.bodies.joint_names.index(n) for n in robot.joint_names]]


def _rms(rest: FloatArray, moving: BoolArray) -> list[float | None]:
    return [
        float(np.sqrt(np.mean(rest[moving[:, j], j] ** 2))) if np.any(moving[:, j]) else None
        for j in range(rest.shape[1])
    ]


def _held_out(job: _Job, unknowns: Unknowns, blocks: int) -> list[float | None]:
    """RMS per joint over all blocks of time, each predicted without having been seen."""
    rest = np.full_like(job.motion.effort, np.nan)
    for block in range(blocks):
        out = np.asarray(job.motion.block == block)
        if not out.any() or out.all():
            return [None] * rest.shape[1]
        found = solve(job.motion.take(~out), job.regressor[~out], unknowns, _HELD_OUT_STEPS)
        rest[out] = residual(job.motion.take(out), job.regressor[out], found)
    return _rms(rest, job.motion.moving)


def _interval(value: float, sd: float) -> Bounds:
    return value - _Z95 * sd, value + _Z95 * sd


def _bodies(job: _Job) -> dict[str, IdentifiedBody]:
    assert job.robot.bodies is not None
    original = job.robot.inertial_parameters
    out = {}
    for k, name in enumerate(job.robot.bodies.joint_names):
        ten = job.solution.inertials[10 * k : 10 * k + 10]
        mass = float(ten[0])
        com = tuple(float(x) / mass for x in ten[1:4]) if mass > 0 else (0.0, 0.0, 0.0)
        out[name] = IdentifiedBody(
            mass_kg=mass,
            com_m=(com[0], com[1], com[2]),
            parameters=tuple(float(x) for x in ten),
            parameters_file=tuple(float(x) for x in original[10 * k : 10 * k + 10]),
            consistent=is_consistent(ten),
        )
    return out


def _base_parameters(job: _Job) -> tuple[BaseParameter, ...]:
    """Values, intervals, and how much of the knowledge comes from the data, best known first."""
    assert job.robot.bodies is not None
    base: BaseMap = base_map(job.robot, tuple(job.robot.bodies.joint_names))
    p = job.unknowns.inertials.size
    covariance = np.zeros((p, p))
    pick = np.flatnonzero(job.solution.free[:p])
    count = pick.size
    covariance[np.ix_(pick, pick)] = job.solution.covariance[:count, :count]
    after = np.sqrt(np.maximum(np.einsum("bp,pq,bq->b", base.matrix, covariance, base.matrix), 0.0))
    before = np.sqrt(base.matrix**2 @ job.unknowns.inertials_sd**2)
    found = []
    for k, name in enumerate(base.names):
        value = float(base.matrix[k] @ job.solution.inertials)
        on_file = float(base.matrix[k] @ job.robot.inertial_parameters)
        share = float(1.0 - (after[k] / before[k]) ** 2) if before[k] > 0 else 0.0
        found.append(BaseParameter(name, value, on_file, _interval(value, float(after[k])), max(0.0, share)))
    return tuple(sorted(found, key=lambda b: -b.from_data))


def _prior_words(estimate: tuple[str, ...], share: float) -> str:
    first = (
        "Drive gains rest on the robot description's inertials, which set their scale. " if "gain" in estimate else ""
    )
    if "inertials" not in estimate:
        return first + "The robot description's inertials are taken as exact."
    return first + (
        f"The robot description's inertials are the prior: each mass with a standard deviation of {100 * share:g} %, "
        "first moments and inertias by the same share of mass times size and size squared (radius of gyration); rotor "
        f"inertia with {100 * _ARMATURE_SHARE:g} % of the joint's own inertia or more."
    )
