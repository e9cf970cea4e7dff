"""Sensor delays, gains, inertials, coupled axes and trends, as friction.json records them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from collaudit.core.numeric.arrays import FloatArray

Bounds = tuple[float | None, float | None]
#: Polynomials in the angle, from degree 1 on: a constant is the offset.
DEGREE = 4
#: What lies this share of the range beyond the angles seen is still known.
_BEYOND = 0.05
#: ``found`` in the residual, by the ``labels`` of the log or a truth file, or none because the log was ``stated`` free.
LeftOutBy = Literal["found", "labels", "stated"]


@dataclass(frozen=True, slots=True)
class Coupling:
    """A motor that turns with more than its own joint.

    Its axis turns at s = sum of weight · joint velocity, and a torque on it acts on each joint with that weight.

    Attributes:
        joint: the joint it belongs to.
        weights: of each joint that it turns with; 1 for its own.
    """

    joint: str
    weights: dict[str, float]

    @property
    def words(self) -> str:
        """The axis as a sum of joints."""
        return " + ".join(f"'{name}'" if w == 1 else f"{w:g}·'{name}'" for name, w in self.weights.items())


@dataclass(frozen=True, slots=True)
class CoupledFriction:
    """Friction and drive inertia on a coupled axis: coulomb·sgn s + viscous·s + inertia·ds/dt.

    Attributes:
        weights: of each joint in the axis' speed s; its torque acts on each joint with the same weight.
        coulomb_nm: N·m on the motor's own joint.
        viscous_nm_s_per_rad: N·m·s/rad.
        inertia_kg_m2: of the drive, kg·m²; None where inertias were not to be identified.
        ci95: of each of these by its name, with the other terms of the joints unknown; open where none is told.
        speed_range_rad_s: slowest and fastest axis speed it was fitted on.
        samples: used.
    """

    weights: dict[str, float]
    coulomb_nm: float
    viscous_nm_s_per_rad: float
    inertia_kg_m2: float | None
    ci95: dict[str, Bounds]
    speed_range_rad_s: tuple[float, float]
    samples: int


def scaled_angle(angle_rad: FloatArray, low_rad: float, high_rad: float) -> FloatArray:
    """Angles from -1 to 1 over a range."""
    return np.asarray((2.0 * angle_rad - low_rad - high_rad) / (high_rad - low_rad))


@dataclass(frozen=True, slots=True)
class AngleTorque:
    """A torque that depends on one joint's angle alone: a spring, a counterbalance, a cable.

    It is given at five angles; between them the polynomial of degree four through them holds.

    Attributes:
        angle_rad: (5,) evenly over the angles seen.
        torque_nm: (5,) there, N·m (N if prismatic), its mean over the motion left to the offset.
        ci95_nm: (5,) their intervals; None where they were not asked for.
    """

    angle_rad: tuple[float, ...]
    torque_nm: tuple[float, ...]
    ci95_nm: tuple[tuple[float, float], ...] | None = None

    def at(self, angle_rad: FloatArray) -> FloatArray:
        """(n,) torque at (n,) angles, N·m; NaN beyond those seen."""
        ends = self.angle_rad[0], self.angle_rad[-1]
        nodes = scaled_angle(np.array(self.angle_rad), *ends)
        x = scaled_angle(angle_rad, *ends)
        through = np.polynomial.legendre.legfit(nodes, np.array(self.torque_nm), DEGREE)
        out = np.polynomial.legendre.legval(np.clip(x, -1.0, 1.0), through)
        return np.asarray(np.where(np.abs(x) <= 1.0 + 2.0 * _BEYOND, out, np.nan))


@dataclass(frozen=True, slots=True)
class IdentifiedJoint:
    """One joint's drive and the torque that the model leaves.

    Attributes:
        gain: effort per N·m of joint torque: torque = effort / gain - offset_nm; 1 when not estimated, None when
            the motion does not show it: then nothing of this joint is judged.
        gain_ci95: its interval, None when not estimated.
        offset_nm: constant torque that neither model nor friction explains, the mean over time; Coulomb friction that
            is not the same both ways is in it. 0 where the joint moves one way only: friction has it then.
        offset_ci95: its interval; open where the motion tells no offset.
        armature_kg_m2: rotor inertia used from now on.
        armature_file_kg_m2: rotor inertia of the robot's description.
        armature_ci95: interval of the rotor inertia used, from data and prior; None where it was not estimated.
        samples: of this joint in motion.
        held_out_rms_file_nm, held_out_rms_nm: residual in motion, on blocks of time that were left out, with the
            inertials of the robot's description, and as identified.
        gain_kept: the gain is the stated one, since the motion tells no better; its interval is that of the statement.
        gain_by_load: the gain follows from logs that differ by a known load, whatever the inertials are.
        angle_torque: what a spring, a counterbalance or a cable adds by the joint's angle; None where none was found.
    """

    gain: float | None
    gain_ci95: Bounds | None
    offset_nm: float
    offset_ci95: Bounds
    armature_kg_m2: float
    armature_file_kg_m2: float
    samples: int
    held_out_rms_file_nm: float | None
    held_out_rms_nm: float | None
    armature_ci95: Bounds | None = None
    gain_kept: bool = False
    gain_by_load: bool = False
    angle_torque: AngleTorque | None = None


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

    @property
    def identified(self) -> bool:
        """Whether these are not those of the description."""
        return self.parameters != self.parameters_file


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
        mass_halves_kg: mass by the first and by the second half of the motion where these contradict each other, as
            when something was picked up in between: no one mass and no interval holds then; else None.
    """

    frame: str
    mass_kg: float
    mass_ci95: Bounds
    com_m: tuple[float, float, float] | None
    moment_ci95_kg_m: tuple[Bounds, Bounds, Bounds]
    mass_halves_kg: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class TriedEstimate:
    """One way to fit, and what it leaves of motion that it was fitted without.

    Attributes:
        what: what is identified.
        held_out_rms_nm: by joint, N·m (N if prismatic), over blocks of time left out, and logs where there are several.
        worse: mean squared error beyond that of the best candidate, in units of the best one's at each joint.
        refused: why it was not a candidate after all; None where it was.
    """

    what: str
    held_out_rms_nm: dict[str, float]
    worse: float
    refused: str | None = None


