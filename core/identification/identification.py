"""Identification from any motion: drive gains, inertials and tool, held against blocks of time left out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from collaudit.core.config.schema import Config
from collaudit.core.data.identification_result import (
    BaseParameter,
    Bounds,
    Identified,
    IdentifiedBody,
    IdentifiedJoint,
    IdentifiedTool,
)
from collaudit.core.dataclass import dataclass
from collaudit.core.errors import ConfigError, NotJudgedError
from collaudit.core.identification.base_parameters import BaseMap, base_map
from collaudit.core.identification.identification_problem import (
    Solution,
    Unknowns,
    refit_nuisance,
    residual,
    solve,
    terms_of,
)
from collaudit.core.identification.identification_samples import collect
from collaudit.core.identification.inertial_consistency import is_consistent, make_consistent
from collaudit.core.identification.nuisance import OFFSET
from collaudit.core.identification.priors import ARMATURE_SHARE, Gains, drive_gains, inertial_prior_sd, unknowns_of
from collaudit.core.identification.problem_terms import Terms
from collaudit.core.identification.standard_errors import StandardErrors, standard_errors
from collaudit.core.identification.tool_estimate import identified_tool, point_mass_inertia
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.stats import STANDARD_ERRORS_95
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.robot.robot_model import RobotModel

_HELD_OUT_STEPS = 4
_CONTRADICT = 2.0  # half widths of a 95 % interval, of the difference


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
    unknowns = unknowns_of(prepared, robot, estimate, config)
    gains = None
    if "gain" in estimate:
        gains = drive_gains(motion, regressor, unknowns, config, robot, estimate)
        motion = replace(motion, moving=np.asarray(motion.moving & np.isfinite(gains.gain)))
        unknowns = replace(unknowns, gain=gains.gain, gain_prior_sd=np.zeros_like(gains.gain))
    terms = terms_of(motion, regressor, unknowns)
    unknowns, solution = _repaired(terms, unknowns, solve(terms, unknowns), estimate)
    free = np.concatenate([solution.inertials, solution.armature, solution.gain])
    made = make_consistent(free, solution.hessian, solution.free, unknowns.inertials.size // 10)
    final = refit_nuisance(terms, _with_free(solution, made.free))
    job = _Job(robot, terms, unknowns, final, standard_errors(terms, solution, unknowns), estimate, gains)
    return Identified(
        estimate=estimate,
        joints=_joints(job, config.fit.blocks),
        bodies=_bodies(job),
        base_parameters=_base_parameters(job) if "inertials" in estimate else (),
        tool=_tool(job, config) if "tool" in estimate else None,
        prior=_prior_words(estimate, inertial_prior_sd(config)),
        prior_sd=inertial_prior_sd(config),
        consistent=made.consistent,
        consistency=made.how,
        samples=motion.count,
        sample_rate_hz=motion.rate_hz,
        loss=motion.loss,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Job:
    robot: RobotModel
    terms: Terms
    unknowns: Unknowns
    solution: Solution
    errors: StandardErrors
    estimate: tuple[str, ...]
    gains: Gains | None


def _tool(job: _Job, config: Config) -> IdentifiedTool:
    """The tool; what each half of the motion says of it, where they contradict each other."""
    found = identified_tool(job.robot, config, job.unknowns.inertials, job.solution, job.errors)
    moving = job.terms.motion.moving
    first = np.zeros_like(moving)
    first[: len(moving) // 2] = True
    masses, spread = [], []
    for rows in (first, ~first):
        half = job.terms.over(replace(job.terms.motion, moving=np.asarray(moving & rows)))
        solution = solve(half, job.unknowns, _HELD_OUT_STEPS)
        tool = identified_tool(
            job.robot, config, job.unknowns.inertials, solution, standard_errors(half, solution, job.unknowns)
        )
        masses.append(tool.mass_kg)
        spread.append(0.5 * ((tool.mass_ci95[1] or 0.0) - (tool.mass_ci95[0] or 0.0)))
    apart = abs(masses[1] - masses[0]) > _CONTRADICT * float(np.hypot(spread[0], spread[1]))
    return replace(found, mass_halves_kg=(masses[0], masses[1])) if apart else found


def _repaired(
    terms: Terms, unknowns: Unknowns, solution: Solution, estimate: tuple[str, ...]
) -> tuple[Unknowns, Solution]:
    """Solve again with negative rotor inertias held at zero, and with the inertia that a point-mass tool has."""
    again = False
    negative = solution.armature < 0
    if negative.any():
        unknowns = replace(
            unknowns,
            armature=np.where(negative, 0.0, unknowns.armature),
            armature_prior_sd=np.where(negative, 0.0, unknowns.armature_prior_sd),
        )
        again = True
    if "tool" in estimate and "inertials" not in estimate:
        unknowns = replace(
            unknowns, inertials=unknowns.inertials + point_mass_inertia(unknowns.inertials, solution.inertials)
        )
        again = True
    return unknowns, solve(terms, unknowns) if again else solution


def _with_free(solution: Solution, free: FloatArray) -> Solution:
    every = np.concatenate([solution.inertials, solution.armature, solution.gain])
    every[solution.free] = free
    p, j = solution.inertials.size, solution.armature.size
    return replace(solution, inertials=every[:p], armature=every[p : p + j], gain=every[p + j :])


def _joints(job: _Job, blocks: int) -> dict[str, IdentifiedJoint]:
    file_only = replace(
        job.unknowns,
        inertials=job.robot.inertial_parameters,
        inertials_prior_sd=np.zeros_like(job.unknowns.inertials_prior_sd),
        armature_prior_sd=np.zeros_like(job.unknowns.armature_prior_sd),
        armature=_leader_armature(job.robot),
    )
    motion = job.terms.motion
    bare = terms_of(motion, job.terms.regressor, file_only)
    moving, gain = motion.moving, job.solution.gain
    plain = residual(bare, solve(bare, file_only))
    rms = [_rms(rest, moving) for rest in (plain, residual(job.terms, job.solution))]
    out = [_held_out(bare, file_only, blocks), _held_out(job.terms, job.unknowns, blocks)]
    joints = {}
    for j, name in enumerate(job.robot.joint_names):
        offset, known = float(job.solution.nuisance[j, OFFSET]), bool(np.isfinite(gain[j]))
        offset_known = known and bool(moving[:, j].any()) and not job.terms.one_way[j]
        joints[name] = IdentifiedJoint(
            gain=float(gain[j]) if known else None,
            gain_ci95=_interval(float(gain[j]), float(job.gains.sd[j])) if job.gains is not None and known else None,
            gain_kept=job.gains is not None and bool(job.gains.kept[j]),
            gain_by_load=job.gains is not None and bool(job.gains.by_load[j]),
            offset_nm=offset if known and not job.terms.one_way[j] else 0.0,
            offset_ci95=_interval(offset, float(job.errors.offset_sd[j])) if offset_known else (None, None),
            armature_kg_m2=float(job.solution.armature[j]),
            armature_file_kg_m2=float(file_only.armature[j]),
            armature_ci95=_armature_interval(job, j),
            samples=int(np.count_nonzero(moving[:, j])),
            rms_file_nm=rms[0][j],
            rms_nm=rms[1][j],
            held_out_rms_file_nm=out[0][j],
            held_out_rms_nm=out[1][j],
        )
    return joints


def _armature_interval(job: _Job, j: int) -> Bounds | None:
    """Interval of joint j's rotor inertia, or None where it was held."""
    p = job.solution.inertials.size
    if not job.solution.free[p + j]:
        return None
    at = int(np.count_nonzero(job.solution.free[: p + j]))
    low, high = _interval(float(job.solution.armature[j]), float(np.sqrt(max(job.errors.covariance[at, at], 0.0))))
    return (max(0.0, low or 0.0), high)


