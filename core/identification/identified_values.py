"""What an identification reports: drives, bodies, base parameters and the tool, with intervals and held-out errors."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.config.schema import Config
from collaudit.core.data.identification_result import (
    AngleTorque,
    BaseParameter,
    Bounds,
    IdentifiedBody,
    IdentifiedJoint,
    IdentifiedTool,
)
from collaudit.core.identification.inertial_parameters import BaseMap, base_map, is_consistent
from collaudit.core.identification.problem.identification_problem import Solution, solve
from collaudit.core.identification.problem.problem_terms import OFFSET, Terms, Unknowns, angle_torque
from collaudit.core.identification.problem.solution_errors import (
    HELD_OUT_STEPS,
    StandardErrors,
    held_out,
    standard_errors,
)
from collaudit.core.identification.solved_problem import ARMATURE_SHARE, MOST_HELD_OUT, Solved, own_armature
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.stats import STANDARD_ERRORS_95, interval_95
from collaudit.core.robot.robot_model import RobotModel

_CONTRADICT = 2.0  # half widths of a 95 % interval, of the difference


@dataclass(frozen=True, slots=True, eq=False)
class Report(Solved):
    """A solution of bodies that can be, with its errors."""

    errors: StandardErrors
    estimate: tuple[str, ...]


def joints_of(job: Report) -> dict[str, IdentifiedJoint]:
    """Drive and rotor of each joint with intervals, and what is left beside what the description leaves."""
    file_only = replace(
        job.unknowns,
        inertials=job.robot.inertial_parameters,
        inertials_prior_sd=np.zeros_like(job.unknowns.inertials_prior_sd),
        armature_prior_sd=np.zeros_like(job.unknowns.armature_prior_sd),
        armature=own_armature(job.robot),
    )
    moving = job.terms.motion.moving
    some = job.terms.motion.at_most(MOST_HELD_OUT)
    out = [_held_out(Terms.of(some, each), each) for each in (file_only, job.unknowns)]
    joints = {}
    for j, name in enumerate(job.robot.joint_names):
        drive = drive_of(job, j)
        offset_known = drive.gain is not None and bool(moving[:, j].any()) and not job.terms.one_way[j]
        known = None if drive.gain is None or job.gains is None else interval_95(drive.gain, float(job.gains.sd[j]))
        joints[name] = replace(
            drive,
            gain_ci95=known,
            gain_kept=job.gains is not None and bool(job.gains.kept[j]),
            gain_by_load=job.gains is not None and bool(job.gains.by_load[j]),
            offset_ci95=interval_95(drive.offset_nm, float(job.errors.offset_sd[j])) if offset_known else (None, None),
            armature_ci95=_armature_interval(job, j),
            angle_torque=_angle_torque(job, j, job.errors.nuisance[j]),
            held_out_rms_file_nm=out[0][j],
            held_out_rms_nm=out[1][j],
        )
    return joints


def drive_of(found: Solved, j: int) -> IdentifiedJoint:
    """Gain, offset and rotor inertia of one joint."""
    solution, gain = found.solution, float(found.solution.gain[j])
    known = bool(np.isfinite(gain))
    return IdentifiedJoint(
        gain=gain if known else None,
        gain_ci95=None,
        offset_nm=float(solution.nuisance[j, OFFSET]) if known and not found.terms.one_way[j] else 0.0,
        offset_ci95=(None, None),
        armature_kg_m2=float(solution.armature[j]),
        armature_file_kg_m2=float(own_armature(found.robot)[j]),
        samples=int(np.count_nonzero(found.terms.motion.moving[:, j])),
        held_out_rms_file_nm=None,
        held_out_rms_nm=None,
        angle_torque=_angle_torque(found, j, None) if known else None,
    )


def _angle_torque(found: Solved, j: int, covariance: FloatArray | None) -> AngleTorque | None:
    """What joint j's angle adds, with intervals where the covariance (k, k) of its nuisance is given."""
    if found.unknowns.springs is None or not found.unknowns.springs[j]:
        return None
    motion, at = found.terms.motion, found.terms.angles_in(found.terms.nuisance, found.terms.motion)
    own = None if covariance is None else covariance[at, at]
    return angle_torque(motion.position[:, j], motion.moving[:, j], found.solution.nuisance[j, at], own)


def _armature_interval(job: Report, j: int) -> Bounds | None:
    """Interval of joint j's rotor inertia, or None where it was held."""
    p = job.solution.inertials.size
    if not job.solution.free[p + j]:
        return None
    at = int(np.count_nonzero(job.solution.free[: p + j]))
    low, high = interval_95(float(job.solution.armature[j]), float(np.sqrt(max(job.errors.covariance[at, at], 0.0))))
    return (max(0.0, low or 0.0), high)


def rms_of(rest: FloatArray, moving: BoolArray) -> list[float | None]:
    """Root mean square of (n, j) values at the samples that count, of each joint."""
    return [
        float(np.sqrt(np.mean(rest[moving[:, j], j] ** 2))) if np.any(moving[:, j]) else None
        for j in range(rest.shape[1])
    ]


