"""Identification from any motion: drives, bodies, base parameters and tool, with intervals and held-out errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.config.schema import Config
from collaudit.core.data.identification_result import (
    AngleTorque,
    BaseParameter,
    Bounds,
    Identified,
    IdentifiedBody,
    IdentifiedJoint,
    IdentifiedTool,
)
from collaudit.core.findings import Finding, fact
from collaudit.core.identification.motion_sums import MotionSums
from collaudit.core.identification.solved_problem import ARMATURE_SHARE, Candidate, Solved, solved
from collaudit.core.identification.sums_solution import (
    Problem,
    Solution,
    StandardErrors,
    Unknowns,
    held_out,
    own_armature,
)
from collaudit.core.identification.torque_terms import (
    OFFSET,
    Consistent,
    angle_torque,
    base_map,
    is_consistent,
    make_consistent,
)
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.stats import STANDARD_ERRORS_95, interval_95
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.robot.robot_model import RobotModel

#: Possible inertias are kept where they leave no joint more than so many times the residual of the unconstrained ones.
_WORSE = 1.05
#: The tool was changed where halves of the motion differ by so many half widths of the difference's 95 % interval.
_CONTRADICT = 2.0


@dataclass(frozen=True, slots=True, eq=False)
class _Report(Solved):
    """A solution of bodies that can be, with its errors."""

    errors: StandardErrors


def identify(
    prepared: Sequence[Prepared],
    config: Config,
    taken: Candidate,
    sums: MotionSums,
    only_values: bool = False,
) -> Identified:
    """Identify what a candidate says beyond friction.

    Args:
        prepared: the logs.
        config: how.
        taken: what is identified, something beside friction.
        sums: of the logs, or of what of them is not held out.
        only_values: without intervals and checks of the bodies: what a held-out fit needs.
    """
    estimate, found = taken.estimate, solved(prepared, sums, config, taken)
    problem, solution = found.problem, found.solution
    unknowns, robot = problem.unknowns, problem.sums.robot
    values = Identified(
        estimate=("friction", *estimate),
        joints={name: _drive_of(found, j) for j, name in enumerate(robot.joint_names)},
        bodies=_bodies_of(robot, solution),
        base_parameters=(),
        tool=None,
        prior=_prior_words(estimate, taken.width),
        prior_sd=taken.width,
        consistent=False,
        consistency="",
        samples=problem.sums.rows,
        sample_rate_hz=problem.sums.rate_hz,
        loss=problem.sums.loss,
    )
    if only_values:
        return values
    free = np.concatenate([unknowns.inertials_prior_sd, unknowns.armature_prior_sd, unknowns.gain_prior_sd]) > 0.0
    best, count = np.concatenate([solution.inertials, solution.armature, solution.gain]), unknowns.inertials.size
    made = make_consistent(best, problem.possible_precision(solution, free), free, count // 10)
    best[free] = made.free
    held = Problem.of(problem.sums, unknowns.held(best[:count], best[count : -unknowns.gain.size]))
    final = held.fitted(problem.sums.total, solution)
    made, final = _kept_if_it_fits(found, made, final)
    tool = 10 * robot.in_joint(config.robot.tool.frame)[2]
    errors = problem.errors(solution, slice(tool, tool + 4))
    job = _Report(problem, final, found.gains, errors)
    return replace(
        values,
        joints=_joints_of(job),
        bodies=_bodies_of(robot, final),
        base_parameters=_base_parameters_of(job) if "inertials" in estimate else (),
        tool=_tool_of(job, config) if "tool" in estimate else None,
        consistent=made.consistent,
        consistency=made.how,
        load_sd=_load_sd_of(job, config),
    )


def _kept_if_it_fits(found: Solved, made: Consistent, final: Solution) -> tuple[Consistent, Solution]:
    """What bodies can be, unless the motion speaks against it: a wrong scale of an effort looks like no body at all."""
    free, names = found.solution, found.problem.sums.robot.joint_names
    before, after = (found.problem.rms(one) for one in (free, final))
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


def _joints_of(job: _Report) -> dict[str, IdentifiedJoint]:
    """Drive and rotor of each joint with intervals, and what is left beside what the description leaves."""
    sums, unknowns = job.problem.sums, job.problem.unknowns
    file_only = replace(
        unknowns,
        inertials=sums.robot.inertial_parameters,
        inertials_prior_sd=np.zeros_like(unknowns.inertials_prior_sd),
        armature_prior_sd=np.zeros_like(unknowns.armature_prior_sd),
        armature=own_armature(sums.robot),
    )
    out = [_held_out(sums, each) for each in (file_only, unknowns)]
    joints = {}
    for j, name in enumerate(sums.robot.joint_names):
        drive = _drive_of(job, j)
        offset_known = drive.gain is not None and bool(sums.count[:, j].any()) and not sums.one_way[j]
        known = None if drive.gain is None or job.gains is None else interval_95(drive.gain, float(job.gains.sd[j]))
        joints[name] = replace(
            drive,
            gain_ci95=known,
            gain_kept=job.gains is not None and bool(job.gains.kept[j]),
            gain_by_load=job.gains is not None and bool(job.gains.by_load[j]),
            offset_ci95=interval_95(drive.offset_nm, float(job.errors.offset_sd[j])) if offset_known else (None, None),
            armature_ci95=_armature_interval(job, j),
            angle_torque=_angle_torque(job, j, job.errors.angle[j]),
            held_out_rms_file_nm=out[0][j],
            held_out_rms_nm=out[1][j],
        )
    return joints


def _drive_of(found: Solved, j: int) -> IdentifiedJoint:
    """Gain, offset and rotor inertia of one joint."""
    solution, problem = found.solution, found.problem
    known = bool(np.isfinite(problem.unknowns.gain[j]))
    return IdentifiedJoint(
        gain=float(solution.gain[j]) if known else None,
        gain_ci95=None,
        offset_nm=float(solution.nuisance[j, OFFSET]) if known and not problem.sums.one_way[j] else 0.0,
        offset_ci95=(None, None),
        armature_kg_m2=float(solution.armature[j]),
        armature_file_kg_m2=float(own_armature(problem.sums.robot)[j]),
        samples=int(problem.sums.count[:, j].sum()),
        held_out_rms_file_nm=None,
        held_out_rms_nm=None,
        angle_torque=_angle_torque(found, j, None) if known else None,
    )


def _angle_torque(found: Solved, j: int, covariance: FloatArray | None) -> AngleTorque | None:
    """What joint j's angle adds, with intervals where the covariance (4, 4) of its coefficients is given."""
    if not found.problem.unknowns.sprung[j]:
        return None
    sums = found.problem.sums
    at = sums.columns("angle")
    return angle_torque(sums.angles[j], -found.problem.rest(found.solution)[j, at], covariance)


