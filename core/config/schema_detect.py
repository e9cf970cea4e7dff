"""[detect], [near_miss] and [phases]: the rule, and when it applies."""

from typing import Annotated, Literal, Self

from pydantic import Field, field_validator, model_validator

from collaudit.core.config.config_table import ConfigTable, Interval, NonNegative, Positive
from collaudit.core.config.detector_names import DetectorName


class DynamicConfig(ConfigTable):
    """gamma(t) = base_nm + speed·|v| + acceleration·|a| of one joint."""

    base_nm: Positive = Field(description="Threshold at rest, N·m.")
    speed_nm_s_per_rad: NonNegative = Field(0.0, description="Growth with speed, N·m·s/rad.")
    acceleration_nm_s2_per_rad: NonNegative = Field(0.0, description="Growth with acceleration, N·m·s²/rad.")


class EvidenceConfig(ConfigTable):
    """What the evidence behind one joint's gamma covers, as `collaudit recommend --snippet config` writes it."""

    fastest_rad_s: NonNegative = Field(description="Speed, rad/s (m/s if prismatic).")
    hardest_rad_s2: NonNegative = Field(description="Acceleration, rad/s² (m/s²).")
    load_nm: tuple[float, float] = Field(description="Lowest and highest rigid-body torque with friction, N·m.")
    temperature_c: tuple[float, float] | None = Field(None, description="Lowest and highest temperature, °C.")
    phases: list[Literal["free", "approach", "contact", "retreat"]] = Field([], description="Phases; empty: any.")
    standing: bool = Field(True, description="Whether the joint stood or reversed in it.")
    reversals_per_h: NonNegative | None = Field(None, description="Changes of direction an hour; absent: any.")


class DetectConfig(ConfigTable):
    """Rule (6): |residual| above gamma for n samples is a collision."""

    detector: DetectorName = Field("direct", description="How the residual is computed (see detectors.md).")
    compare: list[DetectorName] = Field(
        [], description="Further detectors that judge the same log side by side; the verdict is the first one's."
    )
    causal: bool = Field(
        False,
        description="true: only what a controller had at that instant, with its delay; "
        "false: offline (non-causal), the best evidence a whole log gives.",
    )
    observer_gain_per_s: Annotated[float, Field(ge=0.05)] = Field(
        60.0, description="Gain K_O of momentum, filtered, eso and energy, 1/s; the delay is about 1/K_O when causal."
    )
    gamma_nm: Positive | dict[str, Positive] | Literal["auto", "dynamic"] = Field(
        4.0,
        description="Threshold, N·m (N if prismatic); one number, or by joint; `auto`: of each joint from the held-out "
        "residual of the fit, as kept in the friction file (without one nothing is judged); `dynamic`: see `dynamic`.",
    )
    dynamic: dict[str, DynamicConfig] = Field(
        {},
        description='Thresholds by joint that grow with the motion, for gamma_nm = "dynamic"; every audit proposes '
        "such a table from its clean samples.",
    )
    evidence: dict[str, EvidenceConfig] = Field(
        {},
        description="By joint: the range of the evidence behind gamma_nm; a log outside it gets the finding "
        "`evidence-range`.",
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
        description="Below this speed friction is known only as a range; 0.95 of the slowest fitted one when absent.",
    )
    beyond_range: Annotated[float, Field(ge=0, le=1)] = Field(
        0.5,
        description="Above the fastest fitted speed the threshold is raised by the 95 % interval of the friction curve "
        "there; the joint is judged until that exceeds this share of its friction. 0: not judged above 1.05 times that "
        "speed.",
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
    hand_guiding: Literal["found", "off"] = Field(
        "found",
        description="found: where a person moves the arm and its drives only hold its weight, nothing is judged "
        "(finding `arm-guided`); off: such motion is judged like any other.",
    )
    reversals_per_s: Positive = Field(
        0.5, description="A joint in contact that reverses more often than this is taken as force-controlled."
    )
    reversal_amplitude_rad: Positive = Field(0.02, description="… if its strokes are smaller than this.")
    controller_alarms_s: list[float] = Field(
        [],
        description="The controller's own collision alarms, seconds from the log's first sample, to compare with; "
        "labels of the log that are not `true_events` are compared in the same way, as labels.",
    )
    true_events: list[str] = Field(
        [],
        description="Labels of the log (by name, topic or column) that mark what really happened; the detection is "
        "scored against them.",
    )

    @model_validator(mode="after")
    def _one_persistence(self) -> Self:
        if self.persistence_ms is not None and self.n is not None:
            raise ValueError("give either persistence_ms or n, not both")
        if self.gamma_nm == "dynamic" and not self.dynamic:
            raise ValueError('gamma_nm = "dynamic" needs [detect.dynamic.JOINT] tables')
        return self


class NearMissConfig(ConfigTable):
    """What counts as a near miss."""

    amplitude: Annotated[float, Field(gt=0, lt=1)] = Field(0.8, description="Share of gamma.")
    persistence: Annotated[float, Field(gt=0, lt=1)] = Field(0.5, description="Share of n.")
    impulse: Annotated[float, Field(gt=0, lt=1)] = Field(
        0.4, description="Of a knock shorter than n: share of the impulse (torque × time) of gamma for n samples."
    )


class PhasesConfig(ConfigTable):
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
        description="Largest tool force that is commanded, N; what exceeds it is judged. When absent: 1.5 times what "
        "95 % of the contact stays below, and 5 N more.",
    )
    contact_min_s: Positive = Field(0.5, description="Contacts and separations shorter than this are not phases, s.")
    approach: list[Interval] = Field([], description="No contact yet (t1).")
    contact: list[Interval] = Field([], description="Force-controlled contact (t2).")
    retreat: list[Interval] = Field([], description="No contact any more (t3).")
    force_control: list[Interval] = Field(
        [], description="When force was commanded (t_c); must lie within the contact phase."
    )

    @field_validator("approach", "contact", "retreat", "force_control")
    @classmethod
    def _ordered(cls, value: list[Interval]) -> list[Interval]:
        for start, end in value:
            if not start < end:
                raise ValueError(f"interval [{start:g}, {end:g}] does not run forward")
        return sorted(value)
