"""The configuration as frozen pydantic models: every key, its unit, its default and what it means."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

Vec3 = tuple[float, float, float]
Vec6 = tuple[float, float, float, float, float, float]
Interval = tuple[float, float]
Positive = Annotated[float, Field(gt=0)]
NonNegative = Annotated[float, Field(ge=0)]
ColumnPattern = str | list[int] | list[str]


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class DhRow(_Section):
    """One link of a Denavit-Hartenberg robot."""

    d: float = Field(0.0, description="Offset along z, m (the variable of a prismatic joint).")
    a: float = Field(0.0, description="Length along x, m.")
    alpha: float = Field(0.0, description="Twist about x, rad.")
    theta_offset: float = Field(0.0, description="Added to the joint angle, rad.")
    joint: Literal["revolute", "prismatic"] = Field("revolute", description="Kind of joint.")
    name: str | None = Field(None, description="Joint name; `joint1`, `joint2`, … when absent.")
    mass_kg: NonNegative | None = Field(None, description="Link mass, kg.")
    com_m: Vec3 | None = Field(None, description="Centre of mass in the link frame, m.")
    inertia_kg_m2: Vec6 | None = Field(
        None, description="xx, yy, zz, xy, yz, xz about the centre of mass, link axes, kg·m²."
    )
    effort_limit_nm: Positive | None = Field(None, description="Rated joint torque, N·m.")


class ToolConfig(_Section):
    """What the arm carries."""

    frame: str | None = Field(None, description="Frame of the model the tool is fixed to; the last link when absent.")
    mass_kg: NonNegative | Literal["estimate"] = Field(0.0, description="Tool mass, kg.")
    com_m: Vec3 = Field((0.0, 0.0, 0.0), description="Tool centre of mass in `frame`, m.")


class RobotConfig(_Section):
    """The rigid-body model."""

    urdf: Path | None = Field(None, description="URDF file, relative to this configuration; meshes are not needed.")
    dh_convention: Literal["standard", "modified"] | None = Field(
        None, description="Convention of the `[[robot.dh]]` rows."
    )
    dh: list[DhRow] = Field([], description="Denavit-Hartenberg rows, base to tip.")
    joints: list[str] | None = Field(
        None, description="Judged joints in model order; every moving joint the log has when absent."
    )
    parked: dict[str, float] = Field(
        {}, description="Joints that are not in the log and stand still, and where, rad (m if prismatic)."
    )
    base_rpy_deg: Vec3 = Field((0.0, 0.0, 0.0), description="Roll, pitch, yaw of the base in the world, degrees.")
    gravity_m_s2: Vec3 = Field((0.0, 0.0, -9.80665), description="Gravity in the world, m/s².")
    armature_kg_m2: list[NonNegative] | dict[str, NonNegative] | None = Field(
        None,
        description="Reflected rotor inertia per judged joint (list in the order of `joints`, or by name), kg·m².",
    )
    tool: ToolConfig = Field(ToolConfig(), description="What the arm carries.")

    @model_validator(mode="after")
    def _one_description(self) -> RobotConfig:
        if self.urdf is not None and self.dh:
            raise ValueError("give either urdf or [[robot.dh]] rows, not both")
        if self.dh and self.dh_convention is None:
            raise ValueError('[[robot.dh]] rows need dh_convention = "standard" or "modified"')
        return self


class CsvConfig(_Section):
    """Columns of CSV logs. `{joint}` stands for the log's joint name, `{i}` counts from 1, `{i0}` from 0."""

    time: str | int | None = Field(
        None, description="Time column: its name, or its number (from 1) in headerless files."
    )
    position: ColumnPattern | None = Field(None, description="Position columns: a pattern, names, or numbers from 1.")
    velocity: ColumnPattern | None = Field(None, description="Velocity columns; derived from position when absent.")
    effort: ColumnPattern | None = Field(None, description="Effort columns.")
    temperature: ColumnPattern | None = Field(
        None, description="Joint temperature columns, °C: friction is then compared with them."
    )
    wrench: list[str] | list[int] | None = Field(None, description="Six columns: fx, fy, fz, mx, my, mz.")
    delimiter: str = Field("auto", description="`auto`, or the character between cells.")
    decimal: Literal["auto", ".", ","] = Field("auto", description="Decimal mark.")
    header: bool | Literal["auto"] = Field("auto", description="Whether the first line holds column names.")
    also: list[Path] = Field([], description="Further files with other quantities and the same time column.")
    labels: list[str] = Field(
        [], description="Columns that are neither 0, false nor empty while a flag or a mark of a true event holds."
    )
    phase: str | None = Field(None, description="Column that holds the phase of each row, as a number or a word.")


