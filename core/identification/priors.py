"""What is known before the data: the robot's description with its spread, and drive gains given it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.config.schema import Config
from collaudit.core.identification.identification_problem import Unknowns, solve, terms_of
from collaudit.core.identification.identification_samples import Motion
from collaudit.core.identification.standard_errors import standard_errors
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.robot.robot_model import RobotModel

_TOOL_MASS_SD, _TOOL_MOMENT_SD = 5.0, 0.5  # kg, kg·m: next to no prior
_SHOWN = 0.2  # a gain is shown by the motion when its standard error is below this share of it
#: Of a joint's inertia: robot files seldom state rotor inertia at all.
ARMATURE_SHARE = 0.5


def inertial_prior_sd(config: Config) -> float:
    """Standard deviation of the described inertials, as a share of them; ``cad_sd`` in the configuration."""
    return config.fit.cad_sd


def unknowns_of(prepared: Sequence[Prepared], robot: RobotModel, estimate: tuple[str, ...], config: Config) -> Unknowns:
    """Priors of all unknowns: the description's inertials, next to nothing for a tool, gains as they look.

    Args:
        prepared: the logs; gains start from the first one's.
        robot: the arm as described.
        estimate: what is to be identified; the rest is held.
        config: how far the description is believed.
    """
    inertials = robot.inertial_parameters
    share = inertial_prior_sd(config)
    sd = _inertials_prior_sd(inertials, share) if "inertials" in estimate else np.zeros_like(inertials)
    if "tool" in estimate:
        last = 10 * (tool_body(robot, config) + 1)
        sd[last - 10] = _TOOL_MASS_SD
        sd[last - 9 : last - 6] = _TOOL_MOMENT_SD
    names = robot.joint_names
    leader = [robot.bodies.joint_names.index(n) for n in names] if robot.bodies else []
    armature = robot.armature[leader]
    armature_prior_sd = np.zeros(len(names))
    if "inertials" in estimate:
        inertia = _joint_inertia(robot, prepared[0])
        armature_prior_sd = np.maximum(share * armature, ARMATURE_SHARE * inertia)
        # rotors behind gears may outweigh a light wrist's link many times: a file that states none says nothing of them
        widest = ARMATURE_SHARE * float(inertia.max())
        armature_prior_sd = np.where(armature > 0, armature_prior_sd, np.maximum(armature_prior_sd, widest))
    gain = np.ones(len(names))
    if "gain" in estimate:
        for found in prepared[0].gains:
            gain[names.index(found.joint)] = found.gain if abs(found.gain) > 1e-6 else 1.0
    return Unknowns(inertials, sd, armature, armature_prior_sd, gain, np.zeros(len(names)))


@dataclass(frozen=True, slots=True, eq=False)
class Gains:
    """Gains (j,), NaN where the motion does not show one, and their standard errors."""

    gain: FloatArray
    sd: FloatArray


def drive_gains(
    motion: Motion,
    regressor: FloatArray,
    unknowns: Unknowns,
    config: Config,
    robot: RobotModel,
    estimate: tuple[str, ...],
) -> Gains:
    """Drive gains given the description's inertials, a tool beside them where it is asked for.

    No motion tells a common scale of gains from one of inertials; so gains come first and are then held.
    """
    sd = np.zeros_like(unknowns.inertials_prior_sd)
    if "tool" in estimate:
        k = 10 * tool_body(robot, config)
        sd[k : k + 4] = unknowns.inertials_prior_sd[k : k + 4]
    count = unknowns.gain.size
    held = replace(
        unknowns,
        inertials_prior_sd=sd,
        armature_prior_sd=0 * unknowns.armature_prior_sd,
        gain_prior_sd=np.full(count, np.inf),
    )
    terms = terms_of(motion, regressor, held)
    first = solve(terms, held)
    error = np.full(first.free.size, np.inf)
    error[first.free] = np.sqrt(np.diag(standard_errors(terms, first, held).covariance))
    error = error[-count:]
    return Gains(np.where(error < _SHOWN * np.abs(first.gain), first.gain, np.nan), error)


def tool_body(robot: RobotModel, config: Config) -> int:
    """Number of the body that carries the tool."""
    assert robot.bodies is not None
    frame = config.robot.tool.frame or robot.bodies.frame_names[-1]
    return robot.bodies.frame_in_joint(frame)[2]


def _inertials_prior_sd(inertials: FloatArray, share: float) -> FloatArray:
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
