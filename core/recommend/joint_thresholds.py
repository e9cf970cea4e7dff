"""Gamma of every joint from clean runs, by the law of the fit; what the hours support, and say of a set one.

Beside it the plane of each joint: false alarms over threshold gamma and persistence, counted in the clean time of its
runs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf

import numpy as np
from scipy.special import gammaincinv as gamma_quantile

from collaudit.core.cycles.null_level import NullEvidence, motion_levels
from collaudit.core.data.audit_result import RecommendedRule, RuleFacts
from collaudit.core.data.recommendation_result import ArmRate, SetRule, ThresholdLevel
from collaudit.core.data.sensitivity_result import Sensitivity
from collaudit.core.detection.fitted_rule import in_room, typed
from collaudit.core.detection.rule import MERGE_S, persistence_samples
from collaudit.core.numeric.arrays import FloatArray, IntArray, run_bounds
from collaudit.core.numeric.null_tail import ARM_PER_HOUR
from collaudit.core.numeric.parallel import by_name
from collaudit.core.numeric.stats import median_of, quantile_of
from collaudit.core.recommend.arm_evidence import ArmEvidence, SustainedPeaks

#: False alarms of the arm an hour that are asked for where nothing is said.
DEFAULT_PER_HOUR = ARM_PER_HOUR
#: Less clean time of a joint than this gives no threshold.
LEAST_S = 180.0
#: A threshold more than so many times the recommended one is loose; logs that differ by more differ for a reason.
LOOSE = 1.5
_CONFIDENCE = 0.95
#: One-sided 95 % Poisson bound on the mean when nothing was seen: the rule of three.
_NOTHING_SEEN = float(gamma_quantile(1.0, _CONFIDENCE))
#: Thresholds and persistences of the plane, as multiples of the rule that it is drawn around.
GAMMAS: tuple[float, ...] = tuple(2.0 ** (k / 2) for k in range(-4, 5))
PERSISTENCES: tuple[float, ...] = (0.25, 0.5, 1.0, 2.0, 4.0)


@dataclass(frozen=True, slots=True, eq=False)
class JointEvidence:
    """One joint's clean motion at one persistence.

    Attributes:
        n: samples, the largest over the logs.
        peaks: of all logs.
        level: what its motion does by itself; None where there is too little of it.
        left_out_s: time around events, in which the rule can fire.
        quiet_nm: the size that its residual stays below in 95 % of the clean time.
    """

    n: int
    peaks: SustainedPeaks
    level: ThresholdLevel | None
    left_out_s: float
    quiet_nm: float

    def alarms(self, gamma_nm: float) -> int:
        """How many the threshold would have given in the clean time."""
        return int(np.count_nonzero(self.peaks.level_nm > gamma_nm))


def joint_evidence(evidence: ArmEvidence, joint: str, persistence_s: float) -> JointEvidence:
    """Peaks of one joint at a persistence, and the level of its motion."""
    data, peaks = evidence.of_joint(joint), evidence.peaks(joint, persistence_s)
    counts = [persistence_samples(persistence_s, one.period_s) for one in data]
    levels = []
    if peaks.hours * 3600.0 >= LEAST_S:
        free = all(log.contact_known for log in evidence.logs)  # what is left then was no contact, as someone said
        levels = motion_levels(evidence.of_joint(joint, moving=True), [counts], len(evidence.joints), free)
    size = np.concatenate([np.abs(one.residual_nm[one.moving]) for one in data]) if data else np.empty(0)
    left_out_s = sum(log.left_out_s(joint) for log in evidence.watching(joint))
    return JointEvidence(
        max(counts, default=1),
        peaks,
        levels[0] if levels else None,
        left_out_s,
        quantile_of(size, 0.95) if size.size else 0.0,
    )


def recommend_joints(
    evidence: ArmEvidence, persistence_s: float, judged: Sequence[tuple[RuleFacts, Sensitivity | None]]
) -> tuple[dict[str, RecommendedRule], dict[str, JointEvidence]]:
    """Thresholds of all joints, and what they rest on.

    They stand as ``gamma_nm = "auto"`` does: between what the motion of these logs does and what must be noticed.

    Args:
        evidence: of the arm.
        persistence_s: of the rule.
        judged: the rule of each log, and the force that it would have noticed.
    """
    found = by_name(lambda joint: joint_evidence(evidence, joint, persistence_s), evidence.joints)
    times = in_room(min((room_of(rule, noticed, found) for rule, noticed in judged), default=inf))
    return {joint: _rule(one, times) for joint, one in found.items()}, found


def room_of(rule: RuleFacts, noticed: Sensitivity | None, found: Mapping[str, JointEvidence]) -> float:
    """How many times the force that alarms at the motion's levels is asked for, in one log; infinite without either.

    The force goes with the thresholds that it was noticed with, at most as the joint that differs most.
    """
    if noticed is None or noticed.time is None:
        return inf
    known = {joint: one.level.gamma_nm for joint, one in found.items() if one.level is not None}
    ratios = [level / rule.gamma_nm[joint] for joint, level in known.items() if joint in rule.gamma_nm]
    if not ratios:
        return inf
    share = noticed.time.share
    forces = [(one.asked.force_n, one.at(share)) for one in noticed.forces if one.asked is not None]
    return min((0.0 if force is None else asked / (max(ratios) * force) for asked, force in forces), default=inf)


def arm_rate(found: Mapping[str, JointEvidence], gamma_nm: Mapping[str, float | None], per_hour: float) -> ArmRate:
    """False alarms of the arm at given thresholds: counted in the clean time, with the bound of the count.

    Args:
        found: as of :func:`recommend_joints`.
        gamma_nm: of each joint; None: it has no threshold and no alarms.
        per_hour: asked for.
    """
    known = {joint: gamma for joint, gamma in gamma_nm.items() if gamma is not None and joint in found}
    hours = min((one.peaks.hours for joint, one in found.items() if joint in known or not known), default=0.0)
    needed = _NOTHING_SEEN / per_hour
    if not known or not hours > 0.0:
        return ArmRate(per_hour, None, 0, False, hours, max(0.0, needed - hours))
    seen = sum(found[joint].alarms(gamma) for joint, gamma in known.items())
    bound = float(gamma_quantile(seen + 1.0, _CONFIDENCE)) / hours
    return ArmRate(per_hour, bound, seen, bound <= per_hour * (1.0 + 1e-9), hours, max(0.0, needed - hours))


def _rule(one: JointEvidence, times: float) -> RecommendedRule:
    hours, level = one.peaks.hours, one.level
    largest = float(one.peaks.level_nm.max(initial=0.0))
    if level is None:
        return RecommendedRule(None, one.n, None, None, hours, None, _missing(one))
    gamma = typed(times * level.gamma_nm)
    bound = float(gamma_quantile(one.alarms(gamma) + 1.0, _CONFIDENCE)) / hours
    return RecommendedRule(
        gamma, one.n, typed(level.gamma_nm), largest, hours, bound, _missing(one), gamma + one.quiet_nm
    )


def _missing(one: JointEvidence) -> tuple[str, ...]:
    """What would make the recommendation firmer, or be needed for one."""
    peaks = one.peaks
    if peaks.hours * 3600.0 < LEAST_S:
        why = (
            f"only {peaks.hours * 3600.0:.3g} s of judged, contact-free time in stretches of n = {one.n} samples and "
            f"longer (at least {LEAST_S / 60.0:g} min are needed)"
        )
        return (why,)
    if one.level is None:
        return ("a residual that varies: its peaks are too few or all alike to tell how often they would go higher",)
    missing = []
    if one.left_out_s > 0:
        missing.append(
            f"a statement on {one.left_out_s:.3g} s around alarms, taken for contact here ([fit] contact, --truth "
            "or [detect] true_events): if nothing touched the arm then, gamma has to be higher"
        )
    if peaks.log.max(initial=0) == 0:
        missing.append("another log: one log does not show how much logs differ")
    apart = _logs_apart(peaks)
    if apart > LOOSE:
        missing.append(
            f"logs that are alike: the median level of the residual differs between them by a factor of {apart:.2g} "
            "(their findings may tell why: friction-level, log-velocity)"
        )
    return tuple(missing)


def _logs_apart(peaks: SustainedPeaks) -> float:
    """The highest median level of a log over the lowest; 1 with one log."""
    medians = [median_of(own) for k in np.unique(peaks.log) if (own := peaks.level_nm[peaks.log == k]).size]
    least = min(medians, default=0.0)
    return max(medians) / least if least > 0 else 1.0


def judge_set_rules(
    joints: Mapping[str, RecommendedRule], found: Mapping[str, JointEvidence], gamma_nm: Mapping[str, float]
) -> dict[str, SetRule]:
    """The opinions on a rule that is set.

    Args:
        joints, found: of :func:`recommend_joints`, at the rule's own persistence.
        gamma_nm: as set, of the joints that have one.
    """
    return {j: judge_set_rule(gamma_nm[j], rule, found[j]) for j, rule in joints.items() if j in gamma_nm}


def judge_set_rule(gamma_nm: float, rule: RecommendedRule, one: JointEvidence) -> SetRule:
    """The opinion on one joint's threshold: below what motion does it is tight, far above the recommended one loose."""
    best = rule.gamma_nm
    if one.level is None or best is None or not one.peaks.hours > 0.0:
        return SetRule(gamma_nm, "not judged", None, None, None, one.n)
    seen = one.alarms(gamma_nm)
    expected, bound = seen / one.peaks.hours, float(gamma_quantile(seen + 1.0, _CONFIDENCE)) / one.peaks.hours
    if gamma_nm < one.level.gamma_nm / one.level.margin:
        return SetRule(gamma_nm, "too tight", expected, bound, None, one.n, best)
    if gamma_nm > LOOSE * best:
        return SetRule(gamma_nm, "too loose", expected, bound, (best, gamma_nm), one.n, best)
    return SetRule(gamma_nm, "supported", expected, bound, None, one.n, best)


