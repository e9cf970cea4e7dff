"""The configuration as frozen msgspec structs: every key, its unit, its default and what it means."""

from pathlib import Path, PurePath
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from collaudit.core.config.config_table import ConfigTable, KeyedError, NonNegative, Positive, Vec3, Vec6, about
from collaudit.core.config.schema_judging import (
    CyclesConfig,
    DetectConfig,
    FleetConfig,
    FleetRobot,
    NearMissConfig,
    PhasesConfig,
    PolicyConfig,
)
from collaudit.core.config.schema_log import CsvConfig, FieldsConfig, LogConfig, UnitsConfig
from collaudit.core.friction_laws.law_registry import LAWS, LawChoice

_ByJoint = dict[str, Positive]
__all__ = [
    "ConditioningConfig",
    "Config",
    "CsvConfig",
    "CyclesConfig",
    "DetectConfig",
    "DhRow",
    "FieldsConfig",
    "FitConfig",
    "FleetConfig",
    "FleetRobot",
    "FrictionConfig",
    "LogConfig",
    "NearMissConfig",
    "PhasesConfig",
    "PlanConfig",
    "PolicyConfig",
    "ReportConfig",
    "RobotConfig",
    "SectionsConfig",
    "ToolConfig",
    "UnitsConfig",
]
#: A line that a person writes.
Stated = Annotated[str, Meta(min_length=1, max_length=200)] | None


class PlanConfig(ConfigTable, frozen=True, kw_only=True):
    """What a planned motion (`collaudit plan`) keeps within; what is stated here replaces the description's limits."""

    start_rad: Annotated[
        dict[str, float],
        about(
            "Where the motion starts and ends, by joint, rad (m if prismatic); other joints: the middle of their range."
        ),
    ] = {}
    position_rad: Annotated[
        dict[str, tuple[float, float]],
        about("Lowest and highest position, by joint, rad (m if prismatic); 0.05 at each end is kept free."),
    ] = {}
    speed_rad_s: Annotated[_ByJoint, about("Highest speed, by joint, rad/s (m/s if prismatic).")] = {}
    acceleration_rad_s2: Annotated[
        _ByJoint,
        about("Highest acceleration, by joint, rad/s²; where absent, what takes a second to the highest speed."),
    ] = {}
    torque_nm: Annotated[
        _ByJoint, about("Highest torque of the drive, by joint, N·m (N if prismatic); at most 0.8 of it is asked for.")
    ] = {}
    tool_tip_m: Annotated[
        Vec3 | None,
        about("Where the tool ends, in `[robot.tool] frame`, m; where absent, at the farthest frame of the last link."),
    ] = None
    table_z_m: Annotated[
        float, about("Height of the plane that no link but the first goes below, in the base's axes, m.")
    ] = 0.0
    workspace_m: Annotated[
        tuple[Vec3, Vec3] | None,
        about("Lowest and highest corner of a box that all links but the first stay in, in the base's axes, m."),
    ] = None


class DhRow(ConfigTable, frozen=True, kw_only=True):
    """One link of a Denavit-Hartenberg robot."""

    d: Annotated[float, about("Offset along z, m (the variable of a prismatic joint).")] = 0.0
    a: Annotated[float, about("Length along x, m.")] = 0.0
    alpha: Annotated[float, about("Twist about x, rad.")] = 0.0
    theta_offset: Annotated[float, about("Added to the joint angle, rad.")] = 0.0
    joint: Annotated[Literal["revolute", "prismatic"], about("Kind of joint.")] = "revolute"
    name: Annotated[str | None, about("Joint name; `joint1`, `joint2`, … when absent.")] = None
    mass_kg: Annotated[NonNegative | None, about("Link mass, kg.")] = None
    com_m: Annotated[Vec3 | None, about("Centre of mass in the link frame, m.")] = None
    inertia_kg_m2: Annotated[
        Vec6 | None, about("xx, yy, zz, xy, yz, xz about the centre of mass, link axes, kg·m².")
    ] = None
    effort_limit_nm: Annotated[Positive | None, about("Rated joint torque, N·m.")] = None


