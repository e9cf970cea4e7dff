"""The problem of a candidate solved: gains first, then all other unknowns; what no body can have is not mended yet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.config.schema import Config
from collaudit.core.identification.candidates import Candidate
from collaudit.core.identification.priors import Gains, drive_gains, unknowns_of
from collaudit.core.identification.problem.identification_problem import Solution, Unknowns, solve, terms_of
from collaudit.core.identification.problem.identification_samples import Motion, collect
from collaudit.core.identification.problem.problem_terms import Terms
from collaudit.core.identification.tool_estimate import point_mass_inertia
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.robot.robot_model import RobotModel

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


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """Samples of any motion of an arm, and (n, j, p) derivatives of its torques by its inertial parameters there."""

    motion: Motion
    regressor: FloatArray

    @classmethod
    def of(cls, prepared: Sequence[Prepared], config: Config) -> Samples:
        """As many as are configured.

        Raises:
            ConfigError, NotJudgedError: as of :func:`collect`.
        """
        motion = collect(prepared, config.fit.max_samples, config.fit.blocks)
        regressor = prepared[0].robot.torque_regressor(motion.position, motion.velocity, motion.acceleration)
        return cls(motion, regressor)

    def at_most(self, most: int) -> Samples:
        """So many of them, evenly."""
        step = max(1, -(-self.motion.count // most))
        return Samples(self.motion.thinned(step), self.regressor[::step].copy())

    def seen_in(self, prepared: Sequence[Prepared]) -> Samples:
        """The same with the effort of the same logs, of which some may be unknown now."""
        return replace(self, motion=self.motion.with_effort_of(prepared))


def solved(prepared: Sequence[Prepared], samples: Samples, config: Config, taken: Candidate) -> Solved:
    """The solution before what no body can have is mended, from samples of the logs."""
    robot, motion, regressor = prepared[0].robot, samples.motion, samples.regressor
    unknowns, gains = with_gains(prepared, config, taken, motion, regressor)
    if gains is not None:
        motion = replace(motion, moving=np.asarray(motion.moving & np.isfinite(gains.gain)))
    terms = terms_of(motion, regressor, unknowns)
    return Solved(robot, terms, *_repaired(terms, unknowns, solve(terms, unknowns), taken.estimate), gains)


def with_gains(
    prepared: Sequence[Prepared],
    config: Config,
    taken: Candidate,
    motion: Motion,
    regressor: FloatArray,
    gains: Gains | None = None,
) -> tuple[Unknowns, Gains | None]:
    """Priors of a candidate, with the gains found first (unless given) and then held, NaN where none is told."""
    robot = prepared[0].robot
    unknowns = unknowns_of(prepared, robot, taken, config)
    if "gain" not in taken.estimate:
        return unknowns, None
    gains = gains or drive_gains(motion, regressor, unknowns, config, robot, taken.estimate)
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
            unknowns, inertials=unknowns.inertials + point_mass_inertia(unknowns.inertials, solution.inertials)
        )
        again = True
    return unknowns, solve(terms, unknowns) if again else solution
