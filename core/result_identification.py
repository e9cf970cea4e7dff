"""What was identified besides friction, as it stands in friction.json."""

from __future__ import annotations

from dataclasses import dataclass

Bounds = tuple[float | None, float | None]


@dataclass(frozen=True, slots=True)
class IdentifiedJoint:
    """One joint's drive and the torque that the model leaves.

    Attributes:
        gain: effort per N·m of joint torque: torque = effort / gain - offset_nm; 1 when not estimated, None when
            the motion does not show it: then nothing of this joint is judged.
        gain_ci95: its interval, None when not estimated.
        offset_nm: constant torque that neither model nor friction explains.
        offset_ci95: its interval.
        armature_kg_m2: rotor inertia used from now on.
        armature_file_kg_m2: rotor inertia of the robot's description.
        samples: of this joint in motion.
        rms_file_nm, rms_nm: residual in motion with the inertials of the robot's description, and as identified.
        held_out_rms_file_nm, held_out_rms_nm: the same on blocks of time that were left out.
    """

    gain: float | None
    gain_ci95: Bounds | None
    offset_nm: float
    offset_ci95: Bounds
    armature_kg_m2: float
    armature_file_kg_m2: float
    samples: int
    rms_file_nm: float | None
    rms_nm: float | None
    held_out_rms_file_nm: float | None
    held_out_rms_nm: float | None


@dataclass(frozen=True, slots=True)
class IdentifiedBody:
    """Inertials of the body that a joint moves, tool included, in the joint's axes.

    Attributes:
        mass_kg: mass.
        com_m: centre of mass from the joint's origin.
        parameters: mass, its first moments, inertia about the joint's origin (xx, xy, yy, xz, yz, zz).
        parameters_file: the same of the robot's description.
        consistent: whether a body with positive density can have these parameters.
    """

    mass_kg: float
    com_m: tuple[float, float, float]
    parameters: tuple[float, ...]
    parameters_file: tuple[float, ...]
    consistent: bool


@dataclass(frozen=True, slots=True)
class BaseParameter:
    """A combination of inertial parameters that torques depend on.

    Attributes:
        name: the combination.
        value: as identified.
        value_file: of the robot's description.
        ci95: from data and prior together.
        from_data: share of the knowledge that comes from the data; near 0 the prior speaks alone.
    """

    name: str
    value: float
    value_file: float
    ci95: Bounds
    from_data: float


@dataclass(frozen=True, slots=True)
class IdentifiedTool:
    """Tool as seen by the joint torques: mass and centre of mass in the tool's frame, with intervals.

    Attributes:
        frame: frame of the centre of mass.
        mass_kg: mass.
        mass_ci95: its interval.
        com_m: centre of mass; None when the mass is not clearly above zero.
        moment_ci95_kg_m: intervals of mass times centre (x, y, z) in the frame.
    """

    frame: str
    mass_kg: float
    mass_ci95: Bounds
    com_m: tuple[float, float, float] | None
    moment_ci95_kg_m: tuple[Bounds, Bounds, Bounds]


@dataclass(frozen=True, slots=True)
class Identified:
    """Everything identified from any motion.

    Attributes:
        estimate: what was asked for.
        joints: by name.
        bodies: by the joint that moves them.
        base_parameters: the combinations torques depend on, best known first.
        tool: when asked for.
        prior: what the robot's description was taken for, in words.
        prior_sd: standard deviation of its inertials, as a share.
        consistent: whether every body is physically possible.
        consistency: how that was ensured, in words.
        samples: samples used.
        sample_rate_hz: rate they were taken at.
        loss: what the thinning cost, in words.
    """

    estimate: tuple[str, ...]
    joints: dict[str, IdentifiedJoint]
    bodies: dict[str, IdentifiedBody]
    base_parameters: tuple[BaseParameter, ...]
    tool: IdentifiedTool | None
    prior: str
    prior_sd: float
    consistent: bool
    consistency: str
    samples: int
    sample_rate_hz: float
    loss: str