@dataclass(frozen=True, slots=True)
class AlarmPlane:
    """Alarms of one joint at constant thresholds. The table is (threshold, persistence).

    Attributes:
        gamma_nm: (g,) thresholds, rising, N·m (N if prismatic).
        persistence_s: (c,) rising.
        clean_s: judged time away from contact that the alarms were counted in.
        alarms: (g, c) their number in it; closer than 0.2 s they are one.
        set_nm, recommended_nm: thresholds to mark; None where there is none.
    """

    gamma_nm: tuple[float, ...]
    persistence_s: tuple[float, ...]
    clean_s: float
    alarms: tuple[tuple[int, ...], ...]
    set_nm: float | None
    recommended_nm: float | None


def alarm_planes(
    evidence: ArmEvidence,
    rules: Mapping[str, RecommendedRule],
    set_rules: Mapping[str, SetRule],
    persistence_s: float,
) -> dict[str, AlarmPlane]:
    """The plane of every joint with a threshold, around the recommended one, or the set one where none is recommended.

    Args:
        evidence: of all logs.
        rules: recommended.
        set_rules: as set.
        persistence_s: that the rules are for.
    """
    planes = {}
    for joint in evidence.joints:
        set_nm = set_rules[joint].gamma_nm if joint in set_rules else None
        recommended_nm = rules[joint].gamma_nm if joint in rules else None
        around_nm = recommended_nm or set_nm
        if not around_nm:
            continue
        gammas = np.array([float(f"{around_nm * ratio:.3g}") for ratio in GAMMAS])
        lasting = tuple(persistence_s * ratio for ratio in PERSISTENCES)
        data = evidence.of_joint(joint)
        counted = np.sum([_counted(one, gammas, lasting) for one in data], axis=0)
        clean_s = float(sum(np.count_nonzero(one.moving) * one.period_s for one in data))
        alarms = tuple(tuple(int(x) for x in row) for row in counted)
        planes[joint] = AlarmPlane(tuple(gammas.tolist()), lasting, clean_s, alarms, set_nm, recommended_nm)
    return planes


def _counted(data: NullEvidence, gammas: FloatArray, lasting_s: Sequence[float]) -> IntArray:
    residual = np.where(data.moving, np.abs(data.residual_nm), -np.inf)
    counts = np.array([persistence_samples(length, data.period_s) for length in lasting_s])
    return alarm_counts(residual, gammas, counts, round(MERGE_S / data.period_s))


def alarm_counts(level_nm: FloatArray, gammas: FloatArray, counts: IntArray, merge: int) -> IntArray:
    """(g, c) alarms of rule (6) for each threshold and persistence.

    Args:
        level_nm: (n,) size of the residual, -inf where nothing can alarm, N·m.
        gammas: (g,) thresholds, N·m.
        counts: (c,) persistences, samples, rising.
        merge: alarms with fewer samples between them are one.
    """
    out = np.zeros((gammas.size, counts.size), dtype=np.int64)
    for g, gamma in enumerate(gammas):
        starts, stops = run_bounds(level_nm > gamma)
        for c, n in enumerate(counts):
            long = stops - starts >= n
            starts, stops = starts[long], stops[long]
            if starts.size == 0:
                break
            out[g, c] = 1 + np.count_nonzero(starts[1:] - stops[:-1] >= max(1, merge))
    return out
