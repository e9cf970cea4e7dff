"""Identification from any motion: drive gains, inertials and tool, held against blocks of time left out; findings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from collaudit.core.config.schema import Config
from collaudit.core.data.identification_result import Identified
from collaudit.core.findings import Finding, fact
from collaudit.core.identification.identified_values import (
    Report,
    base_parameters_of,
    bodies_of,
    drive_of,
    joints_of,
    load_sd_of,
    prior_words,
    tool_of,
)
from collaudit.core.identification.motion_sums import MotionSums
from collaudit.core.identification.solved_problem import Candidate, Solved, solved
from collaudit.core.identification.sums_solution import Problem, Solution
from collaudit.core.identification.torque_terms import Consistent, is_consistent, make_consistent
from collaudit.core.prepare.prepared import Prepared

#: Possible inertias are kept where they leave no joint more than so many times the residual of the unconstrained ones.
_WORSE = 1.05


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
        joints={name: drive_of(found, j) for j, name in enumerate(robot.joint_names)},
        bodies=bodies_of(robot, solution),
        base_parameters=(),
        tool=None,
        prior=prior_words(estimate, taken.width),
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
    job = Report(problem, final, found.gains, errors, estimate)
    return replace(
        values,
        joints=joints_of(job),
        bodies=bodies_of(robot, final),
        base_parameters=base_parameters_of(job) if "inertials" in estimate else (),
        tool=tool_of(job, config) if "tool" in estimate else None,
        consistent=made.consistent,
        consistency=made.how,
        load_sd=load_sd_of(job, config),
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
