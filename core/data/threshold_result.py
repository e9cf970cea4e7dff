"""Result types of thresholds that a fit derives from its own held-out residual, as they stand in friction.json."""

from dataclasses import dataclass, field

from collaudit.core.data.recommendation_result import RangeOfEvidence


@dataclass(frozen=True, slots=True)
class MotionScale:
    """How a joint's contact-free residual scatters with the motion: what of it a contact cannot move.

    sd(t) = base + slow s + speed |v| + arm_speed ||v|| + acceleration a: v the joint's velocity, s how close it is to
    rest (1 at rest, 0 from 0.1 rad/s on), ||v|| the norm over the joints, a the mean size of the joint's acceleration
    over the second around t.

    Attributes:
        base_nm, slow_nm: N·m. speed_nm_s_per_rad, arm_speed_nm_s_per_rad: N·m s/rad. acceleration_nm_s2_per_rad:
            N·m s²/rad.
        usual_nm: its median over the motion of the fit.
    """

    base_nm: float
    slow_nm: float
    speed_nm_s_per_rad: float
    arm_speed_nm_s_per_rad: float
    acceleration_nm_s2_per_rad: float
    usual_nm: float


@dataclass(frozen=True, slots=True)
class ThresholdLevel:
    """Threshold of one joint at one persistence.

    Attributes:
        n: persistence, samples of the fitted logs.
        persistence_s: the same in s.
        gamma_nm: threshold in usual motion; it follows the motion as :class:`MotionScale` has it.
        false_alarms_per_hour: expected of this joint in motion like that of the fit, the threshold's margin not
            counted.
        false_alarms_ci95: its interval.
        exceeded: share of the blocks of the evidence that pass the level all the same: contact that the fit did not
            recognise, or motion that the law does not hold for.
    """

    n: int
    persistence_s: float
    gamma_nm: float
    false_alarms_per_hour: float
    false_alarms_ci95: tuple[float, float]
    exceeded: float = 0.0


@dataclass(frozen=True, slots=True)
class JointThreshold:
    """Thresholds of one joint, with their evidence.

    Attributes:
        levels: by persistence, shortest first; empty when there is no threshold, see ``reason``.
        scale: how the residual scatters with the motion; None without a threshold.
        rest_nm: on top of the threshold where friction is an interval (at rest, just after a reversal): what the
            residual of nine of ten such stretches stayed below.
        noise_nm: robust standard deviation of the held-out residual in motion.
        rms_nm: its root mean square.
        hours: time in motion that supports the thresholds.
        held_out: share of its motion that was judged by a fit without it.
        fastest_rad_s: speed that 99 % of that time stays below (m/s if prismatic).
        reason: why there is no threshold.
        evidence: what that time covers.
    """

    levels: tuple[ThresholdLevel, ...]
    scale: MotionScale | None
    noise_nm: float | None
    rms_nm: float | None
    hours: float
    held_out: float
    fastest_rad_s: float | None
    reason: str | None = None
    evidence: RangeOfEvidence | None = None
    rest_nm: float = 0.0


def detector_key(name: str, causal: bool) -> str:
    """Name of a detector in one of its forms."""
    return f"{name}, {'causal' if causal else 'offline'}"


@dataclass(frozen=True, slots=True)
class FittedThresholds:
    """Thresholds for ``gamma_nm = "auto"``.

    Attributes:
        detector: whose residual they were found on.
        causal: whether it was computed causally.
        joints: by name.
        others: of the other detectors (:func:`detector_key`) by joint the factor on the thresholds.
    """

    detector: str
    causal: bool
    joints: dict[str, JointThreshold] = field(default_factory=dict)
    others: dict[str, dict[str, float]] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class FollowedMotion:
    """How automatic thresholds go with the motion, by joint.

    Attributes:
        scales: of the residual.
        at_rest_nm: on top where friction is an interval.
        lasting_nm: lower thresholds of what lasts.
    """

    scales: dict[str, MotionScale] = field(default_factory=dict)
    at_rest_nm: dict[str, float] = field(default_factory=dict)
    lasting_nm: dict[str, float] = field(default_factory=dict)