class ToolConfig(ConfigTable, frozen=True, kw_only=True):
    """What the arm carries."""

    frame: Annotated[str | None, about("Frame of the model the tool is fixed to; the last link when absent.")] = None
    mass_kg: Annotated[
        NonNegative | Literal["estimate"],
        about(
            "Tool mass, kg. `estimate`: `fit` tells it, and a judged log is judged with what it tells of a load beyond "
            "that, where its motion tells a load from a hand; a pass says so."
        ),
    ] = 0.0
    com_m: Annotated[Vec3, about("Tool centre of mass in `frame`, m.")] = (0.0, 0.0, 0.0)


class RobotConfig(ConfigTable, frozen=True, kw_only=True):
    """The rigid-body model."""

    urdf: Annotated[PurePath | None, about("URDF file, relative to this configuration; meshes are not needed.")] = None
    dh_convention: Annotated[
        Literal["standard", "modified"] | None, about("Convention of the `[[robot.dh]]` rows.")
    ] = None
    dh: Annotated[list[DhRow], about("Denavit-Hartenberg rows, base to tip.")] = []
    joints: Annotated[
        list[str] | None,
        about("Judged joints in model order; when absent, every moving joint that the log has, but a gripper's."),
    ] = None
    parked: Annotated[
        dict[str, float], about("Joints that are not in the log and stand still, and where, rad (m if prismatic).")
    ] = {}
    base_rpy_deg: Annotated[Vec3, about("Roll, pitch, yaw of the base in the world, degrees.")] = (0.0, 0.0, 0.0)
    armature_kg_m2: Annotated[
        list[NonNegative] | dict[str, NonNegative] | None,
        about("Reflected rotor inertia per judged joint (list in the order of `joints`, or by name), kg·m²."),
    ] = None
    reduction: Annotated[
        list[float | list[float]] | dict[str, float] | None,
        about(
            "For logs of the motors' side: motor angle per joint angle, in the order of `joints` or by name; "
            "or a matrix R with q_motor = R q, where motors turn several joints."
        ),
    ] = None
    joint_offset_rad: Annotated[
        list[float] | dict[str, float] | None,
        about("Added to the log's joint angle (after `reduction`): the description's zero, rad (m if prismatic)."),
    ] = None
    motor_side: Annotated[
        list[Literal["position", "velocity", "effort"]], about("Which signals of the log `reduction` is for.")
    ] = msgspec.field(default_factory=lambda: ["position", "velocity", "effort"])
    tool: Annotated[ToolConfig, about("What the arm carries.")] = ToolConfig()

    def __post_init__(self) -> None:
        self.check_kinds("reduction")
        if self.urdf is not None and self.dh:
            raise ValueError("give either urdf or [[robot.dh]] rows, not both")
        if self.dh and self.dh_convention is None:
            raise ValueError('[[robot.dh]] rows need dh_convention = "standard" or "modified"')


class ConditioningConfig(ConfigTable, frozen=True, kw_only=True):
    """From recorded stamps to a uniform time base."""

    bandwidth_hz: Annotated[
        Annotated[float, Meta(ge=0.05)] | None,
        about(
            "-3 dB frequency of the filters of velocity, acceleration and the `direct` residual, Hz; min(20, a "
            "fifth of the sample rate) when absent."
        ),
    ] = None
    velocity: Annotated[
        Literal["auto", "logged", "position"],
        about(
            "auto: the logged velocity, or the derivative of the position where there is none, the two "
            "disagree, or the logged one is late; logged and position: always that one."
        ),
    ] = "auto"


class SectionsConfig(ConfigTable, frozen=True, kw_only=True):
    """Constant-velocity segmentation."""

    min_speed_rad_s: Annotated[
        Positive, about("Below this speed a joint counts as stationary (rad/s; m/s if prismatic).")
    ] = 0.005


