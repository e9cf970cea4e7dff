"""The configuration as frozen pydantic models: every key, its unit, its default and what it means."""

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from collaudit.core.config.config_table import ConfigTable, NonNegative, Positive, Vec3, Vec6
from collaudit.core.config.schema_detect import DetectConfig, DynamicConfig, NearMissConfig, PhasesConfig
from collaudit.core.config.schema_fleet import FleetConfig, FleetRobot
from collaudit.core.config.schema_log import CsvConfig, FieldsConfig, LogConfig, UnitsConfig
from collaudit.core.config.schema_policy import PolicyConfig, PolicyOverride, Waiver
from collaudit.core.friction_laws.law_registry import LawChoice

__all__ = [
    "ConditioningConfig",
    "Config",
    "CsvConfig",
    "DetectConfig",
    "DhRow",
    "DynamicConfig",
    "FieldsConfig",
    "FitConfig",
    "FleetConfig",
    "FleetRobot",
    "FrictionConfig",
    "LogConfig",
    "NearMissConfig",
    "PhasesConfig",
    "PolicyConfig",
    "PolicyOverride",
    "RobotConfig",
    "SectionsConfig",
    "StudyConfig",
    "ToolConfig",
    "UnitsConfig",
    "Waiver",
]


class DhRow(ConfigTable):
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


class ToolConfig(ConfigTable):
    """What the arm carries."""

    frame: str | None = Field(None, description="Frame of the model the tool is fixed to; the last link when absent.")
    mass_kg: NonNegative | Literal["estimate"] = Field(0.0, description="Tool mass, kg.")
    com_m: Vec3 = Field((0.0, 0.0, 0.0), description="Tool centre of mass in `frame`, m.")


class RobotConfig(ConfigTable):
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
    reduction: list[float] | list[list[float]] | dict[str, float] | None = Field(
        None,
        description="For logs of the motors' side: motor angle per joint angle, in the order of `joints` or by name; "
        "or a matrix R with q_motor = R q where motors turn several joints. Torques follow as Rᵀ tau_motor.",
    )
    joint_offset_rad: list[float] | dict[str, float] | None = Field(
        None,
        description="Added to the log's joint angle (after `reduction`): the description's zero, rad (m if prismatic).",
    )
    motor_side: list[Literal["position", "velocity", "effort"]] = Field(
        ["position", "velocity", "effort"], description="Which signals of the log `reduction` is for."
    )
    tool: ToolConfig = Field(ToolConfig(), description="What the arm carries.")

    @model_validator(mode="after")
    def _one_description(self) -> Self:
        if self.urdf is not None and self.dh:
            raise ValueError("give either urdf or [[robot.dh]] rows, not both")
        if self.dh and self.dh_convention is None:
            raise ValueError('[[robot.dh]] rows need dh_convention = "standard" or "modified"')
        return self


class ConditioningConfig(ConfigTable):
    """From recorded stamps to a uniform time base."""

    bandwidth_hz: Annotated[float, Field(ge=0.05)] | None = Field(
        None,
        description="-3 dB frequency of the filters of velocity, acceleration and the `direct` residual, Hz; min(20, a "
        "fifth of the sample rate) when absent.",
    )
    velocity: Literal["auto", "logged", "position"] = Field(
        "auto",
        description="auto: the logged velocity of a joint, but the derivative of its position where the log has none, "
        "where the two disagree, or where the logged one is late; logged: used in any case, and contradictions "
        "are reported; position: always derived.",
    )
    gap_factor: Annotated[float, Field(gt=1)] = Field(
        1.8, description="A step longer than this many sample periods lost samples: a gap, unless it is bridged."
    )
    bridge_lost: bool = Field(
        True,
        description="Whether lost samples are interpolated where the hole is short against the filter: one sample up "
        "to 0.4, several up to 0.25 of the period of `bandwidth_hz` (20 and 12.5 ms at 20 Hz).",
    )


class SectionsConfig(ConfigTable):
    """Constant-velocity segmentation."""

    min_speed_rad_s: Positive = Field(
        0.005, description="Below this speed a joint counts as stationary (rad/s; m/s if prismatic)."
    )
    min_duration_s: Positive = Field(0.15, description="Shorter stretches are rejected.")
    speed_tolerance: Positive = Field(0.05, description="Allowed deviation from the section's mean speed, as a share.")
    speed_tolerance_rad_s: NonNegative = Field(0.003, description="The same, absolute; the larger of the two counts.")
    settle_s: NonNegative = Field(
        0.1,
        description="Taken off each end, where the motion has not settled; of stretches shorter than eight times as "
        "long an eighth, but half of it at least.",
    )
    others_max_speed_rad_s: Positive = Field(0.01, description="Above this speed another joint counts as moving.")


