"""Result types of thresholds that a fit derives from its own held-out residual, as they stand in friction.json."""

from dataclasses import field

from collaudit.core.data.recommendation_result import RangeOfEvidence
from collaudit.core.dataclass import dataclass


@dataclass(frozen=True, slots=True)
class ThresholdLevel:
    """Threshold of one joint at one persistence.

    Attributes:
        n: persistence, samples of the fitted logs.
        persistence_s: the same in s.
        gamma_nm: threshold.
        false_alarms_per_hour: upper bound (95 %) extrapolated from the tail; None where the tail is not known.
    """

    n: int
    persistence_s: float
    gamma_nm: float
    false_alarms_per_hour: float | None


@dataclass(frozen=True, slots=True)
class IsolatedPeak:
    """A stretch whose residual stands alone: contact that was missed, a stop, a fault, or motion unlike all other.

    Attributes:
        log: name of its log.
        start_s, end_s: margins included, seconds from the log's first sample.
        peak_nm: the largest residual in it.
        usual_nm: what four of five seconds in motion of all logs stay below.
        counted: whether thresholds count it all the same, for want of contact elsewhere in its log.
    """

    log: str
    start_s: float
    end_s: float
    peak_nm: float
    usual_nm: float
    counted: bool


@dataclass(frozen=True, slots=True)
class JointThreshold:
    """Thresholds of one joint, with their evidence.

    Attributes:
        levels: by persistence, shortest first; empty when there is no threshold, see ``reason``.
        noise_nm: robust standard deviation of the held-out residual.
        rms_nm: its root mean square.
        hours: time that supports the thresholds, rest and reversals included as far as the rule can fire there.
        held_out: share of its motion whose friction law was fitted without it.
        fastest_rad_s: speed that 99 % of that time stays below (m/s if prismatic).
        reason: why there is no threshold.
        rated_nm: what the description says the drive can exert (N if prismatic); None where it says nothing.
        isolated: peaks that stand alone; empty in files of earlier versions.
        evidence: what that time covers; None in files of earlier versions.
    """

    levels: tuple[ThresholdLevel, ...]
    noise_nm: float | None
    rms_nm: float | None
    hours: float
    held_out: float
    fastest_rad_s: float | None
    reason: str | None = None
    rated_nm: float | None = None
    isolated: tuple[IsolatedPeak, ...] = ()
    evidence: RangeOfEvidence | None = None


@dataclass(frozen=True, slots=True)
class FittedThresholds:
    """Thresholds for ``gamma_nm = "auto"``.

    Attributes:
        detector: whose residual they belong to.
        causal: whether it was computed causally.
        joints: by name.
    """

    detector: str
    causal: bool
    joints: dict[str, JointThreshold] = field(default_factory=dict)
