"""Result types: what fit, detect and audit found, in the shape of the JSON files they become.

Every class here mirrors one object of ``friction.json`` or ``audit.json`` key by key, so that writing is
``dataclasses.asdict`` and reading is validation against the same classes (``core/files.py``).
Plain Python numbers only; None stands for "not known", never for zero.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from collaudit.core.findings import Finding
from collaudit.core.result_detection import DetectionFacts
from collaudit.core.result_identification import ChannelFacts, Identification, Identified, JointTrends

Verdict = Literal["pass", "fail", "not_judged"]
Phase = Literal["approach", "contact", "retreat", "free"]
FrictionModelName = Literal[
    "static-lugre",
    "coulomb-viscous",
    "damping-coulomb",
    "smooth-coulomb-viscous",
    "asymmetric-coulomb-viscous",
    "stribeck-tustin",
    "stribeck-gauss",
    "rbf",
]
OpenSide = Literal["low", "high", "both"]
Bounds = tuple[float | None, float | None]

FRICTION_SCHEMA = "collaudit/friction/1"
AUDIT_SCHEMA = "collaudit/audit/1"


@dataclass(frozen=True, slots=True)
class FrictionPoint:
    """One (speed, friction) point, eq. (16).

    Attributes:
        speed_rad_s: mean speed (rad/s; m/s if prismatic), positive.
        friction_nm: friction in the file's effort unit.
        sd_nm: spread of the friction over the positions of the section.
        se_nm: standard error of ``friction_nm``, from blocks of positions.
        source: ``pair`` (both directions, eq. 15) or ``model`` (the model's torque was subtracted).
        direction: +1 or -1 for ``model`` points, 0 for pairs.
        others_moving: True when other joints moved in the section.
        weight: share of its weight the point kept in a robust fit; 1 in an ordinary one.
        timing_nm: change of ``friction_nm`` if effort were stamped one standard deviation (0.29 samples) later than
            position; common to all points, in none of their standard errors.
    """

    speed_rad_s: float
    friction_nm: float
    sd_nm: float
    se_nm: float
    source: Literal["pair", "model"]
    direction: int
    others_moving: bool
    weight: float = 1.0
    timing_nm: float = 0.0


@dataclass(frozen=True, slots=True)
class ModelComparison:
    """One friction law beside the others, as ``model = "auto"`` compared them.

    Attributes:
        model: the law.
        parameters: fitted parameters (effective ones of the data-driven law).
        rmse_nm: of all points about its curve.
        held_out_rmse_nm: of points at speeds that were left out of the fit.
        held_out_score: mean square of the held-out errors, each in its point's standard deviation.
        held_out_score_se: standard error of that mean over the folds.
        aicc: corrected Akaike information criterion; only differences mean anything.
        chosen: whether this law was taken.
        note: why it was, why not, or why it could not be compared.
    """

    model: str
    parameters: float | None
    rmse_nm: float | None
    held_out_rmse_nm: float | None
    held_out_score: float | None
    held_out_score_se: float | None
    aicc: float | None
    chosen: bool
    note: str


@dataclass(frozen=True, slots=True)
class Identifiability:
    """What the data say about the parameters of one fit.

    Attributes:
        singular_values: of the Jacobian at the solution, columns scaled to length one, largest first.
        condition: largest over smallest; None when the smallest is zero to rounding.
        correlations: of two parameters' estimates, ``A_nm ~ D_nm_s_per_rad`` to a number in [-1, 1].
        at_bounds: parameters that stand at the edge of what was searched or allowed.
        open_sides: parameters whose interval is infinite, and on which side (its bound is null in ``ci95``).
        motion_needed: what motion would settle what is open.
    """

    singular_values: tuple[float, ...]
    condition: float | None
    correlations: dict[str, float]
    at_bounds: tuple[str, ...]
    open_sides: dict[str, OpenSide]
    motion_needed: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class KnownCombination:
    """A combination of parameters that the data do determine.

    Attributes:
        name: such as ``A + B``.
        value: its estimate.
        ci95: its interval.
        unit: its unit.
    """

    name: str
    value: float
    ci95: Bounds
    unit: str


@dataclass(frozen=True, slots=True)
class FrictionFit:
    """Friction of one joint: parameters, intervals, and what the data could not tell.

    ``parameters`` of static LuGre are A, B, C, D of eq. (11) with unit suffixes (``A_nm``, ``B_nm``,
    ``C_s_per_rad``, ``D_nm_s_per_rad``); Coulomb-viscous has ``A_nm`` and ``D_nm_s_per_rad``. In units other
    than N·m the suffixes say so (``A_raw`` …; prismatic joints ``A_n``, ``C_s_per_m`` …).

    Attributes:
        model: None when the joint could not be fitted; ``reason`` then says why.
        parameters: name to value.
        ci95: name to [low, high], an open side is None; None when there is no interval at all.
        covariance: of the parameters in their order, or None.
        identifiable: whether every parameter of eq. (11), or of the other law that was fitted, is determined
            by the data; a straight line never tells B and C.
        not_identifiable: sentences on what is not known, and why.
        known: combinations that are known where single parameters are not.
        n_points, n_pairs: friction points, and how many of them are pairs.
        speed_range_rad_s: slowest and fastest speed measured.
        rmse_nm: of the points about the curve.
        effort_unit: ``N·m``, ``N`` or ``raw``.
        points: the points.
        reason: why there is no model.
        section_count: constant-velocity sections used.
        rejected: reason to count of rejected stretches.
        comparison: every law that was compared, when the model was chosen automatically.
        identifiability: singular values, correlations, open sides, and what motion would settle them.
        robust: how outlying points were treated: ``none``, ``huber`` or ``bisquare``.
        r_squared: share of the points' variance that the curve explains.
        motion: ``sections`` of constant velocity, or ``any`` motion.
        rmse_share: ``rmse_nm`` as a share of the joint's rated torque, when the robot model states one.
    """

    model: FrictionModelName | None
    parameters: dict[str, float]
    ci95: dict[str, Bounds | None]
    covariance: tuple[tuple[float, ...], ...] | None
    identifiable: bool
    not_identifiable: tuple[str, ...]
    known: tuple[KnownCombination, ...]
    n_points: int
    n_pairs: int
    speed_range_rad_s: tuple[float, float] | None
    rmse_nm: float | None
    effort_unit: str
    points: tuple[FrictionPoint, ...]
    reason: str | None = None
    section_count: int = 0
    rejected: dict[str, int] = field(default_factory=dict)
    comparison: tuple[ModelComparison, ...] = ()
    identifiability: Identifiability | None = None
    robust: str = "none"
    r_squared: float | None = None
    rmse_share: float | None = None
    motion: Literal["sections", "any"] = "sections"


@dataclass(frozen=True, slots=True)
class Provenance:
    """What a result rests on.

    Attributes:
        collaudit: version of this program.
        packages: name to version of what computes.
        config_sha256, friction_sha256, model_sha256: hashes of the inputs, None where there was none.
        logs: name to sha256 of the logs used (friction files).
    """

    collaudit: str
    packages: dict[str, str]
    config_sha256: str | None = None
    friction_sha256: str | None = None
    model_sha256: str | None = None
    logs: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class FrictionFile:
    """``friction.json``.

    ``identified`` is what else was identified, None when only friction was asked for; ``channels`` what was found of
    each log's channels; ``trends`` what moves in each joint's friction.
    """

    schema: str
    joints: dict[str, FrictionFit]
    findings: tuple[Finding, ...]
    provenance: Provenance
    identified: Identified | None = None
    channels: dict[str, ChannelFacts] = field(default_factory=dict)
    trends: dict[str, JointTrends] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class LogFacts:
    """The judged log. ``start`` is an ISO 8601 UTC time or None; ``sample_period_s`` of the uniform base."""

    name: str
    sha256: str
    format: str
    start: str | None
    duration_s: float
    sample_period_s: float
    joints: tuple[str, ...]
    topic: str
    time_source: str


@dataclass(frozen=True, slots=True)
class RuleFacts:
    """Rule (6) as applied. ``gamma_nm`` by judged joint; ``persistence_s`` = n · period."""

    detector: str
    gamma_nm: dict[str, float]
    n: int
    persistence_s: float
    persistence_requested_ms: float | None
    watch: tuple[str, ...]
    near_miss_amplitude: float
    near_miss_persistence: float


@dataclass(frozen=True, slots=True)
class ResidualStats:
    """Level of one joint's residual; None where nothing was judged.

    Attributes:
        mean_abs_nm, rms_nm, p99_nm, max_abs_nm: over all judged samples, collisions included.
        judged_s: seconds judged.
        clean_mean_abs_nm: mean over the judged samples half a second and more away from collisions.
        clean_s: their seconds.
    """

    mean_abs_nm: float | None
    rms_nm: float | None
    p99_nm: float | None
    max_abs_nm: float | None
    judged_s: float
    clean_mean_abs_nm: float | None = None
    clean_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Collision:
    """A run of at least n samples above gamma.

    Attributes:
        joint: watched joint.
        onset_s: first sample above gamma.
        detected_s: the n-th sample above gamma: when the rule fires.
        duration_s: time above gamma.
        peak_nm: largest residual, with its sign.
        gamma_nm: threshold of that joint.
        phase: phase at onset.
    """

    joint: str
    onset_s: float
    detected_s: float
    duration_s: float
    peak_nm: float
    gamma_nm: float
    phase: Phase


@dataclass(frozen=True, slots=True)
class NearMiss:
    """Almost a collision.

    Kind ``amplitude``: n samples above a share of gamma; ``persistence``: above gamma, but too briefly.

    ``ratio`` is |peak|/gamma for amplitude, samples above gamma / n for persistence.
    """

    joint: str
    onset_s: float
    duration_s: float
    peak_nm: float
    gamma_nm: float
    ratio: float
    kind: Literal["amplitude", "persistence"]
    phase: Phase


@dataclass(frozen=True, slots=True)
class RecommendedRule:
    """Recommended threshold for one joint.

    Attributes:
        gamma_nm: rounded up; None when the data do not support one (see ``missing``).
        n: samples.
        largest_clean_nm: the largest level that lasted n samples without a collision.
        margin: gamma_nm / largest_clean_nm.
        clean_hours: judged hours free of events that it rests on.
        false_alarms_per_hour: at the recommended rule at most this, at 95 % confidence, by the tail of the clean
            residual; None where there is too little of it to have a tail.
        false_alarms_per_hour_upper95: one-sided 95 % Poisson bound from those hours alone, without the tail.
        alternatives: (n, gamma_nm) at other persistences, found in the same way.
        missing: what evidence is missing.
    """

    gamma_nm: float | None
    n: int
    largest_clean_nm: float | None
    margin: float | None
    clean_hours: float
    false_alarms_per_hour: float | None
    false_alarms_per_hour_upper95: float | None
    alternatives: tuple[tuple[int, float], ...]
    missing: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class NotJudgedSpan:
    """A longer stretch of a joint that was not judged, and why (reason codes of ``core/residual.py``)."""

    start_s: float
    end_s: float
    reason: str


@dataclass(frozen=True, slots=True)
class JointCoverage:
    """How much of one joint was judged.

    Attributes:
        watched: whether its residual was judged at all.
        why: why it was watched, or why not.
        moving_s: time moving while watched.
        judged_s: time judged by the rule.
        standing_s: time at rest or presliding, where external torque can hide behind friction: only
            torque beyond the friction interval was evidence; never "clean".
        not_judged_s: reason to seconds, over all time.
        spans: the longer stretches not judged.
    """

    watched: bool
    why: str
    moving_s: float
    judged_s: float
    standing_s: float
    not_judged_s: dict[str, float]
    spans: tuple[NotJudgedSpan, ...]


@dataclass(frozen=True, slots=True)
class Coverage:
    """What was judged: recorded seconds, seconds lost in gaps, and per joint."""

    recorded_s: float
    gaps_s: float
    joints: dict[str, JointCoverage]


@dataclass(frozen=True, slots=True)
class PhaseSpan:
    """A phase in seconds from the log's first sample."""

    phase: Phase
    start_s: float
    end_s: float


@dataclass(frozen=True, slots=True)
class AuditResult:
    """``audit.json``: everything one audit of one log found."""

    schema: str
    verdict: Verdict
    reasons: tuple[str, ...]
    log: LogFacts
    rule: RuleFacts
    phases: tuple[PhaseSpan, ...]
    residual: dict[str, ResidualStats]
    collisions: tuple[Collision, ...]
    near_misses: tuple[NearMiss, ...]
    recommended: dict[str, RecommendedRule]
    friction: dict[str, FrictionFit]
    findings: tuple[Finding, ...]
    coverage: Coverage
    provenance: Provenance
    detection: DetectionFacts | None = None
    identification: Identification | None = None