class FieldsConfig(_Section):
    """Where the joint signals stand in messages of a type that no profile reads: JSON, protobuf or ROS.

    A path is dotted (`state.q`); `a,b` puts fields side by side, `joints[*].pos` takes one field of every item.
    """

    names: str | list[str] | None = Field(
        None, description="Path of the joint names, or the names themselves in the order of the values."
    )
    position: str = Field(description="Path of the positions.")
    velocity: str | None = Field(None, description="Path of the velocities.")
    effort: str | None = Field(None, description="Path of the efforts.")
    temperature: str | None = Field(None, description="Path of the joints' temperatures, °C.")
    stamp: str | None = Field(
        None, description="Paths of the stamp's seconds and nanoseconds: `header.stamp.sec,header.stamp.nanosec`."
    )


class UnitsConfig(_Section):
    """Units of the log. What is not stated is taken from the message type and reported."""

    time: Literal["auto", "s", "ms", "us", "ns", "iso"] = Field("auto", description="Unit of a CSV time column.")
    position: Literal["rad", "deg"] = Field("rad", description="Unit of revolute positions (prismatic: m).")
    velocity: Literal["rad/s", "deg/s"] | None = Field(
        None, description="Unit of revolute velocities; follows `position` when absent."
    )
    effort: Literal["Nm", "A", "raw"] = Field(
        "Nm",
        description="Nm; A, which needs `torque_constant_nm_per_a`; or raw for an unknown unit: friction can then "
        "be fitted in that unit, and nothing can be judged in N·m.",
    )
    torque_constant_nm_per_a: dict[str, Positive] = Field({}, description="Joint torque per ampere, by joint, N·m/A.")
    effort_sign: dict[str, Literal[-1, 1]] = Field({}, description="-1 for a joint whose effort is inverted.")


class LogConfig(_Section):
    """Which signals of a log are meant, and in which units."""

    joint_states: str | None = Field(
        None, description="Topic of the joint states; the one matching the robot when absent."
    )
    wrench: str | None = Field(None, description="Topic of the wrist force/torque sensor.")
    wrench_frame: str | None = Field(None, description="Frame of the model the wrench is measured in.")
    wrench_sign: Literal[-1, 1] = Field(1, description="+1: what the robot does to the environment; -1: the reverse.")
    wrench_bias: Literal["estimate", "calibrated"] | Vec6 = Field(
        "estimate",
        description="Zero offset of the sensor (N, N·m); `estimate`: the median before contact; or `calibrated`: "
        "offset, tool weight and centre that the friction file holds, from poses at rest.",
    )
    effort_delay_ms: float = Field(0.0, description="How much later than the motion the effort is stamped; taken off.")
    wrench_delay_ms: float = Field(0.0, description="How much later than the motion the wrench is stamped; taken off.")
    time: Literal["auto", "header", "log"] = Field("auto", description="Which stamp is the time of a sample.")
    joint_names: dict[str, str] = Field({}, description="Log name = model name, where they differ.")
    label_topics: list[str] = Field(
        [],
        description="Topics of flags or of marks of true events, `/topic` or `/topic:field` or `/topic:field==3`; one "
        "holds while its value is not zero, or is the one given.",
    )
    phase_topic: str | None = Field(
        None, description="Topic, `/topic` or `/topic:field`, whose value (text or whole number) is the phase."
    )
    msg_path: list[Path] = Field(
        [], description="Folders of .msg files, for types whose definitions a log does not hold (--msg-path)."
    )
    fields: FieldsConfig | None = Field(
        None, description="Where the signals of `joint_states` stand, when no profile reads its type."
    )
    csv: CsvConfig = Field(CsvConfig(), description="Columns of CSV logs.")
    units: UnitsConfig = Field(UnitsConfig(), description="Units of the log.")


class ConditioningConfig(_Section):
    """From recorded stamps to a uniform time base."""

    bandwidth_hz: Positive | None = Field(
        None,
        description="-3 dB frequency of the zero-phase filters, Hz; min(20, a fifth of the sample rate) when absent.",
    )
    gap_factor: Annotated[float, Field(gt=1)] = Field(
        1.8, description="A step longer than this many sample periods is a gap."
    )


class SectionsConfig(_Section):
    """Constant-velocity segmentation."""

    min_speed_rad_s: Positive = Field(
        0.005, description="Slower stretches are standing still (rad/s; m/s if prismatic)."
    )
    min_duration_s: Positive = Field(0.15, description="Shorter stretches are rejected.")
    speed_tolerance: Positive = Field(0.05, description="Allowed deviation from the section's mean speed, as a share.")
    speed_tolerance_rad_s: NonNegative = Field(0.003, description="The same, absolute; the larger of the two counts.")
    settle_s: NonNegative = Field(0.05, description="Taken off each end, where the motion has not settled.")
    others_max_speed_rad_s: Positive = Field(0.01, description="Another joint faster than this is moving.")