def _armature_interval(job: _Report, j: int) -> Bounds | None:
    """Interval of joint j's rotor inertia, or None where it was held."""
    if not job.problem.unknowns.armature_prior_sd[j] > 0.0:
        return None
    low, high = interval_95(float(job.solution.armature[j]), float(job.errors.armature_sd[j]))
    return (max(0.0, low or 0.0), high)


def _held_out(sums: MotionSums, unknowns: Unknowns) -> list[float | None]:
    """RMS per joint over all blocks of time, each predicted from the other blocks."""
    count = np.where(np.isfinite(rest := held_out(sums, unknowns, [sums.fold])), sums.weight * sums.count, 0.0)
    mean = np.sum(count * np.nan_to_num(rest) ** 2, axis=0) / np.maximum(count.sum(axis=0), 1e-300)
    return [float(np.sqrt(x)) if n > 0.0 else None for x, n in zip(mean, count.sum(axis=0), strict=True)]


def _bodies_of(robot: RobotModel, solution: Solution) -> dict[str, IdentifiedBody]:
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


def _base_parameters_of(job: _Report) -> tuple[BaseParameter, ...]:
    """Values, intervals, and how much of the knowledge comes from the data, best known first."""
    robot = job.problem.sums.robot
    base = base_map(robot, robot.inertial_bodies().joint_names)
    after = np.sqrt(np.maximum(np.einsum("bp,pq,bq->b", base.matrix, job.errors.inertials, base.matrix), 0.0))
    before = np.sqrt(base.matrix**2 @ job.problem.unknowns.inertials_prior_sd**2)
    found = []
    for k, name in enumerate(base.names):
        value = float(base.matrix[k] @ job.solution.inertials)
        on_file = float(base.matrix[k] @ robot.inertial_parameters)
        share = float(1.0 - (after[k] / before[k]) ** 2) if before[k] > 0 else 0.0
        found.append(BaseParameter(name, value, on_file, interval_95(value, float(after[k])), max(0.0, share)))
    return tuple(sorted(found, key=lambda b: -b.from_data))


