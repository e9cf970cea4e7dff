"""The answer: gamma of each joint, the arm's false alarms with their bound, and what the evidence is and is not."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from collaudit.core.cycles.null_level import NullEvidence
from collaudit.core.data import distinct
from collaudit.core.data.audit_result import Audit, RecommendedRule, RuleFacts
from collaudit.core.data.recommendation_result import (
    ArmRate,
    CleanPeak,
    PersistenceReason,
    RangeOfEvidence,
    SetRule,
    StretchToConfirm,
)
from collaudit.core.data.sensitivity_result import Sensitivity
from collaudit.core.data.signals import State
from collaudit.core.detection.rule import persistence_samples
from collaudit.core.numeric.null_tail import BLOCK_S, block_peaks, null_tail
from collaudit.core.recommend.arm_evidence import (
    MARGIN_S,
    ArmEvidence,
    LeftOutStretch,
    LogEvidence,
    SustainedPeaks,
    Times,
    gather_evidence,
    joined,
    sustained_level,
)
from collaudit.core.recommend.evidence_range import ranges_of_evidence
from collaudit.core.recommend.joint_thresholds import (
    DEFAULT_PER_HOUR,
    LEAST_S,
    AlarmPlane,
    alarm_planes,
    arm_rate,
    judge_set_rules,
    recommend_joints,
)


def suspicious_stretches(evidence: ArmEvidence) -> tuple[LeftOutStretch, ...]:
    """Stretches of clean motion in which a joint's residual rose beyond what the law of its peaks leaves to chance.

    The law is that of the thresholds (:mod:`null_tail`).

    Returns:
        The stretches with their margin, log by log and in time order.
    """
    found: list[LeftOutStretch] = []
    for joint in evidence.joints:
        logs = evidence.watching(joint)
        motion = [log.of_joint(joint, moving=True) for log in logs]
        peaks = [one.peaks() for one in motion]
        blocks = sum(its.size for its in peaks)
        law = null_tail(np.concatenate(peaks)) if blocks else None
        if law is None:
            continue
        for log, one, its in zip(logs, motion, peaks, strict=True):
            ends_s = block_peaks(log.signals.time_s, one.moving, one.period_s)
            for end_s in ends_s[its > law.ceiling(blocks)].tolist():
                start_s = end_s - BLOCK_S - MARGIN_S
                found.append(LeftOutStretch(log.name, start_s, end_s + MARGIN_S, "suspicious", (joint,)))
    return tuple(stretch for log in evidence.logs for stretch in joined([s for s in found if s.log == log.name]))


def without_suspicious(evidence: ArmEvidence, stretches: Sequence[LeftOutStretch]) -> ArmEvidence:
    """The evidence without suspicious stretches, in logs of which nobody said what was contact."""
    logs = tuple(
        log if log.contact_known else log.without([s for s in stretches if s.log == log.name]) for log in evidence.logs
    )
    return ArmEvidence(logs, evidence.joints)


#: Gamma that is higher than recommended by more than this where nothing touched the arm is worth a word.
_DIFFERS = 1.05
#: Moments that determine a joint's gamma, to look at.
_HIGHEST = 5

#: What a recommendation takes for granted.
ASSUMPTIONS = (
    "The logs to be judged are like these in motion, load, temperature and wear.",
    "The left-out stretches were contact; what remains is free of contact, as far as the law of the peaks can tell.",
    "Rates of false alarms are counted in the clean time, with the bound (95 %) of the count; nothing is extrapolated.",
    "Joints add up: alarms of several joints count apart, whether they coincide or not.",
    "gamma is compared with the residual as logged; what a run's own uncertainty of friction adds to it, as for a gear "
    "ripple that is not at its place, is not counted on.",
    f"Less than {LEAST_S / 60.0:g} min of clean time of a joint give no threshold.",
)


@dataclass(frozen=True, slots=True)
class LogUse:
    """A log of the evidence: name, hash, clean hours of its joints on average, and whether contact was known."""

    name: str
    sha256: str
    hours: float
    contact_known: bool


@dataclass(frozen=True, slots=True, eq=False)
class ArmRecommendation:
    """What the evidence recommends.

    Attributes:
        persistence_s: of the rule.
        rate: false alarms of the arm.
        joints: gamma and n of each joint.
        ranges: what the evidence of each joint covers.
        to_confirm: stretches that were left out though nobody said that they were contact.
        counted: suspicious stretches that were not left out, since someone said that nothing touched the arm.
        if_clean_nm: gamma of joints for which it would be higher if nothing had touched the arm in any of them.
        set_rules: what the evidence says of the thresholds that are set.
        logs: of the evidence; the same log twice counts once.
        assumptions: taken for granted.
        chosen_by: why it is this persistence: stated by the user, or as set.
        highest: of each joint the highest levels that count as clean, for a person to look at: a push no larger than
            the rest is no outlier, and raises gamma.
        units: by joint, of what its drive exerts: N·m, or N of a prismatic joint.
        planes: of each joint its alarms over threshold and persistence.
    """

    persistence_s: float
    rate: ArmRate
    joints: dict[str, RecommendedRule]
    ranges: dict[str, RangeOfEvidence]
    to_confirm: tuple[StretchToConfirm, ...]
    counted: tuple[StretchToConfirm, ...]
    if_clean_nm: dict[str, float]
    set_rules: dict[str, SetRule]
    logs: tuple[LogUse, ...]
    assumptions: tuple[str, ...] = ASSUMPTIONS
    chosen_by: PersistenceReason = "set"
    highest: dict[str, tuple[CleanPeak, ...]] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    planes: dict[str, AlarmPlane] = field(default_factory=dict)


def recommend_arm(
    audits: Sequence[Audit],
    persistence_s: float | None = None,
    contact: Sequence[Times | None] = (),
    per_hour: float = DEFAULT_PER_HOUR,
) -> ArmRecommendation:
    """Thresholds for an arm from judged logs.

    Args:
        audits: judged logs; one that is there twice counts once.
        persistence_s: persistence in s; the longest the audits used when absent.
        contact: for each audit the start and end of all contacts, s, none where it is free of them; None where that is
            not known: alarms and near misses are left out then, and so are outliers.
        per_hour: false alarms of the arm that are accepted.
    """
    known: list[Times | None] = [*contact, *[None] * (len(audits) - len(contact))]
    kept = _different(audits)
    audits, known = _distinct([audits[k] for k in kept]), [known[k] for k in kept]
    wanted = persistence_s or max(a.result.rule.persistence_s for a in audits)
    gathered = gather_evidence(audits, known)
    suspicious = suspicious_stretches(gathered)
    evidence = without_suspicious(gathered, suspicious)
    noticed = [(audit.result.rule, audit.result.sensitivity) for audit in audits]
    joints, found = recommend_joints(evidence, wanted, noticed)
    recorded = {joint: unit for audit in audits for joint, unit in audit.result.log.units.items()}
    units = {joint: recorded.get(joint, "N·m") for joint in joints}
    stated = {log.name for log in evidence.logs if log.contact_known}
    unconfirmed = [s for log in evidence.logs if not log.contact_known for s in log.left_out]
    opinions = _set_rules(audits, evidence)
    return ArmRecommendation(
        persistence_s=wanted,
        rate=arm_rate(found, {joint: rule.gamma_nm for joint, rule in joints.items()}, per_hour),
        joints=joints,
        ranges=ranges_of_evidence(evidence),
        to_confirm=tuple(_to_confirm(s, evidence, wanted) for s in unconfirmed),
        counted=tuple(_to_confirm(s, evidence, wanted) for s in suspicious if s.log in stated),
        if_clean_nm=_if_clean(audits, known, joints, wanted) if unconfirmed else {},
        set_rules=opinions,
        logs=tuple(_use(log) for log in evidence.logs),
        highest={joint: _highest(found[joint].peaks, evidence, joint) for joint in joints},
        units=units,
        planes=alarm_planes(evidence, joints, opinions, wanted),
    )


def _highest(peaks: SustainedPeaks, evidence: ArmEvidence, joint: str) -> tuple[CleanPeak, ...]:
    logs = evidence.watching(joint)
    return tuple(
        CleanPeak(
            logs[int(peaks.log[i])].name,
            float(logs[int(peaks.log[i])].signals.time_s[0] + peaks.time_s[i]),
            float(peaks.level_nm[i]),
        )
        for i in np.argsort(-peaks.level_nm, kind="stable")[:_HIGHEST]
    )


def _use(log: LogEvidence) -> LogUse:
    seconds = float(np.count_nonzero(log.clean)) / max(1, log.clean.shape[1]) * log.period_s
    return LogUse(log.name, log.sha256, seconds / 3600.0, log.contact_known)


def _different(audits: Sequence[Audit]) -> list[int]:
    """Indices of the audits without repetitions of the same residual of the same log."""
    kept: list[int] = []
    for k, audit in enumerate(audits):
        if not any(_same(audit, audits[j]) for j in kept):
            kept.append(k)
    return kept


def _distinct(audits: Sequence[Audit]) -> list[Audit]:
    """The audits with names that tell them apart: the evidence names stretches by their log."""
    names = distinct([audit.result.log.name for audit in audits])
    return [
        replace(one, result=replace(one.result, log=replace(one.result.log, name=name)))
        for one, name in zip(audits, names, strict=True)
    ]


def _same(a: Audit, b: Audit) -> bool:
    if a.result.log.sha256 != b.result.log.sha256 or a.signals.joint_names != b.signals.joint_names:
        return False
    return np.array_equal(a.signals.residual_nm, b.signals.residual_nm, equal_nan=True)


def _to_confirm(stretch: LeftOutStretch, evidence: ArmEvidence, persistence_s: float) -> StretchToConfirm:
    """The stretch with the highest level that any of its joints kept for n samples in it."""
    log = next(log for log in evidence.logs if log.name == stretch.log)
    signals, n = log.signals, persistence_samples(persistence_s, log.period_s)
    a, b = np.searchsorted(signals.time_s, [stretch.start_s, stretch.end_s])
    highest = -np.inf
    for joint in stretch.joints or log.watched:
        k = signals.joint_names.index(joint)
        usable = np.asarray(signals.state[a:b, k] <= State.FRICTION_INTERVAL)
        level = sustained_level(NullEvidence(signals.residual_nm[a:b, k], usable, log.period_s), n)
        highest = max(highest, float(level.max(initial=-np.inf)))
    start, end = max(0.0, stretch.start_s), min(float(signals.time_s[-1]), stretch.end_s)
    level_nm = highest if np.isfinite(highest) else None
    return StretchToConfirm(stretch.log, start, end, stretch.why, stretch.joints, level_nm)


def _if_clean(
    audits: Sequence[Audit],
    known: Sequence[Times | None],
    joints: Mapping[str, RecommendedRule],
    persistence_s: float,
) -> dict[str, float]:
    """Gamma of the joints for which it were higher if nothing had touched the arm where contacts are not known."""
    clean = gather_evidence(audits, [() if times is None else times for times in known])
    noticed = [(audit.result.rule, audit.result.sensitivity) for audit in audits]
    rules, _ = recommend_joints(clean, persistence_s, noticed)
    out = {}
    for joint, rule in rules.items():
        without = joints[joint].gamma_nm
        if rule.gamma_nm is not None and (without is None or rule.gamma_nm > _DIFFERS * without):
            out[joint] = rule.gamma_nm
    return out


def _set_rules(audits: Sequence[Audit], evidence: ArmEvidence) -> dict[str, SetRule]:
    """Opinions on the thresholds of the latest audit that has one for the joint, at its own persistence."""
    latest: dict[float, dict[str, float]] = {}
    for joint in evidence.joints:
        rules = [a.result.rule for a in audits if joint in a.result.rule.gamma_nm]
        if rules:
            latest.setdefault(rules[-1].persistence_s, {})[joint] = rules[-1].gamma_nm[joint]
    found: dict[str, SetRule] = {}
    for persistence_s, gammas in latest.items():
        noticed = [(audit.result.rule, audit.result.sensitivity) for audit in audits]
        found |= judge_set_rules(*recommend_joints(evidence, persistence_s, noticed), gammas)
    return {joint: found[joint] for joint in evidence.joints if joint in found}


def recommended_of_log(
    log: LogEvidence, rule: RuleFacts, sensitivity: Sensitivity | None
) -> dict[str, RecommendedRule]:
    """A threshold for each watched joint from one log alone: what :func:`recommend_arm` says of that log."""
    gathered = ArmEvidence((log,), log.watched)
    evidence = without_suspicious(gathered, suspicious_stretches(gathered))
    return recommend_joints(evidence, rule.persistence_s, [(rule, sensitivity)])[0]
