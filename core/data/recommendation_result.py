"""Result types of thresholds: those that are recommended, and those that a fit derives, as in friction.json."""

from dataclasses import dataclass, field
from typing import Literal

Opinion = Literal["too tight", "too loose", "supported", "not judged"]
PersistenceReason = Literal["stated", "set"]


@dataclass(frozen=True, slots=True)
class RangeOfEvidence:
    """What one joint's evidence covers; a log that leaves it is judged by a threshold without evidence there.

    Attributes:
        fastest_rad_s: 99.9 % of the clean time is slower (m/s if prismatic).
        hardest_rad_s2: 99.9 % of it accelerates less.
        least_nm, most_nm: rigid-body torque and friction of all but 0.1 % of it.
        reversals: changes of direction.
        standing: share of it at rest, in slow motion or just after a reversal.
        phases: share of each phase.
        temperature_c: lowest and highest temperature; None where the log has none.
        reversals_per_h: changes of direction an hour; None where not counted.
    """

    fastest_rad_s: float
    hardest_rad_s2: float
    least_nm: float
    most_nm: float
    reversals: int
    standing: float
    phases: dict[str, float]
    temperature_c: tuple[float, float] | None = None
    reversals_per_h: float | None = None


@dataclass(frozen=True, slots=True)
class SetRule:
    """What the evidence says of a threshold that is set.

    Attributes:
        gamma_nm: as set.
        opinion: too tight: motion reaches it by itself; too loose: it is more than half as large again as the
            recommended one; supported; not judged.
        false_alarms_per_hour: of this joint, as counted in its clean time; None where nothing is judged.
        false_alarms_per_hour_upper95: bound.
        unnoticed_nm: (recommended, set): external torques between these would alarm with the recommended threshold and
            do not with the set one; None unless too loose.
        n: persistence that is set, samples: the opinion is on both together.
        recommended_nm: what the evidence asks for at that persistence.
    """

    gamma_nm: float
    opinion: Opinion
    false_alarms_per_hour: float | None
    false_alarms_per_hour_upper95: float | None
    unnoticed_nm: tuple[float, float] | None
    n: int = 0
    recommended_nm: float | None = None


@dataclass(frozen=True, slots=True)
class StretchToConfirm:
    """A stretch that was left out, for a person to say whether something touched the arm.

    Attributes:
        log: its name.
        start_s, end_s: s from the log's first sample.
        why: alarm, near miss or suspicious (an outlier beside the rest).
        joints: that gave cause.
        level_nm: the largest level that one of them kept for n samples: above it gamma would have to lie if nothing
            touched the arm. None where the rule could not fire there.
    """

    log: str
    start_s: float
    end_s: float
    why: str
    joints: tuple[str, ...]
    level_nm: float | None


@dataclass(frozen=True, slots=True)
class CleanPeak:
    """A moment that determines gamma: among the highest levels that count as clean.

    Attributes:
        log: its name.
        time_s: s from the log's first sample.
        level_nm: that the residual kept for n samples.
    """

    log: str
    time_s: float
    level_nm: float


@dataclass(frozen=True, slots=True)
class ArmRate:
    """False alarms of the whole arm at the recommended thresholds, as counted in the clean time.

    Attributes:
        target_per_hour: asked for.
        bound_per_hour: at most this (95 %); None without evidence.
        alarms: that the thresholds would have given.
        supported: whether the target is met by the bound.
        hours: clean hours of the joint that has fewest.
        more_hours: further hours without an alarm that would show the target; 0 when there are enough.
    """

    target_per_hour: float
    bound_per_hour: float | None
    alarms: int
    supported: bool
    hours: float
    more_hours: float


@dataclass(frozen=True, slots=True)
class ThresholdLevel:
    """What the residual of one joint reaches without contact, at one persistence.

    Attributes:
        n: persistence, samples of the fitted logs.
        persistence_s: the same in s.
        gamma_nm: the motion's level: what is reached so seldom as ``false_alarms_per_hour`` says, times ``margin``, and
            a little for the zero of the torque.
        false_alarms_per_hour: expected of this joint in motion like that of the fit, the margin not counted.
        false_alarms_ci95: its interval.
        exceeded: share of the blocks of the evidence that pass the level all the same: contact that the fit did not
            recognise, or motion that the law does not hold for.
        margin: for what other recordings reach beyond this evidence.
        zero_doubt_nm: for the zero of the torque, part of ``gamma_nm``.
        highest_nm: the most that the evidence reaches at this persistence; None in files of before.
    """

    n: int
    persistence_s: float
    gamma_nm: float
    false_alarms_per_hour: float
    false_alarms_ci95: tuple[float, float]
    exceeded: float = 0.0
    margin: float = 1.0
    zero_doubt_nm: float = 0.0
    highest_nm: float | None = None

    @property
    def fitted_nm(self) -> float:
        """What the fitted motion reaches so seldom: the level without what it has for other recordings."""
        return (self.gamma_nm - self.zero_doubt_nm) / self.margin


@dataclass(frozen=True, slots=True)
class JointThreshold:
    """The motion's level of one joint, with its evidence.

    Attributes:
        levels: by persistence, shortest first; empty when there is none, see ``reason``.
        noise_nm: robust standard deviation of the held-out residual in motion.
        rms_nm: its root mean square.
        hours: time in motion that supports the levels.
        held_out: share of its motion that was judged by a fit without it.
        fastest_rad_s: speed that 99 % of that time stays below (m/s if prismatic).
        reason: why there is no level.
        evidence: what that time covers.
        rest_nm: on top of the threshold where friction is an interval (at rest, just after a reversal): what the
            residual of nine of ten such stretches stayed below.
        covered_nm: what friction may be wrong by (95 %) in the motion that the levels were read off, its median:
            they hold so much of it.
    """

    levels: tuple[ThresholdLevel, ...]
    noise_nm: float | None
    rms_nm: float | None
    hours: float
    held_out: float
    fastest_rad_s: float | None
    reason: str | None = None
    evidence: RangeOfEvidence | None = None
    rest_nm: float = 0.0
    covered_nm: float = 0.0


@dataclass(frozen=True, slots=True)
class PlaceForce:
    """A steady force at one place of the arm, in the poses of the fitted motion, from most directions.

    Attributes:
        level_n: from which on it alarms with thresholds at the motion's levels; None where no joint would feel it.
        exerted_n: what the joints' limits let the arm exert there; None where a limit is not known.
    """

    level_n: float | None
    exerted_n: float | None


@dataclass(frozen=True, slots=True)
class FittedThresholds:
    """What ``gamma_nm = "auto"`` and ``"sharpest"`` stand on.

    Attributes:
        detector: whose residual it was found on.
        causal: whether it was computed causally.
        joints: by name.
        forces: by place of the arm.
    """

    detector: str
    causal: bool
    joints: dict[str, JointThreshold] = field(default_factory=dict)
    forces: dict[str, PlaceForce] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class MotionLevels:
    """What motion does by itself, for the rule of one log whose thresholds are automatic, by joint.

    Attributes:
        level_nm: reached by contact-free motion at the rule's persistence.
        at_rest_nm: on top of the threshold where friction is an interval.
        beyond_nm: of joints judged for changes, that of torque beyond what friction holds.
        known: as it stands in friction.json.
    """

    level_nm: dict[str, float] = field(default_factory=dict)
    at_rest_nm: dict[str, float] = field(default_factory=dict)
    beyond_nm: dict[str, float] = field(default_factory=dict)
    known: dict[str, JointThreshold] = field(default_factory=dict)
