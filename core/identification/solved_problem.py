"""The problem of a candidate solved: what is known before the data, drive gains given that, then all other unknowns.

What no body can have is not mended yet.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.config.schema import Config
from collaudit.core.identification.motion_sums import MotionSums
from collaudit.core.identification.sums_solution import Problem, Solution, Unknowns, own_armature
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.stats import STANDARD_ERRORS_95
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.robot.pinocchio_model import point_mass_parameters
from collaudit.core.robot.robot_model import RobotModel
from collaudit.core.torque_table.block_sums import BlockSums, Slope

_TOOL_MASS_SD, _TOOL_MOMENT_SD = 5.0, 0.5  # kg, kg·m: next to no prior
_SHOWN = 0.2  # a gain is shown by the motion when its standard error is below this share of it
#: How far stated torque constants, or an effort stated to be in N·m, are trusted: standard deviation as a share, that
#: of constants of data sheets. A gain that the motion does not determine better stays as stated.
GAIN_SD = 0.2
#: Of a joint's inertia: robot files seldom state rotor inertia at all.
ARMATURE_SHARE = 0.5
#: Samples that tell the middle of a motion.
_FOR_THE_MIDDLE = 10_000
#: Standard errors of a gain by plain regression that make it no chance, and how far the gain may be from it.
_SEEN, _ALIKE = 3.0, (0.5, 2.0)
#: A gain keeps its stated value unless the motion lowers its standard deviation below this share of the prior's.
_DETERMINED = 0.8
#: A gain is told when its standard error is below this share of it; share of the load's torque that is left at least.
_SHOWN_BY_LOADS, _LEFT = 0.1, 0.03
#: A stated mass, and where it is, are right to this share (standard deviation).
_STATED = 0.005


@dataclass(frozen=True, slots=True)
class Candidate:
    """One way to fit.

    Attributes:
        estimate: what is identified beside friction; empty for friction on the description as it is.
        width: standard deviation of the described inertials, as a share of them.
        springs: joints of which a torque by their angle is identified, by number; None for all, where ``spring`` is.
    """

    estimate: tuple[str, ...]
    width: float
    springs: tuple[int, ...] | None = None

    @property
    def words(self) -> str:
        """What it identifies."""
        if "inertials" not in self.estimate:
            return ", ".join(("friction", *self.estimate))
        return f"{', '.join(('friction', *self.estimate))} (description ± {100 * self.width:g} %)"


def unknowns_of(prepared: Sequence[Prepared], robot: RobotModel, candidate: Candidate, config: Config) -> Unknowns:
    """Priors of all unknowns: the description's inertials, next to nothing for a tool, gains as they look.

    Args:
        prepared: the logs; gains start from the first one's.
        robot: the arm as described.
        candidate: what is to be identified, the rest being held, and how far the description is believed.
        config: how far stated gains are believed; the tool's frame.
    """
    inertials, estimate, share = robot.inertial_parameters, candidate.estimate, candidate.width
    sd = inertials_prior_sd(inertials, share) if "inertials" in estimate else np.zeros_like(inertials)
    if "tool" in estimate:
        last = 10 * (robot.in_joint(config.robot.tool.frame)[2] + 1)
        sd[last - 10] = _TOOL_MASS_SD
        sd[last - 9 : last - 6] = _TOOL_MOMENT_SD
    names = robot.joint_names
    armature = own_armature(robot)
    armature_prior_sd = np.zeros(len(names))
    inertia = _joint_inertia(robot, prepared[0])
    # rotors behind gears may outweigh a light wrist's link many times: a file that states none says nothing of them
    unstated = np.where(armature > 0.0, 0.0, ARMATURE_SHARE * float(inertia.max()))
    if {"inertials", "rotor"} & set(estimate) and prepared[0].effort_source != "joint":
        armature_prior_sd = np.maximum(np.maximum(share * armature, ARMATURE_SHARE * inertia), unstated)
    gain, gain_prior_sd = np.ones(len(names)), np.zeros(len(names))
    if "gain" in estimate:
        armature_prior_sd = np.maximum(armature_prior_sd, unstated)
        stated = gains_stated(prepared[0], config)
        gain_prior_sd[:] = GAIN_SD if stated else np.inf
        for found in prepared[0].gains:
            start = found.gain if abs(found.gain) > 1e-6 else 1.0
            gain[names.index(found.joint)] = (-1.0 if found.inverted else 1.0) if stated else start
    springs = None
    if "spring" in estimate:
        springs = np.isin(np.arange(len(names)), range(len(names)) if candidate.springs is None else candidate.springs)
    return Unknowns(inertials, sd, armature, armature_prior_sd, gain, gain_prior_sd, springs)


def gains_stated(prepared: Prepared, config: Config) -> bool:
    """Whether the configuration says what the effort is in N·m: gains of 1 are then the prior and the fallback."""
    units = config.log.units
    stated = units.has_constants or "effort" in units.given
    return stated and prepared.start.series.effort_unit == "Nm"


@dataclass(frozen=True, slots=True, eq=False)
class Gains:
    """Gains (j,), NaN where the motion does not show one and none is stated, and their standard errors.

    ``kept`` (j,) are those that keep their stated value, because the motion tells no better one;
    ``by_load`` those that known loads tell.
    """

    gain: FloatArray
    sd: FloatArray
    kept: BoolArray
    by_load: BoolArray


def drive_gains(
    sums: MotionSums, unknowns: Unknowns, config: Config, robot: RobotModel, estimate: tuple[str, ...]
) -> Gains:
    """Drive gains given the description's inertials, with rotor inertias that are not stated and a tool beside them.

    No motion tells a common scale of gains from one of inertials; so gains come first and are then held.
    """
    sd = np.zeros_like(unknowns.inertials_prior_sd)
    if "tool" in estimate:
        k = 10 * robot.in_joint(config.robot.tool.frame)[2]
        sd[k : k + 4] = unknowns.inertials_prior_sd[k : k + 4]
    moves, prior = sums.count.any(axis=0), unknowns.gain_prior_sd
    rotors = np.where(unknowns.armature > 0.0, 0.0, unknowns.armature_prior_sd)
    free = replace(unknowns, inertials_prior_sd=sd, armature_prior_sd=rotors, gain_prior_sd=np.where(moves, prior, 0.0))
    problem = Problem.of(sums, free)
    first = problem.solved()
    error = np.where(moves, problem.errors(first).gain_sd, np.inf)
    if (first.armature < 0.0).any():  # what no rotor has is left out of the estimate; its interval stays the wider one
        possible = np.where(first.armature < 0.0, 0.0, rotors)
        first = Problem.of(sums, replace(free, armature_prior_sd=possible)).solved()
    seen = _seen(sums, free, first.gain)
    kept = np.isfinite(prior) & ~((error < _DETERMINED * prior) & seen)
    gain = np.where(kept, unknowns.gain, first.gain)
    shown = np.isfinite(prior) | ((error < _SHOWN * np.abs(first.gain)) & seen)
    gain, sd = np.where(shown, gain, np.nan), np.where(kept, prior, error)
    of_loads, loads_sd = _pair_gains(sums)
    by_load = np.isfinite(of_loads)
    gain, sd = np.where(by_load, of_loads, gain), np.where(by_load, loads_sd, sd)
    return Gains(gain, sd, np.asarray(kept & ~by_load), by_load)


def _pair_gains(sums: MotionSums) -> tuple[FloatArray, FloatArray]:
    """Gains from logs that differ by a known load, whatever the arm's own inertials are.

    For joint j of log a:  effort_j = k_j (Y_j pi) + k_j tau_a,j + friction_a,j + noise, with the torque tau_a of the
    log's known load. Y_j pi with any pi, and friction and offset of each log by itself, are projected out: no error of
    the robot's inertials and no warm-up between the logs reaches k_j. What is left of tau_a,j is what the loads differ
    by. Friction that grows with the load has the sign of the motion: sgn v |tau_a,j| is projected out, too.

    Args:
        sums: of all logs together.

    Returns:
        Gains (j,) and standard errors (j,) such that 1.96 of them span 95 %; NaN and inf where the loads do not tell
        one.
    """
    joints, load = sums.count.shape[1], sums.parts["load"]
    gain, sd = np.full(joints, np.nan), np.full(joints, np.inf)
    for j in range(joints):
        if np.unique(sums.log[sums.count[:, j] > 0]).size < 2 or not sums.raw[:, j, load, load].any():
            continue
        found = _load_slope(sums, j)
        if found is not None and found.half < _SHOWN_BY_LOADS * STANDARD_ERRORS_95 * abs(found.value):
            gain[j], sd[j] = found.value, np.hypot(found.half / STANDARD_ERRORS_95, _STATED * found.value)
    return gain, sd


def _load_slope(sums: MotionSums, j: int) -> Slope | None:
    """Of the effort on the load, beside what any arm needs and a law of friction for each log."""
    whole = sums.of(j, "effort", "load", "spin", "base", "axes", "angle", "drift", "law")
    first, logs = whole.names.index("law 0"), np.unique(sums.log)
    laws = len(whole.names) - first
    wider = np.zeros((len(whole.count), len(whole.names), first + laws * logs.size))
    wider[:, range(first), range(first)] = 1.0
    for number, k in enumerate(logs):
        its = np.arange(laws)
        wider[np.ix_(sums.log == k, first + its, first + laws * number + its)] = np.eye(laws)
    names = (*whole.names[:first], *(f"law {k}" for k in range(laws * logs.size)))
    every = BlockSums(names, np.swapaxes(wider, 1, 2) @ whole.products @ wider, whole.count)
    return every.slope(*names[1:], least_own=_LEFT)


def _seen(sums: MotionSums, unknowns: Unknowns, gain: FloatArray) -> BoolArray:
    """(j,) whether the model's torque is in the effort at all, by a regression in the effort's own unit.

    Dividing an effort by a gain makes errors small as the gain grows: a joint whose motion tells nothing can end there.
    """
    out = np.zeros(gain.size, dtype=bool)
    for j in np.flatnonzero(sums.count.any(axis=0)):
        spin = ("spin",) if unknowns.armature_prior_sd[j] > 0.0 else ()
        its = sums.of(int(j), "effort", "model", *spin, "law", "axes", "drift")
        found = its.slope(*its.names[1:], sigmas=_SEEN)
        if found is not None and abs(found.value) > found.half:
            out[j] = _ALIKE[0] < gain[j] / found.value < _ALIKE[1]
    return out


def inertials_prior_sd(inertials: FloatArray, share: float) -> FloatArray:
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
    position = prepared.series.position_rad
    middle = np.nanmedian(position[:: max(1, len(position) // _FOR_THE_MIDDLE)], axis=0)
    pose = np.broadcast_to(middle, (count, count)).copy()
    torque = robot.inverse_dynamics(pose, np.zeros((count, count)), np.eye(count)) - robot.gravity_torque(pose)
    return np.asarray(np.diag(torque) - own_armature(robot))


@dataclass(frozen=True, slots=True, eq=False)
class Solved:
    """A problem with its solution; ``gains`` where any were open."""

    problem: Problem
    solution: Solution
    gains: Gains | None


def solved(prepared: Sequence[Prepared], sums: MotionSums, config: Config, taken: Candidate) -> Solved:
    """The solution before what no body can have is mended, from sums of the logs."""
    unknowns, gains = with_gains(prepared, config, taken, sums)
    problem = Problem.of(sums, unknowns)
    return Solved(*_repaired(problem, problem.solved(), taken.estimate), gains)


def with_gains(
    prepared: Sequence[Prepared], config: Config, taken: Candidate, sums: MotionSums, gains: Gains | None = None
) -> tuple[Unknowns, Gains | None]:
    """Priors of a candidate, with the gains found first (unless given) and then held, NaN where none is told."""
    robot = prepared[0].robot
    unknowns = unknowns_of(prepared, robot, taken, config)
    if "gain" not in taken.estimate:
        return unknowns, None
    gains = gains or drive_gains(sums, unknowns, config, robot, taken.estimate)
    return replace(unknowns, gain=gains.gain, gain_prior_sd=np.zeros_like(gains.gain)), gains


def _repaired(problem: Problem, solution: Solution, estimate: tuple[str, ...]) -> tuple[Problem, Solution]:
    """Solve again with negative rotor inertias held at zero, and with the inertia that a point-mass tool has."""
    unknowns, negative = problem.unknowns, solution.armature < 0
    if negative.any():
        unknowns = replace(
            unknowns,
            armature=np.where(negative, 0.0, unknowns.armature),
            armature_prior_sd=np.where(negative, 0.0, unknowns.armature_prior_sd),
        )
    if "tool" in estimate and "inertials" not in estimate:
        unknowns = replace(
            unknowns, inertials=unknowns.inertials + _point_mass_inertia(unknowns.inertials, solution.inertials)
        )
    if unknowns is problem.unknowns:
        return problem, solution
    again = Problem.of(problem.sums, unknowns)
    return again, again.solved()


def _point_mass_inertia(before: FloatArray, after: FloatArray) -> FloatArray:
    """(p,) inertia that the mass added to each body has about the joint's origin, were it one point."""
    out = np.zeros_like(before)
    for k in range(0, before.size, 10):
        mass, moment = float(after[k] - before[k]), after[k + 1 : k + 4] - before[k + 1 : k + 4]
        if mass > 1e-3:
            out[k + 4 : k + 10] = point_mass_parameters(mass, moment)[4:]
    return out