def _leader_armature(robot: RobotModel) -> FloatArray:
    assert robot.bodies is not None
    return robot.armature[[robot.bodies.joint_names.index(n) for n in robot.joint_names]]


def _rms(rest: FloatArray, moving: BoolArray) -> list[float | None]:
    return [
        float(np.sqrt(np.mean(rest[moving[:, j], j] ** 2))) if np.any(moving[:, j]) else None
        for j in range(rest.shape[1])
    ]


def _held_out(terms: Terms, unknowns: Unknowns, blocks: int) -> list[float | None]:
    """RMS per joint over all blocks of time, each predicted from the other blocks."""
    motion, steady = terms.motion, terms.without_drift()
    rest = np.full_like(motion.effort, np.nan)
    for block in range(blocks):
        out = np.asarray(motion.block == block)
        if not out.any() or out.all():
            return [None] * rest.shape[1]
        others = steady.over(replace(motion, moving=np.asarray(motion.moving & ~out[:, None])))
        rest[out] = residual(others, solve(others, unknowns, _HELD_OUT_STEPS))[out]
    return _rms(rest, motion.moving)


def _interval(value: float, sd: float) -> Bounds:
    return value - STANDARD_ERRORS_95 * sd, value + STANDARD_ERRORS_95 * sd


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
    covariance[np.ix_(pick, pick)] = job.errors.covariance[:count, :count]
    after = np.sqrt(np.maximum(np.einsum("bp,pq,bq->b", base.matrix, covariance, base.matrix), 0.0))
    before = np.sqrt(base.matrix**2 @ job.unknowns.inertials_prior_sd**2)
    found = []
    for k, name in enumerate(base.names):
        value = float(base.matrix[k] @ job.solution.inertials)
        on_file = float(base.matrix[k] @ job.robot.inertial_parameters)
        share = float(1.0 - (after[k] / before[k]) ** 2) if before[k] > 0 else 0.0
        found.append(BaseParameter(name, value, on_file, _interval(value, float(after[k])), max(0.0, share)))
    return tuple(sorted(found, key=lambda b: -b.from_data))


def _prior_words(estimate: tuple[str, ...], share: float) -> str:
    first = (
        "Drive gains rely on the robot description's inertials, which set their scale; rotor inertias that are not "
        "stated are estimated beside them. "
        if "gain" in estimate
        else ""
    )
    if "inertials" not in estimate:
        return first + "The robot description's inertials are taken as exact."
    return first + (
        f"The robot description's inertials are the prior: each mass with a standard deviation of {100 * share:g} %, "
        "first moments and inertias by the same share of mass times size and size squared (radius of gyration); rotor "
        f"inertia with {100 * ARMATURE_SHARE:g} % of the joint's own inertia or more."
    )
