"""Result types: what fit, detect and audit found, in the shape of the JSON files they become.

Every class here mirrors one object of ``friction.json`` or ``audit.json`` key by key, so that writing is
``dataclasses.asdict`` and reading is validation against the same classes (``reports/files/run_files.py``).
Plain Python numbers only; None stands for "not known", never for zero.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from collaudit.core.data import Showing, Shown, first_few
from collaudit.core.data.detection_result import Contact, DetectionFacts, RestDisturbance
from collaudit.core.data.friction_result import FrictionCorrection, FrictionFit
from collaudit.core.data.identification_result import (
    ChannelFacts,
    CoupledFriction,
    EstimateChoice,
    FrictionVariation,
    Identification,
    Identified,
    LeftOut,
)
from collaudit.core.data.recommendation_result import FittedThresholds
from collaudit.core.data.sensitivity_result import Sensitivity
from collaudit.core.data.signals import ArmGeometry, CycleFacts, CycleReference, Signals
from collaudit.core.findings import Finding


@dataclass(frozen=True, slots=True)
class Cause:
    """What would take the residual of a log away, had it been stated; it never changes a verdict.

    Attributes:
        code: friction, scale, zero, delay, swapped, mounting, tool, description, force (in base axes) or pull (in the
            tool's).
        joints: those that it is about; empty for the arm.
        text: in words.
        share: of what the residual has beyond that of the fitted motion, gone in blocks of time that the solve has
            not seen.
        value: parameters: factors less one (of a description one itself); N·m and drift in half the log; s; m/s² of
            gravity in base axes; kg and kg·m at the tool; N.
        ci95: their intervals.
        line: what to state, or to do; empty where nothing helps.
        speaks: it explains most, and enough.
    """

    code: str
    joints: tuple[str, ...]
    text: str
    share: float
    value: tuple[float, ...]
    ci95: tuple[tuple[float, float], ...]
    line: str
    speaks: bool


Verdict = Literal["pass", "fail", "not_judged"]
Phase = Literal["approach", "contact", "retreat", "free"]
NearMissKind = Literal["amplitude", "persistence"]
Spoke = Literal["model", "cycle", "both"]
FRICTION_SCHEMA = "collaudit/friction/1"
AUDIT_SCHEMA = "collaudit/audit/1"


@dataclass(frozen=True, slots=True)
class Provenance:
    """Origin of a result: versions and hashes of its inputs.

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


@dataclass(frozen=True, slots=True, repr=False)
class FrictionFile(Showing):
    """``friction.json``.

    ``identified`` is what else was identified, None when only friction was asked for; ``channels`` what was found of
    each log's channels; ``trends`` what moves in each joint's friction;
    ``coupled`` the friction of axes that turn with several joints, by the motor's own joint.
    ``thresholds`` those for ``gamma_nm = "auto"``; ``corrections`` what a joint's friction goes with besides speed;
    ``left_out`` what the fit did without, by log; ``recorded`` when the first and the last of the logs began, ISO 8601
    UTC, None where one does not tell; ``choice`` what was tried before it was decided what to identify, None where
    that was not open.
    """

    schema: str
    joints: dict[str, FrictionFit]
    findings: tuple[Finding, ...]
    provenance: Provenance
    identified: Identified | None = None
    channels: dict[str, ChannelFacts] = field(default_factory=dict)
    trends: dict[str, FrictionVariation] = field(default_factory=dict)
    coupled: dict[str, CoupledFriction] = field(default_factory=dict)
    thresholds: FittedThresholds | None = None
    corrections: dict[str, FrictionCorrection] = field(default_factory=dict)
    left_out: dict[str, LeftOut] = field(default_factory=dict)
    recorded: tuple[str, str] | None = None
    choice: EstimateChoice | None = None

    @property
    def usable(self) -> tuple[str, ...]:
        """Joints with a law that opposes the motion, and of which no finding says that they cannot be judged."""
        refused = {finding.joint for finding in self.findings if finding.effect == "not-judged-joint"}
        return tuple(name for name, fit in self.joints.items() if fit.model and fit.dissipates and name not in refused)

    def outline(self) -> Shown:
        """Each joint's law and parameters."""
        rows = [
            (name, f"{fit.model}: {', '.join(f'{p} {v:.3g}' for p, v in fit.parameters.items())}")
            if fit.model
            else (name, f"not fitted: {fit.reason}")
            for name, fit in self.joints.items()
        ]
        return f"Friction of {len(self.joints)} joints, from {', '.join(self.provenance.logs) or 'no log'}", rows


@dataclass(frozen=True, slots=True)
class LogFacts:
    """The judged log. ``start`` is an ISO 8601 UTC time or None; ``sample_period_s`` of the uniform base.

    ``units`` by joint of what its drive exerts: ``N·m``, or ``N`` of a prismatic joint, whose thresholds and residuals
    (``*_nm``) are forces and whose positions and speeds (``*_rad``) are m and m/s.
    """

    name: str
    sha256: str
    format: str
    start: str | None
    duration_s: float
    sample_period_s: float
    joints: tuple[str, ...]
    topic: str
    time_source: str
    units: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class RuleFacts:
    """Rule (6) as applied. ``gamma_nm`` by judged joint; ``persistence_s`` = n · period.

    ``near_miss_nm`` from which level on n samples are a near miss; ``near_miss_persistence`` the share of n from which
    on fewer samples above gamma are one. ``motion_nm`` what contact-free motion reaches by the friction file, where
    thresholds follow from it. ``at_rest_nm`` comes on top where friction is known only as a range. What is in force at
    each sample is in the signals.
    """

    detector: str
    gamma_nm: dict[str, float]
    n: int
    persistence_s: float
    persistence_requested_ms: float | None
    watch: tuple[str, ...]
    near_miss_nm: dict[str, float]
    near_miss_persistence: float
    motion_nm: dict[str, float] = field(default_factory=dict)
    at_rest_nm: dict[str, float] = field(default_factory=dict)

    def below_gamma_nm(self, joint: str) -> float:
        """How far below the threshold in force a near miss of a joint begins."""
        return self.gamma_nm[joint] - self.near_miss_nm[joint]


@dataclass(frozen=True, slots=True)
class ResidualStats:
    """Level of one joint's residual; None where nothing was judged.

    Attributes:
        mean_abs_nm, rms_nm, p99_nm, max_abs_nm: over all judged samples, collisions included.
        judged_s: seconds judged.
        clean_mean_abs_nm: mean over the judged samples half a second and more away from collisions.
        clean_s: their seconds.
        temperature_c: mean temperature of the joint, °C; None where the log has none.
        temperature_range_c: lowest and highest; None where the log has none.
    """

    mean_abs_nm: float | None
    rms_nm: float | None
    p99_nm: float | None
    max_abs_nm: float | None
    judged_s: float
    clean_mean_abs_nm: float | None = None
    clean_s: float = 0.0
    temperature_c: float | None = None
    temperature_range_c: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class Collision:
    """A run of at least n samples above gamma.

    Attributes:
        joint: watched joint.
        onset_s: first sample above it.
        detected_s: when the rule fires: the n-th sample above it in a row.
        duration_s: time above it.
        peak_nm: largest residual, with its sign.
        gamma_nm: the threshold in force at the peak.
        phase: phase at onset.
        spoke: which residual is above its threshold: what the model leaves, what the same place of other cycles leaves
            (``peak_nm`` and ``gamma_nm`` are then of that), or both (of the model's).
    """

    joint: str
    onset_s: float
    detected_s: float
    duration_s: float
    peak_nm: float
    gamma_nm: float
    phase: Phase
    spoke: Spoke = "model"


@dataclass(frozen=True, slots=True)
class NearMiss:
    """Beyond what motion does and short of an alarm.

    Kind ``amplitude``: n samples above the level of a near miss, none of them n times in a row above gamma;
    ``persistence``: above gamma, but too briefly. ``gamma_nm`` is the threshold in force at the peak.

    ``ratio``: for amplitude the largest share of the threshold in force that n samples in a row kept, below 1; for
    persistence samples above gamma / n.

    ``spoke``: as of :class:`Collision`.
    """

    joint: str
    onset_s: float
    duration_s: float
    peak_nm: float
    gamma_nm: float
    ratio: float
    kind: NearMissKind
    phase: Phase
    spoke: Spoke = "model"


@dataclass(frozen=True, slots=True)
class RecommendedRule:
    """Recommended threshold for one joint.

    Attributes:
        gamma_nm: three digits; None when the data do not support one (see ``missing``).
        n: samples.
        motion_nm: what contact-free motion reaches by itself, with the doubt of little evidence.
        largest_clean_nm: the largest level that lasted n samples without a collision.
        clean_hours: judged hours free of events that support it.
        false_alarms_per_hour_upper95: one-sided 95 % Poisson bound from the alarms that it would have given in them.
        missing: what evidence is missing.
        noticed_nm: an external torque of this size that lasts n samples is noticed at 95 % of the moments, whatever the
            residual is: gamma and the residual's 95 % quantile.
    """

    gamma_nm: float | None
    n: int
    motion_nm: float | None
    largest_clean_nm: float | None
    clean_hours: float
    false_alarms_per_hour_upper95: float | None
    missing: tuple[str, ...]
    noticed_nm: float | None = None


@dataclass(frozen=True, slots=True)
class NotJudgedSpan:
    """A longer stretch of a joint that was not judged, and why (reason codes of ``core/residual/residual.py``)."""

    start_s: float
    end_s: float
    reason: str


@dataclass(frozen=True, slots=True)
class JointCoverage:
    """How much of one joint was judged.

    Attributes:
        watched: whether its residual was judged at all.
        why: why it was watched, or why not.
        moving_s: time moving while watched; lost time counts as moving unless the joint rested at one place around it.
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

    @property
    def lost_s(self) -> float:
        """Time not judged, for whatever reason: time in which it was not watched, too."""
        return sum(self.not_judged_s.values())

    @property
    def time_s(self) -> float:
        """All time of the joint, which every share of it is a share of."""
        return self.judged_s + self.standing_s + self.lost_s


@dataclass(frozen=True, slots=True)
class Coverage:
    """What was judged: seconds recorded, lost in gaps or to missing values, and per joint.

    Attributes:
        recorded_s: seconds recorded.
        gaps_s: seconds lost in gaps; rows without the position of every joint are lost too.
        joints: per joint.
        missing_s: recorded seconds that lack a measurement of a watched joint; for a pass they are gaps.
    """

    recorded_s: float
    gaps_s: float
    joints: dict[str, JointCoverage]
    missing_s: float = 0.0

    @property
    def lost_s(self) -> float:
        """Seconds of gaps and of missing measurements."""
        return self.gaps_s + self.missing_s

    @property
    def whole_s(self) -> float:
        """Seconds of the log, gaps included."""
        return self.recorded_s + self.gaps_s


@dataclass(frozen=True, slots=True)
class PhaseSpan:
    """A phase in seconds from the log's first sample."""

    phase: Phase
    start_s: float
    end_s: float


@dataclass(frozen=True, slots=True)
class PolicyLimits:
    """What ``[policy]`` allows one log: contacts, near misses an hour (None: any), share of motion to be judged."""

    max_collisions: int
    max_near_misses_per_hour: float | None
    min_coverage: float


@dataclass(frozen=True, slots=True, repr=False)
class AuditResult(Showing):
    """``audit.json``: everything one audit of one log found.

    Attributes:
        collisions: the alarms of single joints.
        contacts: the alarms that belong together, one each contact: what headline, policy and exit codes count.
        exclusions: what the verdict does not cover: time and joints that were not judged, torque that friction hid.
        sensitivity: how small a torque or force would have alarmed, for how much of the time; None where not told.
        disturbances: pushes on standing joints below what alarms, which friction hides but for their steps.
        unjudged: why the log cannot pass, whatever happened in it; a log that fails may have such reasons, too.
        stated: what ``[report]`` states of robot, tool, lab and operator.
        limits: what values were held against; None in files of earlier versions.
        arm: its kinematics for drawings; None without a description, and in files of earlier versions.
        causes: what would explain a residual that is off, the best first; none where nothing does.
        cycles: of a program that repeats; None where nothing does.
    """

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
    contacts: tuple[Contact, ...] = ()
    exclusions: tuple[str, ...] = ()
    sensitivity: Sensitivity | None = None
    disturbances: tuple[RestDisturbance, ...] = ()
    unjudged: tuple[str, ...] = ()
    stated: dict[str, str] = field(default_factory=dict)
    limits: PolicyLimits | None = None
    arm: ArmGeometry | None = None
    causes: tuple[Cause, ...] = ()
    cycles: CycleFacts | None = None

    def outline(self) -> Shown:
        """Verdict, reasons, what it does not cover, counts of events, the rule, what was judged."""
        log, rule, verdict = self.log, self.rule, self.verdict.replace("_", " ").upper()
        joints = [f"{name} {cover.judged_s:.3g} s" for name, cover in self.coverage.joints.items() if cover.watched]
        gammas = [f"{name} {gamma:.3g}" for name, gamma in rule.gamma_nm.items()]
        rows = [
            ("why", first_few(self.reasons)),
            ("not part of it", first_few(self.exclusions)),
            ("contacts", first_few([f"{c.onset_s:.3f} s: {', '.join(c.joints)}" for c in self.contacts], 5)),
            ("near misses", first_few([f"{m.onset_s:.3f} s: {m.joint}" for m in self.near_misses], 5)),
            ("rule", f"{rule.detector}, n = {rule.n} ({1e3 * rule.persistence_s:.3g} ms)"),
            ("γ, N·m or N", first_few(gammas, 8)),
            ("judged", first_few(joints, 8) or "no joint"),
            ("findings", first_few(dict.fromkeys(f.code for f in self.findings if f.severity != "info"), 8)),
        ]
        title = f"{verdict}: {log.name}, {log.duration_s:.4g} s, recorded {log.start or 'at an unknown time'}"
        return title, [(term, value) for term, value in rows if value]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Audit(Showing):
    """One audited log: the result, and the sample-by-sample evidence behind it.

    ``reference`` is what later nights may know of its cycles; None where there are too few.
    """

    result: AuditResult
    signals: Signals
    reference: CycleReference | None = None

    def outline(self) -> Shown:
        """As its result."""
        return self.result.outline()