@dataclass(frozen=True, slots=True)
class EstimateChoice:
    """What was identified, and what else was tried: the simplest within one standard error of the best.

    Attributes:
        taken: of those tried.
        standard_error: of the best one's mean squared error, between stretches of five seconds.
        tried: the simplest first.
        better: what would have been taken, where something else was stated; None where nothing was.
    """

    taken: str
    standard_error: float
    tried: tuple[TriedEstimate, ...]
    better: str | None = None

    def gain_of(self, joint: str) -> float | None:
        """Share that the better way leaves of what is left of a joint's held-out motion; None without a better one."""
        left = {one.what: one.held_out_rms_nm.get(joint) for one in self.tried}
        ours, better = left.get(self.taken), left.get(self.better or "")
        return better / ours if ours and better is not None else None


@dataclass(frozen=True, slots=True)
class Identified:
    """Everything identified from arbitrary motion.

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
        load_sd: (4,) by how much this puts a load off that another log tells: standard errors of its mass, kg, and of
            mass times centre in the tool's frame, kg·m; None where neither bodies nor a tool were identified.
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
    load_sd: tuple[float, ...] | None = None

    @property
    def masses(self) -> bool:
        """Whether any body's inertials were identified: they hold the tool of the fitted logs."""
        return any(body.identified for body in self.bodies.values())


