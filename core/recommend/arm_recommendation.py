"""The answer: gamma of each joint, the arm's false alarms with their bound, and what the evidence is and is not."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.special import fdtrc as fisher_tail

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
from collaudit.core.numeric.arrays import FloatArray, IntArray
from collaudit.core.numeric.distinct_names import distinct
from collaudit.core.numeric.parallel import by_name
from collaudit.core.numeric.stats import median_of, quantile_of
from collaudit.core.recommend.alarm_plane import AlarmPlane, alarm_planes
from collaudit.core.recommend.arm_evidence import (
    MARGIN_S,
    ArmEvidence,
    LeftOutStretch,
    LogEvidence,
    Times,
    gather_evidence,
    joined,
)
from collaudit.core.recommend.evidence_range import acceleration, ranges_of_evidence
from collaudit.core.recommend.joint_thresholds import (
    DEFAULT_PER_HOUR,
    LEAST_S,
    arm_rate,
    judge_set_rules,
    recommend_joints,
)
from collaudit.core.recommend.sustained_levels import BLOCK_S, CleanResidual, SustainedPeaks, sustained_level

#: Chance that any peak of a clean joint is called an outlier.
_CHANCE = 1e-3
#: Share of the peaks that may be outliers; the usual is told from those below, down to three times as many.
_SUSPECT, _USUAL = 0.1, 0.3
_FEWEST = 60
#: How many times wider than usual their spacings are at least: motions of several kinds mix to a tail that is a little
#: heavier than exponential, which hours of data would tell from one.
_FURTHER = 3.0
#: Peaks are compared with others at like speed and acceleration: so many classes of each.
_CLASSES = (4, 3)
_FEWEST_IN_CLASS = 20
#: Joints that are tested together, at least; those are named that have this share of the highest ratio.
_FEWEST_JOINTS, _SHARES = 2, 0.5


def outlying_stretches(evidence: ArmEvidence, persistence_s: float) -> tuple[LeftOutStretch, ...]:
    """Stretches of clean time in which a joint's residual rose far beyond its usual peaks at like motion.

    Args:
        evidence: of the arm, events left out.
        persistence_s: of the rule.

    Returns:
        The stretches with their margin, log by log and in time order.
    """
    found: dict[int, list[LeftOutStretch]] = {}
    together: dict[tuple[int, int], dict[str, float]] = {}

    for joint, peaks in by_name(lambda joint: evidence.peaks(joint, persistence_s), evidence.joints).items():
        logs = [k for k, log in enumerate(evidence.logs) if joint in log.watched]
        if peaks.level_nm.size < _FEWEST:
            continue
        usual = _usual_nm(peaks, [evidence.logs[k] for k in logs], joint)
        ratio = peaks.level_nm / usual
        for i in _outliers(ratio):
            k = logs[int(peaks.log[i])]
            found.setdefault(k, []).append(_around(evidence.logs[k], float(peaks.time_s[i]), (joint,)))
        for own, second, size in zip(peaks.log, (peaks.time_s / BLOCK_S).astype(np.int64), ratio, strict=True):
            together.setdefault((logs[int(own)], int(second)), {})[joint] = float(size)
    for (k, second), joints in _together(together):
        found.setdefault(k, []).append(_around(evidence.logs[k], (second + 0.5) * BLOCK_S, joints, 0.5 * BLOCK_S))
    return tuple(stretch for k in sorted(found) for stretch in joined(found[k]))


def _around(log: LogEvidence, at_s: float, joints: tuple[str, ...], half_s: float = 0.0) -> LeftOutStretch:
    return LeftOutStretch(log.name, at_s - half_s - MARGIN_S, at_s + half_s + MARGIN_S, "suspicious", joints)


def _together(
    seconds: Mapping[tuple[int, int], Mapping[str, float]],
) -> list[tuple[tuple[int, int], tuple[str, ...]]]:
    """Seconds in which the joints together lie too far out, with the joints that are highest in them.

    Args:
        seconds: by log and second the peaks of the joints over their usual.
    """
    places = sorted(seconds, key=lambda place: place[0])
    count = max((len(ratios) for ratios in seconds.values()), default=0)
    if count < _FEWEST_JOINTS or len(places) < _FEWEST:
        return []
    # A joint whose peak was merged into the next second counts as usual.
    size = np.array([sum(x * x for x in seconds[at].values()) + count - len(seconds[at]) for at in places])
    out = []
    for at in (places[int(i)] for i in _outliers(size)):
        most = _SHARES * max(seconds[at].values())
        out.append((at, tuple(joint for joint, x in seconds[at].items() if x > most)))
    return out


def without_outliers(evidence: ArmEvidence, stretches: Sequence[LeftOutStretch]) -> ArmEvidence:
    """The evidence without suspicious stretches, in logs of which nobody said what was contact."""
    if not stretches:
        return evidence
    logs = tuple(
        log if log.contact_known else log.without([s for s in stretches if s.log == log.name]) for log in evidence.logs
    )
    return ArmEvidence(logs, evidence.joints)


def unsuspicious(evidence: ArmEvidence, persistence_s: float) -> ArmEvidence:
    """The evidence without what is suspicious in it; arguments as of :func:`outlying_stretches`."""
    return without_outliers(evidence, outlying_stretches(evidence, persistence_s))


def _usual_nm(peaks: SustainedPeaks, logs: Sequence[LogEvidence], joint: str) -> FloatArray:
    """(b,) the median peak at speeds and accelerations like those of each peak; of all where there are few like it."""
    speed, turn = np.empty(peaks.level_nm.size), np.empty(peaks.level_nm.size)
    for k, log in enumerate(logs):
        own = peaks.log == k
        velocity = log.signals.velocity_rad_s[:, log.signals.joint_names.index(joint)]
        at = np.round(peaks.time_s[own] / log.period_s).astype(np.int64).clip(0, velocity.size - 1)
        speed[own], turn[own] = np.abs(velocity[at]), acceleration(velocity, log.period_s)[at]
    like = _CLASSES[1] * _class(speed, _CLASSES[0]) + _class(turn, _CLASSES[1])
    usual = np.full(peaks.level_nm.size, max(median_of(peaks.level_nm), 1e-12))
    for label in np.unique(like):
        same = like == label
        if np.count_nonzero(same) >= _FEWEST_IN_CLASS:
            usual[same] = max(median_of(peaks.level_nm[same]), 1e-12)
    return usual


def _class(values: FloatArray, count: int) -> IntArray:
    known = np.nan_to_num(values)
    edges = [quantile_of(known, share) for share in np.linspace(0.0, 1.0, count + 1)[1:-1].tolist()]
    return np.searchsorted(edges, known, side="right").astype(np.int64)


def _outliers(ratio: FloatArray) -> IntArray:
    """Indices of the peaks that lie too far out; none where the highest are as the law has it."""
    order = np.argsort(ratio)[::-1]
    top, below = max(5, int(_SUSPECT * ratio.size)), int(_USUAL * ratio.size)
    ranked = ratio[order[: below + 1]]
    spacing = np.arange(1, below + 1) * (ranked[:-1] - ranked[1:])
    usual = float(np.mean(spacing[top:]))
    if usual <= 0:
        return np.empty(0, np.int64)
    count = np.arange(1, top + 1)
    further = np.cumsum(spacing[:top]) / count / usual
    chance = np.where(further > _FURTHER, fisher_tail(2.0 * count, 2.0 * (below - top), further), 1.0)
    if chance.min() >= _CHANCE / top:
        return np.empty(0, np.int64)
    return order[: int(np.argmin(chance)) + 1]


#: Gamma that is higher than recommended by more than this where nothing touched the arm is worth a word.
_DIFFERS = 1.05
#: Moments that determine a joint's gamma, to look at.
_HIGHEST = 5

#: What a recommendation takes for granted.
ASSUMPTIONS = (
    "The logs to be judged are like these in motion, load, temperature and wear.",
    "The left-out stretches were contact; what remains is free of contact, as far as an outlier test can tell.",
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
    outliers = outlying_stretches(gathered, wanted)
    evidence = without_outliers(gathered, outliers)
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
        counted=tuple(_to_confirm(s, evidence, wanted) for s in outliers if s.log in stated),
        if_clean_nm=_if_clean(audits, known, joints, wanted) if unconfirmed else {},
        set_rules=opinions,
        logs=tuple(_use(log) for log in evidence.logs),
        highest={joint: _highest(found[joint].peaks, evidence, joint) for joint in joints},
        units=units,
        planes=alarm_planes(evidence, joints, opinions, wanted),
    )


def _highest(peaks: SustainedPeaks, evidence: ArmEvidence, joint: str) -> tuple[CleanPeak, ...]:
    logs = [log for log in evidence.logs if joint in log.watched]
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
        usable = np.asarray(
            (signals.state[a:b, k] <= State.FRICTION_INTERVAL) & np.isfinite(signals.residual_nm[a:b, k])
        )
        level = sustained_level(CleanResidual(signals.residual_nm[a:b, k], usable, log.period_s), n)
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
    evidence = unsuspicious(ArmEvidence((log,), log.watched), rule.persistence_s)
    return recommend_joints(evidence, rule.persistence_s, [(rule, sensitivity)])[0]