class FrictionConfig(_Section):
    """Friction identification."""

    model: Literal[
        "auto",
        "static-lugre",
        "coulomb-viscous",
        "damping-coulomb",
        "smooth-coulomb-viscous",
        "asymmetric-coulomb-viscous",
        "stribeck-tustin",
        "stribeck-gauss",
        "rbf",
    ] = Field(
        "auto",
        description="auto: the simplest law that predicts speeds left out of the fit within one standard error of "
        "the best, and whose parameters the data determine.",
    )
    robust: Literal["none", "huber", "bisquare"] = Field(
        "none", description="How outlying friction points are weighed down; their weights are in friction.json."
    )
    file: Path | None = Field(None, description="friction.json to judge with, relative to this configuration.")
    pair_speed_tolerance: Positive = Field(0.05, description="Speeds within this share count as equal.")
    pair_pose_tolerance_rad: Positive = Field(0.05, description="Other joints within this are in the same pose.")


class DynamicConfig(_Section):
    """gamma(t) = base_nm + speed·|v| + acceleration·|a| of one joint."""

    base_nm: Positive = Field(description="Threshold at rest, N·m.")
    speed_nm_s_per_rad: NonNegative = Field(0.0, description="Growth with speed, N·m·s/rad.")
    acceleration_nm_s2_per_rad: NonNegative = Field(0.0, description="Growth with acceleration, N·m·s²/rad.")


class FitConfig(_Section):
    """What ``collaudit fit`` identifies, and from which motion."""

    estimate: list[Literal["friction", "gain", "inertials", "tool"]] = Field(
        ["friction"],
        description="What is identified. All but friction come from any motion and are carried in friction.json; "
        "detect then uses them.",
    )
    motion: Literal["sections", "auto", "any"] = Field(
        "auto",
        description="Where friction is read off: constant-velocity sections; any motion; or auto: sections, and any "
        "motion for joints that have too few.",
    )
    cad_sd: Positive = Field(
        0.2,
        description="How far the robot file's inertials are believed: standard deviation of each, as a share of the "
        "body's mass, mass times size, and mass times size squared.",
    )
    max_samples: Annotated[int, Field(ge=500)] = Field(
        20_000, description="Most samples used of any motion; the loss is stated in friction.json."
    )
    blocks: Annotated[int, Field(ge=2, le=20)] = Field(5, description="Blocks of time held out in turn.")


class DetectConfig(_Section):
    """Rule (6): |residual| above gamma for n samples is a collision."""

    detector: Literal["direct", "momentum", "filtered", "eso", "energy"] = Field(
        "direct", description="How the residual is computed (see detectors.md)."
    )
    compare: list[Literal["direct", "momentum", "filtered", "eso", "energy"]] = Field(
        [], description="Further detectors that judge the same log side by side; the verdict is the first one's."
    )
    causal: bool = Field(
        False,
        description="true: only what a controller had at that instant, with its delay; "
        "false: the best evidence after the fact.",
    )
    observer_gain_per_s: Positive = Field(
        60.0, description="Gain K_O of momentum, filtered, eso and energy, 1/s; the delay is about 1/K_O when causal."
    )
    gamma_nm: Positive | dict[str, Positive] | Literal["dynamic"] = Field(
        4.0, description="Threshold, N·m; one number, or by joint, or `dynamic`: see `dynamic`."
    )
    dynamic: dict[str, DynamicConfig] = Field(
        {},
        description='Thresholds by joint that grow with the motion, for gamma_nm = "dynamic"; every audit proposes '
        "such a table from its clean samples.",
    )
    persistence_ms: Positive | None = Field(
        None, description="Persistence, ms; rounded up to samples. 25 when neither is given."
    )
    n: Annotated[int, Field(ge=1)] | None = Field(
        None, description="Persistence in samples, instead of persistence_ms."
    )
    merge_ms: NonNegative = Field(200.0, description="Exceedances of one joint closer than this are one event, ms.")
    watch: Literal["auto"] | list[str] = Field("auto", description="Joints whose residual is judged.")
    slow_speed_rad_s: Positive | None = Field(
        None,
        description="Below this speed friction is only known as an interval; the slowest fitted speed when absent.",
    )
    reversal_travel_rad: NonNegative = Field(
        0.01,
        description="Travel after a reversal or standstill until friction is steady, rad (m if prismatic).",
    )
    friction_level: Literal["followed", "fixed"] = Field(
        "followed",
        description="followed: the level of friction against its calibration (warm-up) is tracked over a minute; "
        "fixed: taken as calibrated.",
    )
    friction_level_sd: Annotated[float, Field(gt=0, le=0.5)] = Field(
        0.1,
        description="How far friction is expected to be off its calibration (standard deviation, as a share); "
        "what data do not settle raises the threshold.",
    )
    reversals_per_s: Positive = Field(
        0.5, description="A joint in contact that reverses more often than this is taken as force-controlled."
    )
    reversal_amplitude_rad: Positive = Field(0.02, description="… if its strokes are smaller than this.")
    controller_alarms_s: list[float] = Field(
        [],
        description="The controller's own collision alarms, seconds from the log's first sample, to compare with; "
        "labels of the log that are not `true_events` count as such alarms, too.",
    )
    true_events: list[str] = Field(
        [],
        description="Labels of the log (by name, topic or column) that mark what really happened; the detection is "
        "scored against them.",
    )

    @model_validator(mode="after")
    def _one_persistence(self) -> DetectConfig:
        if self.persistence_ms is not None and self.n is not None:
            raise ValueError("give either persistence_ms or n, not both")
        if self.gamma_nm == "dynamic" and not self.dynamic:
            raise ValueError('gamma_nm = "dynamic" needs [detect.dynamic.JOINT] tables')
        return self