class FrictionConfig(ConfigTable):
    """Friction identification."""

    model: LawChoice = Field(
        "auto",
        description="auto: the simplest law that predicts speeds left out of the fit within one standard error of "
        "the best, and whose parameters the data determine.",
    )
    robust: Literal["none", "huber", "bisquare"] = Field(
        "none", description="How outliers among friction points are down-weighted; their weights are in friction.json."
    )
    file: Path | None = Field(None, description="friction.json to judge with, relative to this configuration.")
    pair_speed_tolerance: Positive = Field(0.05, description="Speeds within this share count as equal.")
    pair_pose_tolerance_rad: Positive = Field(0.05, description="Other joints within this are in the same pose.")


class FitConfig(ConfigTable):
    """What ``collaudit fit`` identifies, and from which motion."""

    estimate: list[Literal["friction", "gain", "inertials", "tool"]] = Field(
        ["friction"],
        description="What is identified. All but friction come from arbitrary motion and are carried in friction.json; "
        "detect then uses them.",
    )
    motion: Literal["sections", "auto", "any"] = Field(
        "auto",
        description="What friction is estimated from: sections of constant velocity; any, that is arbitrary motion; or "
        "auto: sections, and arbitrary motion for joints whose sections show too few distinct speeds, or too little of "
        "the speeds they move at.",
    )
    contact: Literal["find", "labelled", "none"] = Field(
        "find",
        description="Contact in the logs that are fitted. find: what is inconsistent with the rest is left out; "
        "labelled: what `[detect] true_events` or a truth file marks is left out, and nothing else; none: the logs are "
        "stated to be free of contact, nothing is left out, and what looks like contact is reported.",
    )
    cad_sd: Positive = Field(
        0.2,
        description="How far the robot file's inertials are trusted: standard deviation of each, as a share of the "
        "body's mass, mass times size, and mass times size squared.",
    )
    gain_sd: Positive = Field(
        0.2,
        description="How far stated torque constants, or an effort stated to be in N·m, are trusted where gains are "
        "estimated: standard deviation as a share. A gain that the motion does not determine better stays as stated.",
    )
    max_samples: Annotated[int, Field(ge=500)] = Field(
        20_000,
        description="Most samples used of arbitrary motion; friction.json says what precision this costs.",
    )
    blocks: Annotated[int, Field(ge=2, le=20)] = Field(5, description="Blocks of time held out in turn.")


class StudyConfig(ConfigTable):
    """What is found out about threshold and persistence beside the verdict."""

    run: bool = Field(
        False,
        description="Study threshold and persistence in every audit: alarms, delay and sensitivity over both, with "
        "contacts of known force added to the log. `collaudit recommend` does so for logs without being asked.",
    )
    contacts: Annotated[int, Field(ge=20, le=5000)] = Field(
        200, description="Contacts of each shape that are added to a log, at random places, directions and moments."
    )
    max_delay_ms: Positive | None = Field(
        None, description="A persistence at which a push or knock is noticed later than this is not chosen, ms."
    )
    per_hour: Positive = Field(
        0.001, description="False alarms of the whole arm per hour that the compared thresholds are for."
    )


class Config(ConfigTable):
    """A whole collaudit.toml."""

    robot: RobotConfig = Field(RobotConfig(), description="The rigid-body model.")
    log: LogConfig = Field(LogConfig(), description="Which signals of a log are meant, and in which units.")
    conditioning: ConditioningConfig = Field(ConditioningConfig(), description="From stamps to a uniform time base.")
    sections: SectionsConfig = Field(SectionsConfig(), description="Constant-velocity segmentation.")
    friction: FrictionConfig = Field(FrictionConfig(), description="Friction identification.")
    fit: FitConfig = Field(FitConfig(), description="What is identified, and from which motion.")
    detect: DetectConfig = Field(
        DetectConfig(), description="The rule: a residual above γ for n samples in a row is an alarm."
    )
    near_miss: NearMissConfig = Field(NearMissConfig(), description="What counts as a near miss.")
    phases: PhasesConfig = Field(PhasesConfig(), description="When the tool was meant to do what.")
    policy: PolicyConfig = Field(PolicyConfig(), description="What makes an audit fail.")
    study: StudyConfig = Field(StudyConfig(), description="What is found out about threshold and persistence.")
    fleet: FleetConfig = Field(FleetConfig(), description="Many robots: whose a log is, and with what it is judged.")