def _held_out(terms: Terms, unknowns: Unknowns) -> list[float | None]:
    """RMS per joint over all blocks of time, each predicted from the other blocks."""
    rest = held_out(terms, unknowns, [terms.motion.block])
    return rms_of(rest, np.isfinite(rest))


def bodies_of(robot: RobotModel, solution: Solution) -> dict[str, IdentifiedBody]:
    """Inertial parameters of each body."""
    original = robot.inertial_parameters
    out = {}
    for k, name in enumerate(robot.inertial_bodies().joint_names):
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


def base_parameters_of(job: Report) -> tuple[BaseParameter, ...]:
    """Values, intervals, and how much of the knowledge comes from the data, best known first."""
    base: BaseMap = base_map(job.robot, tuple(job.robot.inertial_bodies().joint_names))
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
        found.append(BaseParameter(name, value, on_file, interval_95(value, float(after[k])), max(0.0, share)))
    return tuple(sorted(found, key=lambda b: -b.from_data))


def tool_of(job: Report, config: Config) -> IdentifiedTool:
    """The tool; what each half of the motion says of it, where they contradict each other."""
    found = identified_tool(job.robot, config, job.unknowns.inertials, job.solution, job.errors)
    moving = job.terms.motion.moving
    first = np.zeros_like(moving)
    first[: len(moving) // 2] = True
    masses, spread = [], []
    for rows in (first, ~first):
        half = replace(job.terms, motion=replace(job.terms.motion, moving=np.asarray(moving & rows)))
        solution = solve(half, job.unknowns, HELD_OUT_STEPS)
        tool = identified_tool(
            job.robot, config, job.unknowns.inertials, solution, standard_errors(half, solution, job.unknowns)
        )
        masses.append(tool.mass_kg)
        spread.append(0.5 * ((tool.mass_ci95[1] or 0.0) - (tool.mass_ci95[0] or 0.0)))
    apart = abs(masses[1] - masses[0]) > _CONTRADICT * float(np.hypot(spread[0], spread[1]))
    return replace(found, mass_halves_kg=(masses[0], masses[1])) if apart else found


def identified_tool(
    robot: RobotModel, config: Config, before: FloatArray, solution: Solution, errors: StandardErrors
) -> IdentifiedTool:
    """Mass and centre of what the tool's body carries: the described tool and what was found on top.

    A tool and the body it is fixed to move as one: what that body's description lacks is taken for the tool.

    Args:
        robot: the arm, the described tool included.
        config: says the tool's frame and the described tool.
        before: (p,) inertials before.
        solution: inertials after.
        errors: how well they are known.
    """
    turn, place, body = robot.in_joint(config.robot.tool.frame)
    k = 10 * body
    mass, com = config.robot.tool.mass_kg, np.array(config.robot.tool.com_m)
    known = 0.0 if isinstance(mass, str) else float(mass)
    at = turn @ com + place
    total = known + float(solution.inertials[k] - before[k])
    moment = known * at + solution.inertials[k + 1 : k + 4] - before[k + 1 : k + 4]
    in_frame = turn.T @ (moment - total * place)
    rows = (np.cumsum(solution.free) - 1)[k : k + 4]
    covariance = errors.covariance[np.ix_(rows, rows)]  # of mass and first moments
    mass_sd, *sd = _in_frame(turn, place, covariance)
    x, y, z = (interval_95(value, error) for value, error in zip(in_frame, sd, strict=True))
    centre = in_frame / total if total > STANDARD_ERRORS_95 * mass_sd else None
    return IdentifiedTool(
        frame=robot.tool_frame,
        mass_kg=total,
        mass_ci95=interval_95(total, mass_sd),
        com_m=None if centre is None else (float(centre[0]), float(centre[1]), float(centre[2])),
        moment_ci95_kg_m=(x, y, z),
    )


def _in_frame(turn: FloatArray, place: FloatArray, covariance: FloatArray) -> list[float]:
    """Standard errors of mass and first moments in a frame of the body, by their covariance (4, 4) in its own axes."""
    jacobian = np.eye(4)  # d(moment in frame) = R^T (dh - dm p)
    jacobian[1:] = np.column_stack([-turn.T @ place, turn.T])
    return [float(x) for x in np.sqrt(np.maximum(np.diag(jacobian @ covariance @ jacobian.T), 0.0))]


def load_sd_of(job: Report, config: Config) -> tuple[float, ...] | None:
    """(4,) by how much a load that like motion tells is off with the arm as identified; None where no load was open."""
    turn, place, body = job.robot.in_joint(config.robot.tool.frame)
    rows = slice(10 * body, 10 * body + 4)
    if not job.solution.free[rows].all():
        return None
    return tuple(_in_frame(turn, place, job.errors.moved((np.cumsum(job.solution.free) - 1)[rows])))


def prior_words(estimate: tuple[str, ...], share: float) -> str:
    """What the description was taken for."""
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
