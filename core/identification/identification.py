"""Identification from any motion: drive gains, inertials and tool, held against blocks of time left out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from collaudit.core.config.schema import Config
from collaudit.core.data.identification_result import (
    BaseParameter,
    Bounds,
    EstimateChoice,
    Identified,
    IdentifiedBody,
    IdentifiedJoint,
    IdentifiedTool,
)
from collaudit.core.errors import ConfigError, NotJudgedError
from collaudit.core.identification.base_parameters import BaseMap, base_map
from collaudit.core.identification.estimate_choice import (
    HELD_OUT_STEPS,
    Candidate,
    candidates_of,
    choose_estimate,
    held_out,
)
from collaudit.core.identification.identification_problem import (
    Solution,
    Unknowns,
    refit_nuisance,
    residual,
    solve,
    terms_of,
)
from collaudit.core.identification.identification_samples import Motion, collect
from collaudit.core.identification.inertial_consistency import Consistent, is_consistent, make_consistent
from collaudit.core.identification.nuisance import OFFSET
from collaudit.core.identification.priors import ARMATURE_SHARE, Gains, drive_gains, tool_body, unknowns_of
from collaudit.core.identification.problem_terms import Terms
from collaudit.core.identification.standard_errors import StandardErrors, standard_errors
from collaudit.core.identification.tool_estimate import identified_tool, point_mass_inertia
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.stats import STANDARD_ERRORS_95
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.robot.robot_model import RobotModel

#: Samples that tell candidates apart as well as all would: errors within a second are alike.
_MOST_TO_CHOOSE = 4000
#: Possible inertias are kept where they leave no joint more than so many times the residual of the unconstrained ones.
_WORSE = 1.05
_CONTRADICT = 2.0  # half widths of a 95 % interval, of the difference


def wanted(config: Config) -> tuple[str, ...] | Literal["auto"]:
    """What is to be identified; a tool whose mass is ``estimate`` belongs to it."""
    if config.fit.estimate == "auto":
        return "auto"
    asked = list(dict.fromkeys(config.fit.estimate))
    if config.robot.tool.mass_kg == "estimate" and "tool" not in asked:
        asked.append("tool")
    return tuple(asked)


def choose(prepared: Sequence[Prepared], config: Config) -> tuple[Candidate, EstimateChoice | None]:
    """What is identified from these logs beyond friction, and what else was tried; nothing where nothing can be.

    Raises:
        ConfigError: efforts in an unknown unit without the gain being estimated. NotJudgedError: what is asked for
            needs inertials, or more motion.
    """
    asked, robot = wanted(config), prepared[0].robot
    with_gain = asked == "auto" and bool(config.log.units.torque_constant_nm_per_a)
    tried = candidates_of(asked, config, with_gain)
    if asked == "auto" and config.robot.tool.mass_kg == "estimate":
        tried = tuple(one for one in tried if not {"inertials", "gain"} & set(one.estimate))  # a tool, or none
    nothing = Candidate((), tried[0].width)
    raw = prepared[0].series.effort_unit == "raw"
    if asked == "auto":
        if raw or not robot.has_inertials or any(log.series.effort is None for log in prepared):
            return nothing, None
    elif not tried[0].estimate:
        return nothing, None
    elif not robot.has_inertials:
        raise NotJudgedError(
            f"{', '.join(asked)} cannot be identified: the robot has no inertials",
            hint="give a URDF with <inertial> elements, or masses in the [[robot.dh]] rows",
        )
    elif raw and "gain" not in asked:
        raise ConfigError(
            "the effort's unit is not known, so its gain must be estimated too",
            where="[fit] estimate",
            found=", ".join(asked),
            expected='"gain" among them',
        )
    if len(tried) == 1:
        return tried[0], None
    try:
        motion = collect(prepared, min(config.fit.max_samples, _MOST_TO_CHOOSE), config.fit.blocks)
    except NotJudgedError:
        if asked == "auto":
            return nothing, None
        raise
    regressor = robot.torque_regressor(motion.position, motion.velocity, motion.acceleration)

    def unknowns(one: Candidate) -> Unknowns:
        return _with_gains(prepared, config, one, motion, regressor)[0]

    taken, choice = choose_estimate(tried, motion, regressor, unknowns, robot.joint_names, config.fit.blocks)
    if asked == "auto" and "tool" in taken.estimate and _weighs_less(prepared, config, taken):
        left = [one for one in tried if "tool" not in one.estimate]
        return choose_estimate(left, motion, regressor, unknowns, robot.joint_names, config.fit.blocks)
    return taken, choice


def _weighs_less(prepared: Sequence[Prepared], config: Config, taken: Candidate) -> bool:
    """Whether the arm would carry a tool of negative mass: something else of the description is wrong then."""
    found = _solved(prepared, config, taken)
    body = 10 * tool_body(found.robot, config)
    known = config.robot.tool.mass_kg
    change = float(found.solution.inertials[body] - found.robot.inertial_parameters[body])
    return change + (0.0 if isinstance(known, str) else known) < 0.0


def _with_gains(
    prepared: Sequence[Prepared], config: Config, taken: Candidate, motion: Motion, regressor: FloatArray
) -> tuple[Unknowns, Gains | None]:
    """Priors of a candidate, with the gains found first and then held where it has any (NaN where none is told)."""
    robot = prepared[0].robot
    unknowns = unknowns_of(prepared, robot, taken, config)
    if "gain" not in taken.estimate:
        return unknowns, None
    gains = drive_gains(motion, regressor, unknowns, config, robot, taken.estimate)
    return replace(unknowns, gain=gains.gain, gain_prior_sd=np.zeros_like(gains.gain)), gains


def identify(prepared: Sequence[Prepared], config: Config, taken: Candidate | None = None) -> Identified | None:
    """Identify what a candidate says beyond friction; None when that is nothing.

    Args:
        prepared: the logs.
        config: how.
        taken: of :func:`choose`; None to choose here.

    Raises:
        ConfigError, NotJudgedError: as of :func:`choose`.
    """
    taken = choose(prepared, config)[0] if taken is None else taken
    estimate = taken.estimate
    if not estimate:
        return None
    found = _solved(prepared, config, taken)
    unknowns, solution, terms = found.unknowns, found.solution, found.terms
    free = np.concatenate([solution.inertials, solution.armature, solution.gain])
    made = make_consistent(free, solution.hessian, solution.free, unknowns.inertials.size // 10)
    final = refit_nuisance(terms, _with_free(solution, made.free))
    made, final = _kept_if_it_fits(found, solution, made, final)
    errors = standard_errors(terms, solution, unknowns)
    job = _Job(found.robot, terms, unknowns, final, found.gains, errors, estimate)
    return Identified(
        estimate=("friction", *estimate),
        joints=_joints(job),
        bodies=_bodies(job.robot, final),
        base_parameters=_base_parameters(job) if "inertials" in estimate else (),
        tool=_tool(job, config) if "tool" in estimate else None,
        prior=_prior_words(estimate, taken.width),
        prior_sd=taken.width,
        consistent=made.consistent,
        consistency=made.how,
        samples=terms.motion.count,
        sample_rate_hz=terms.motion.rate_hz,
        loss=terms.motion.loss,
    )


def _kept_if_it_fits(found: _Solved, free: Solution, made: Consistent, final: Solution) -> tuple[Consistent, Solution]:
    """What bodies can be, unless the motion speaks against it: a wrong scale of an effort looks like no body at all."""
    moving, names = found.terms.motion.moving, found.robot.joint_names
    before, after = (_rms(residual(found.terms, one), moving) for one in (free, final))
    worse = [k for k, (a, b) in enumerate(zip(before, after, strict=True)) if a and b and b > _WORSE * a]
    if not worse:
        return made, final
    grown = ", ".join(f"{names[k]} from {before[k]:.3g} to {after[k]:.3g}" for k in worse)
    how = (
        f"physically possible inertias would leave more (N·m): {grown}; the identified ones are kept. Such a "
        "contradiction comes from efforts whose scale is wrong, or from torques that no rigid body has"
    )
    bodies = free.inertials.size // 10
    possible = all(is_consistent(free.inertials[10 * k : 10 * k + 10]) for k in range(bodies))
    return Consistent(made.free, possible, how), free


def identify_values(prepared: Sequence[Prepared], config: Config, taken: Candidate) -> Identified | None:
    """The values that :func:`identify` finds, without intervals and checks: what a held-out fit needs.

    Raises:
        NotJudgedError: too little motion.
    """
    if not taken.estimate:
        return None
    found = _solved(prepared, config, taken)
    motion = found.terms.motion
    return Identified(
        estimate=("friction", *taken.estimate),
        joints={name: _drive(found, j) for j, name in enumerate(found.robot.joint_names)},
        bodies=_bodies(found.robot, found.solution),
        base_parameters=(),
        tool=None,
        prior="",
        prior_sd=taken.width,
        consistent=False,
        consistency="",
        samples=motion.count,
        sample_rate_hz=motion.rate_hz,
        loss=motion.loss,
    )


def _drive(found: _Solved, j: int) -> IdentifiedJoint:
    """Gain, offset and rotor inertia of one joint."""
    solution, gain = found.solution, float(found.solution.gain[j])
    known = bool(np.isfinite(gain))
    return IdentifiedJoint(
        gain=gain if known else None,
        gain_ci95=None,
        offset_nm=float(solution.nuisance[j, OFFSET]) if known and not found.terms.one_way[j] else 0.0,
        offset_ci95=(None, None),
        armature_kg_m2=float(solution.armature[j]),
        armature_file_kg_m2=float(_leader_armature(found.robot)[j]),
        samples=int(np.count_nonzero(found.terms.motion.moving[:, j])),
        rms_file_nm=None,
        rms_nm=None,
        held_out_rms_file_nm=None,
        held_out_rms_nm=None,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Solved:
    robot: RobotModel
    terms: Terms
    unknowns: Unknowns
    solution: Solution
    gains: Gains | None


def _solved(prepared: Sequence[Prepared], config: Config, taken: Candidate) -> _Solved:
    """The solution before what no body can have is mended."""
    robot = prepared[0].robot
    motion = collect(prepared, config.fit.max_samples, config.fit.blocks)
    regressor = robot.torque_regressor(motion.position, motion.velocity, motion.acceleration)
    unknowns, gains = _with_gains(prepared, config, taken, motion, regressor)
    if gains is not None:
        motion = replace(motion, moving=np.asarray(motion.moving & np.isfinite(gains.gain)))
    terms = terms_of(motion, regressor, unknowns)
    return _Solved(robot, terms, *_repaired(terms, unknowns, solve(terms, unknowns), taken.estimate), gains)


@dataclass(frozen=True, slots=True, eq=False)
class _Job(_Solved):
    """A solution of bodies that can be, with its errors."""

    errors: StandardErrors
    estimate: tuple[str, ...]


def _tool(job: _Job, config: Config) -> IdentifiedTool:
    """The tool; what each half of the motion says of it, where they contradict each other."""
    found = identified_tool(job.robot, config, job.unknowns.inertials, job.solution, job.errors)
    moving = job.terms.motion.moving
    first = np.zeros_like(moving)
    first[: len(moving) // 2] = True
    masses, spread = [], []
    for rows in (first, ~first):
        half = job.terms.over(replace(job.terms.motion, moving=np.asarray(moving & rows)))
        solution = solve(half, job.unknowns, HELD_OUT_STEPS)
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


def _joints(job: _Job) -> dict[str, IdentifiedJoint]:
    file_only = replace(
        job.unknowns,
        inertials=job.robot.inertial_parameters,
        inertials_prior_sd=np.zeros_like(job.unknowns.inertials_prior_sd),
        armature_prior_sd=np.zeros_like(job.unknowns.armature_prior_sd),
        armature=_leader_armature(job.robot),
    )
    motion = job.terms.motion
    bare = terms_of(motion, job.terms.regressor, file_only)
    moving = motion.moving
    rms = [_rms(rest, moving) for rest in (residual(bare, solve(bare, file_only)), residual(job.terms, job.solution))]
    out = [_held_out(bare, file_only), _held_out(job.terms, job.unknowns)]
    joints = {}
    for j, name in enumerate(job.robot.joint_names):
        drive = _drive(job, j)
        offset_known = drive.gain is not None and bool(moving[:, j].any()) and not job.terms.one_way[j]
        known = None if drive.gain is None or job.gains is None else _interval(drive.gain, float(job.gains.sd[j]))
        joints[name] = replace(
            drive,
            gain_ci95=known,
            gain_kept=job.gains is not None and bool(job.gains.kept[j]),
            gain_by_load=job.gains is not None and bool(job.gains.by_load[j]),
            offset_ci95=_interval(drive.offset_nm, float(job.errors.offset_sd[j])) if offset_known else (None, None),
            armature_ci95=_armature_interval(job, j),
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


def _held_out(terms: Terms, unknowns: Unknowns) -> list[float | None]:
    """RMS per joint over all blocks of time, each predicted from the other blocks."""
    rest = held_out(terms, unknowns, [terms.motion.block])
    return _rms(rest, np.isfinite(rest))


def _interval(value: float, sd: float) -> Bounds:
    return value - STANDARD_ERRORS_95 * sd, value + STANDARD_ERRORS_95 * sd


def _bodies(robot: RobotModel, solution: Solution) -> dict[str, IdentifiedBody]:
    assert robot.bodies is not None
    original = robot.inertial_parameters
    out = {}
    for k, name in enumerate(robot.bodies.joint_names):
        ten = solution.inertials[10 * k : 10 * k + 10]
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