class NearMissConfig(_Section):
    """What counts as a near miss."""

    amplitude: Annotated[float, Field(gt=0, lt=1)] = Field(0.8, description="Share of gamma.")
    persistence: Annotated[float, Field(gt=0, lt=1)] = Field(0.5, description="Share of n.")


class PhasesConfig(_Section):
    """When the tool was meant to do what; seconds from the log's first sample."""

    find: Literal["off", "wrench"] = Field(
        "off",
        description="wrench: where no phase is given, find approach, contact and retreat from the measured force.",
    )
    values: dict[str, Literal["free", "approach", "contact", "retreat"]] = Field(
        {},
        description="Phase meant by each value of the log's phase topic or column, where that is not the phase's name.",
    )
    contact_force_n: Positive = Field(3.0, description="Force that tells contact from free motion, N.")
    force_limit_n: Positive | None = Field(
        None,
        description="Largest tool force that is meant, N; what exceeds it is judged. When absent: 1.5 times what 95 % "
        "of the contact stays below, and 5 N more.",
    )
    contact_min_s: Positive = Field(0.5, description="Contacts and separations shorter than this are not phases, s.")
    approach: list[Interval] = Field([], description="No contact yet (t1).")
    contact: list[Interval] = Field([], description="Force-controlled contact (t2).")
    retreat: list[Interval] = Field([], description="No contact any more (t3).")
    force_control: list[Interval] = Field(
        [], description="When force was commanded (t_c); must lie within contact (eq. 1)."
    )

    @field_validator("approach", "contact", "retreat", "force_control")
    @classmethod
    def _ordered(cls, value: list[Interval]) -> list[Interval]:
        for start, end in value:
            if not start < end:
                raise ValueError(f"interval [{start:g}, {end:g}] does not run forward")
        return sorted(value)


class PolicyConfig(_Section):
    """What makes an audit fail, and what makes it unable to judge."""

    max_collisions: Annotated[int, Field(ge=0)] = Field(0, description="More collisions than this break the policy.")
    max_near_misses_per_hour: NonNegative | None = Field(
        None, description="More near misses an hour than this break it."
    )
    min_coverage: Annotated[float, Field(ge=0, le=1)] = Field(
        0.8, description="Least share of a watched joint's moving time that must be judged."
    )


class Config(_Section):
    """A whole collaudit.toml."""

    robot: RobotConfig = Field(RobotConfig(), description="The rigid-body model.")
    log: LogConfig = Field(LogConfig(), description="Which signals of a log are meant, and in which units.")
    conditioning: ConditioningConfig = Field(ConditioningConfig(), description="From stamps to a uniform time base.")
    sections: SectionsConfig = Field(SectionsConfig(), description="Constant-velocity segmentation.")
    friction: FrictionConfig = Field(FrictionConfig(), description="Friction identification.")
    fit: FitConfig = Field(FitConfig(), description="What is identified, and from which motion.")
    detect: DetectConfig = Field(DetectConfig(), description="Rule (6).")
    near_miss: NearMissConfig = Field(NearMissConfig(), description="What counts as a near miss.")
    phases: PhasesConfig = Field(PhasesConfig(), description="When the tool was meant to do what.")
    policy: PolicyConfig = Field(PolicyConfig(), description="What makes an audit fail.")
