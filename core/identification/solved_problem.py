"""The problem of a candidate solved: gains first, then all other unknowns; what no body can have is not mended yet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.config.schema import Config
from collaudit.core.identification.candidates import Candidate
from collaudit.core.identification.priors import Gains, drive_gains, unknowns_of
from collaudit.core.identification.problem.identification_problem import Solution, solve
from collaudit.core.identification.problem.identification_samples import Motion
from collaudit.core.identification.problem.problem_terms import Terms, Unknowns
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.robot.robot_model import RobotModel, point_mass_parameters

#: Samples of held-out fits: errors within a tenth of a second are alike, so more would not make their values better.
MOST_HELD_OUT = 5000


@dataclass(frozen=True, slots=True, eq=False)
class Solved:
    """A solution with the problem that it solves; ``gains`` where any were open."""

    robot: RobotModel
    terms: Terms
    unknowns: Unknowns
    solution: Solution
    gains: Gains | None


def solved(prepared: Sequence[Prepared], motion: Motion, config: Config, taken: Candidate) -> Solved:
    """The solution before what no body can have is mended, from samples of the logs."""
    unknowns, gains = with_gains(prepared, config, taken, motion)
    if gains is not None:
        motion = replace(motion, moving=np.asarray(motion.moving & np.isfinite(gains.gain)))
    terms = Terms.of(motion, unknowns)
    solution = solve(terms, unknowns)
    return Solved(prepared[0].robot, terms, *_repaired(terms, unknowns, solution, taken.estimate), gains)


def with_gains(
    prepared: Sequence[Prepared], config: Config, taken: Candidate, motion: Motion, gains: Gains | None = None
) -> tuple[Unknowns, Gains | None]:
    """Priors of a candidate, with the gains found first (unless given) and then held, NaN where none is told."""
    robot = prepared[0].robot
    unknowns = unknowns_of(prepared, robot, taken, config)
    if "gain" not in taken.estimate:
        return unknowns, None
    gains = gains or drive_gains(motion, unknowns, config, robot, taken.estimate)
    return replace(unknowns, gain=gains.gain, gain_prior_sd=np.zeros_like(gains.gain)), gains


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
            unknowns, inertials=unknowns.inertials + _point_mass_inertia(unknowns.inertials, solution.inertials)
        )
        again = True
    return unknowns, solve(terms, unknowns) if again else solution


def _point_mass_inertia(before: FloatArray, after: FloatArray) -> FloatArray:
    """(p,) inertia that the mass added to each body has about the joint's origin, were it one point."""
    out = np.zeros_like(before)
    for k in range(0, before.size, 10):
        mass, moment = float(after[k] - before[k]), after[k + 1 : k + 4] - before[k + 1 : k + 4]
        if mass > 1e-3:
            out[k + 4 : k + 10] = point_mass_parameters(mass, moment)[4:]
    return out