def _tool_of(job: _Report, config: Config) -> IdentifiedTool:
    """The tool; what each half of the motion says of it, where they contradict each other."""
    unknowns, sums = job.problem.unknowns, job.problem.sums
    found = _identified_tool(job.problem, job.solution, job.errors, config)
    masses, spread = [], []
    first = np.cumsum(sums.count.sum(axis=1)) <= 0.5 * sums.count.sum()
    for blocks in (first, ~first):
        half = Problem.of(sums.some(blocks), unknowns)
        solution = half.solved()
        tool = _identified_tool(half, solution, half.errors(solution), config)
        masses.append(tool.mass_kg)
        spread.append(0.5 * ((tool.mass_ci95[1] or 0.0) - (tool.mass_ci95[0] or 0.0)))
    apart = abs(masses[1] - masses[0]) > _CONTRADICT * float(np.hypot(spread[0], spread[1]))
    return replace(found, mass_halves_kg=(masses[0], masses[1])) if apart else found


def _identified_tool(problem: Problem, solution: Solution, errors: StandardErrors, config: Config) -> IdentifiedTool:
    """Mass and centre of what the tool's body carries: the described tool and what was found on top.

    A tool and the body it is fixed to move as one: what that body's description lacks is taken for the tool.
    """
    robot, before = problem.sums.robot, problem.unknowns.inertials
    turn, place, body = robot.in_joint(config.robot.tool.frame)
    k = 10 * body
    mass, com = config.robot.tool.mass_kg, np.array(config.robot.tool.com_m)
    known = 0.0 if isinstance(mass, str) else float(mass)
    at = turn @ com + place
    total = known + float(solution.inertials[k] - before[k])
    moment = known * at + solution.inertials[k + 1 : k + 4] - before[k + 1 : k + 4]
    in_frame = turn.T @ (moment - total * place)
    covariance = errors.inertials[k : k + 4, k : k + 4]  # of mass and first moments
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


def _load_sd_of(job: _Report, config: Config) -> tuple[float, ...] | None:
    """(4,) by how much a load that like motion tells is off with the arm as identified; None where no load was open."""
    turn, place, body = job.problem.sums.robot.in_joint(config.robot.tool.frame)
    if not (job.problem.unknowns.inertials_prior_sd[10 * body : 10 * body + 4] > 0.0).all():
        return None
    return tuple(_in_frame(turn, place, job.errors.load))


def _prior_words(estimate: tuple[str, ...], share: float) -> str:
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


def identified_findings(identified: Identified | None) -> list[Finding]:
    """Joints that are explained worse on time left out, and physically impossible inertias."""
    if identified is None:
        return []
    findings = []
    determined = [name for name, joint in identified.joints.items() if joint.gain_by_load]
    if determined:
        others = [name for name in identified.joints if name not in determined]
        rest = f"; they do not determine those of {', '.join(others)}" if others else ""
        text = (
            f"The known loads of the logs determine the drive gains of {', '.join(determined)}, whatever the "
            f"inertials of the arm are{rest}."
        )
        findings.append(fact(text))
    for name, joint in identified.joints.items():
        if joint.gain is None:
            text = f"The motion does not show the gain of joint '{name}': its torque stays unknown and is not judged."
            findings.append(Finding("effort-kind", "warning", text, joint=name))
        if joint.gain_kept:
            text = (
                f"The motion does not determine the gain of joint '{name}' better than it is stated, so the "
                "stated gain is kept. A known load, or motion under more gravity, would determine it."
            )
            findings.append(fact(text, joint=name))
        before, after = joint.held_out_rms_file_nm, joint.held_out_rms_nm
        if before is not None and after is not None and after > 1.02 * before:
            text = (
                f"On held-out time the identified model of joint '{name}' leaves {after:.3g} N·m RMS, the robot's "
                f"description {before:.3g} N·m: the motion of this log is too little for what was to be estimated."
            )
            findings.append(Finding("fit-doubtful", "warning", text, joint=name))
    if identified.tool is not None and identified.tool.mass_halves_kg is not None:
        first, second = identified.tool.mass_halves_kg
        text = (
            f"The tool weighs {first:.3g} kg by the first half of the motion and {second:.3g} kg by the second: it was "
            "changed on the way, or something was picked up. Neither the mass in the file nor its interval holds; fit "
            "each part by itself."
        )
        findings.append(Finding("fit-doubtful", "warning", text))
    odd = [name for name, body in identified.bodies.items() if not body.consistent]
    if odd and not identified.consistent:
        text = f"No rigid body has the inertials identified for: {', '.join(odd)} ({identified.consistency})."
        findings.append(Finding("fit-doubtful", "warning", text))
    return findings