class FrictionConfig(ConfigTable, frozen=True, kw_only=True):
    """Friction identification."""

    model: Annotated[
        LawChoice,
        about(
            "auto: the simplest law that predicts speeds left out of the fit, and whose parameters the data determine."
        ),
    ] = "auto"
    file: Annotated[Path | None, about("friction.json to judge with, relative to this configuration.")] = None

    def __post_init__(self) -> None:
        if self.model != "auto" and self.model not in LAWS:
            raise KeyedError("model")


class FitConfig(ConfigTable, frozen=True, kw_only=True):
    """What ``collaudit fit`` identifies, and from which motion."""

    estimate: Annotated[
        Literal["auto"] | list[Literal["friction", "rotor", "gain", "inertials", "tool", "spring"]],
        about(
            "What is identified. auto: friction alone, or with rotor inertia, a tool, or all inertials, "
            "whichever predicts motion left out of the fit best; springs where the motion shows one; gains "
            "too where the effort is a current. What is found is carried in friction.json."
        ),
    ] = "auto"
    motion: Annotated[
        Literal["sections", "auto", "any"],
        about(
            "What friction is estimated from: sections of constant velocity; any motion; or auto: sections, "
            "and any motion for joints whose sections show too little of their speeds."
        ),
    ] = "auto"
    contact: Annotated[
        Literal["find", "labelled", "none"],
        about(
            "Contact in the fitted logs. find: what is inconsistent with the rest is left out; labelled: "
            "what `[detect] true_events` or a truth file marks; none: nothing, and what looks like contact "
            "is reported."
        ),
    ] = "find"
    blocks: Annotated[int, Meta(ge=2, le=20), about("Blocks of time held out in turn.")] = 5


class ReportConfig(ConfigTable, frozen=True, kw_only=True):
    """What stands at the top of a report; nothing is computed from it."""

    robot: Annotated[Stated, about("The robot: type, serial number.")] = None
    tool: Annotated[Stated, about("The tool and what it carries.")] = None
    lab: Annotated[Stated, about("The laboratory or cell.")] = None
    operator: Annotated[Stated, about("Who ran the robot, or answers for the recording.")] = None

    def stated(self) -> dict[str, str]:
        """What is stated, in this order."""
        return {key: text for key in self.__struct_fields__ if (text := getattr(self, key)) is not None}


class Config(ConfigTable, frozen=True, kw_only=True):
    """A whole collaudit.toml."""

    robot: Annotated[RobotConfig, about("The rigid-body model.")] = RobotConfig()
    log: Annotated[LogConfig, about("Which signals of a log are meant, and in which units.")] = LogConfig()
    conditioning: Annotated[ConditioningConfig, about("From stamps to a uniform time base.")] = ConditioningConfig()
    sections: Annotated[SectionsConfig, about("Constant-velocity segmentation.")] = SectionsConfig()
    friction: Annotated[FrictionConfig, about("Friction identification.")] = FrictionConfig()
    fit: Annotated[FitConfig, about("What is identified, and from which motion.")] = FitConfig()
    detect: Annotated[DetectConfig, about("The rule: a residual above γ for n samples in a row is an alarm.")] = (
        DetectConfig()
    )
    cycles: Annotated[CyclesConfig, about("Programs that repeat: which stretches are cycles.")] = CyclesConfig()
    near_miss: Annotated[NearMissConfig, about("What counts as a near miss.")] = NearMissConfig()
    phases: Annotated[PhasesConfig, about("When the tool was meant to do what.")] = PhasesConfig()
    policy: Annotated[PolicyConfig, about("What makes an audit fail.")] = PolicyConfig()
    report: Annotated[ReportConfig, about("What stands at the top of a report.")] = ReportConfig()
    plan: Annotated[PlanConfig, about("What a planned motion keeps within.")] = PlanConfig()
    fleet: Annotated[FleetConfig, about("Many robots: whose a log is, and with what it is judged.")] = FleetConfig()