@dataclass(frozen=True, slots=True)
class SensorFacts:
    """The wrist sensor and what hangs on it, from poses at rest. Intervals are 95 %.

    Attributes:
        frame: of the sensor.
        poses: number of poses at rest.
        mass_kg, mass_ci95: mass that the sensor carries.
        com_m, com_ci95: its centre in the sensor's frame; None when the mass is not clearly above zero.
        offset, offset_ci95: reading without load: force N (3), moment N·m (3).
        turn_deg: rotation vector by which the sensor is turned against its frame; None where the poses do not tell.
        turn_half_deg: half width of its interval.
        drift, drift_ci95: change of the six zeros over the log.
        missing: which poses are missing, in words.
    """

    frame: str
    poses: int
    mass_kg: float
    mass_ci95: Bounds
    com_m: tuple[float, float, float] | None
    com_ci95: tuple[Bounds, Bounds, Bounds] | None
    offset: tuple[float, ...]
    offset_ci95: tuple[Bounds, ...]
    turn_deg: tuple[float, float, float] | None
    turn_half_deg: float | None
    drift: tuple[float, ...]
    drift_ci95: tuple[Bounds, ...]
    missing: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class ChannelFacts:
    """Offsets in time of one log's channels, ms behind the positions, and its wrist sensor; None where not told.

    Attributes:
        effort_delay_ms, effort_delay_ci95_ms: of the effort.
        velocity_delay_ms: of the logged velocity, to first order.
        wrench_delay_ms, wrench_delay_ci95_ms: of the wrench.
        sensor: calibration of the wrist sensor.
    """

    effort_delay_ms: float | None
    effort_delay_ci95_ms: Bounds | None
    velocity_delay_ms: float | None
    wrench_delay_ms: float | None
    wrench_delay_ci95_ms: Bounds | None
    sensor: SensorFacts | None


@dataclass(frozen=True, slots=True)
class TrendFit:
    """Where a trend of friction was fitted: at which values of the other, and where the line passes.

    Attributes:
        lowest, highest: of the other.
        mean: of the other, weighted as the fit was.
        level: what friction was off its law at the mean, as a share.
    """

    lowest: float
    highest: float
    mean: float
    level: float


@dataclass(frozen=True, slots=True)
class Trend:
    """How friction of one joint goes with something else, over settled motion.

    Attributes:
        against: ``time``, ``temperature`` or ``load``.
        per_unit: share of friction a minute; share of friction a kelvin; N·m of friction per N·m of load.
        ci95: its interval.
        span: how much of the other there was: minutes, kelvin, N·m.
        log: name of the log.
        fit: of a trend with temperature, °C.
    """

    against: Literal["time", "temperature", "load"]
    per_unit: float
    ci95: Bounds
    span: float
    log: str
    fit: TrendFit | None = None

    @property
    def shown(self) -> bool:
        """Whether the interval excludes zero."""
        low, high = self.ci95
        return low is not None and high is not None and not low <= 0.0 <= high


@dataclass(frozen=True, slots=True)
class FrictionVariation:
    """Trends of one joint's friction; ``untold`` lists what the data cannot determine, and why."""

    trends: tuple[Trend, ...]
    untold: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Identification:
    """Everything a friction file holds besides friction.

    Attributes:
        identified: gains, inertials, tool, when they were asked for.
        channels: by log.
        trends: by joint.
        coupled: friction of axes that turn with several joints, by the motor's own joint.
        choice: what was tried before it was decided what to identify; None where that was not open.
    """

    identified: Identified | None
    channels: dict[str, ChannelFacts]
    trends: dict[str, FrictionVariation]
    coupled: dict[str, CoupledFriction] = field(default_factory=dict)
    choice: EstimateChoice | None = None


@dataclass(frozen=True, slots=True)
class LeftOutSpan:
    """A stretch in which the arm does not behave as in the rest of its log; it is left out in all joints.

    Attributes:
        start_s, end_s: margins included, seconds from the log's first sample.
        joints: those that show it, the clearest first; empty where it was left out by a label.
        peak: the largest residual in it, in robust standard deviations of its joint; None by a label.
    """

    start_s: float
    end_s: float
    joints: tuple[str, ...]
    peak: float | None


@dataclass(frozen=True, slots=True)
class LeftOut:
    """What one log's fit did without.

    Attributes:
        by: how the stretches were chosen.
        spans: in time order; where ``by`` is ``stated``, those that look like contact and were used all the same.
        seconds: their length.
        share: of the time in which the arm moved, margins included.
        share_seen: the same without margins, of the motion of the joint that has the least left.
        refused: whether so much of the log looks like contact that nothing was fitted on it.
        by_joint: share of the motion of each joint in which its own effort looks so; empty by labels.
    """

    by: LeftOutBy
    spans: tuple[LeftOutSpan, ...]
    seconds: float
    share: float
    share_seen: float
    refused: bool
    by_joint: dict[str, float] = field(default_factory=dict)
