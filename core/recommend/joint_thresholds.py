"""Gamma for every joint, so that the whole arm alarms falsely no more often than asked for; and one that is set."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import log

import numpy as np
from scipy.special import gammaincinv as gamma_quantile

from collaudit.core.data.audit_result import RecommendedRule
from collaudit.core.data.recommendation_result import ArmRate, SetRule, TailFacts
from collaudit.core.detection.rule import persistence_samples
from collaudit.core.numeric.parallel import by_name
from collaudit.core.numeric.stats import STANDARD_ERRORS_95, median_of, quantile_of
from collaudit.core.recommend.arm_evidence import ArmEvidence
from collaudit.core.recommend.sustained_levels import CleanResidual, SustainedPeaks, round_up
from collaudit.core.recommend.tail_fit import JointTail, fit_tail

#: False alarms of the arm per hour that are asked for where nothing is said.
DEFAULT_PER_HOUR = 1e-3
#: Less clean time of a joint than this gives no threshold.
LEAST_S = 180.0
#: A tail is believed this many times further than the hours it was seen in.
REACH = 5.0
_FEW_LOGS = 2
#: Further hours for which the bound is looked at: so many steps in each tenfold.
_STEPS = 8
#: gamma is compared with the level that so many hours without an alarm would ask for; more than so many times is loose.
BEST_H, LOOSE = 50.0, 1.5
_ZERO_EVENTS_95 = -log(0.05)  # one-sided 95 % Poisson bound on the mean when nothing was seen: the rule of three
_POOR_FIT = 0.05


@dataclass(frozen=True, slots=True, eq=False)
class JointEvidence:
    """One joint's peaks at one persistence, and their tail.

    Attributes:
        n: samples, the largest over the logs.
        peaks: of all logs.
        tail: None where there is too little to have one.
    """

    n: int
    peaks: SustainedPeaks
    tail: JointTail | None


def joint_evidence(evidence: ArmEvidence, joint: str, persistence_s: float) -> JointEvidence:
    """Peaks and tail of one joint at a persistence."""
    n = max((persistence_samples(persistence_s, d.period_s) for d in evidence.of_joint(joint)), default=1)
    return tail_evidence(evidence.peaks(joint, persistence_s), n)


def tail_evidence(peaks: SustainedPeaks, n: int) -> JointEvidence:
    """Peaks with their tail, of a rule of n samples; where their level drifts, the tail of their worst third."""
    tail = fit_tail(peaks) if peaks.hours * 3600.0 >= LEAST_S else None
    if tail is not None and tail.drift is not None:
        windows = peaks.window_hours.size
        third = np.arange(windows - windows // 3, windows) if tail.drift > 1.0 else np.arange(windows // 3)
        worst = fit_tail(peaks.part(third))
        if worst is not None:  # with what all of the time tells
            tail = replace(worst, drift=tail.drift, largest_nm=tail.largest_nm, hours=tail.hours, logs=tail.logs)
    return JointEvidence(n, peaks, tail)


def recommend_joints(
    evidence: ArmEvidence, persistence_s: float, per_hour: float = DEFAULT_PER_HOUR
) -> tuple[dict[str, RecommendedRule], dict[str, JointEvidence]]:
    """Thresholds of all joints, and what they rest on.

    Each joint gets an equal part of the false alarms; see :func:`threshold`.

    Args:
        evidence: of the arm.
        persistence_s: of the rule.
        per_hour: false alarms of the arm.
    """
    asked = (per_hour, max(1, len(evidence.joints)))

    def of_joint(joint: str) -> tuple[RecommendedRule, JointEvidence]:
        found = joint_evidence(evidence, joint, persistence_s)
        return _rule(found, evidence.of_joint(joint), asked), found

    made = by_name(of_joint, evidence.joints)
    return {joint: rule for joint, (rule, _) in made.items()}, {joint: found for joint, (_, found) in made.items()}


def arm_rate(found: Mapping[str, JointEvidence], gamma_nm: Mapping[str, float | None], per_hour: float) -> ArmRate:
    """False alarms of the arm at given thresholds.

    Args:
        found: as of :func:`recommend_joints`.
        gamma_nm: of each joint; None: it has no threshold and no alarms.
        per_hour: asked for.
    """
    tails = [(found[joint].tail, gamma) for joint, gamma in gamma_nm.items() if gamma is not None and joint in found]
    known = [(tail, gamma) for tail, gamma in tails if tail is not None]
    if not known:
        hours = min((item.peaks.hours for item in found.values()), default=0.0)
        return ArmRate(per_hour, None, None, None, None, False, hours, max(0.0, 1.0 / (REACH * per_hour) - hours))
    hours = min(tail.hours for tail, _ in known)
    total = sum(tail.rate_bound(gamma) for tail, gamma in known)
    supported = 1.0 / (REACH * hours)
    stated = max(total, supported)
    return ArmRate(
        target_per_hour=per_hour,
        extrapolated_per_hour=total,
        bound_per_hour=stated,
        supported_per_hour=supported,
        observed_per_hour=_ZERO_EVENTS_95 / hours,
        supported=stated <= per_hour * (1.0 + 1e-9),
        hours=hours,
        more_hours=max(0.0, 1.0 / (REACH * per_hour) - hours),
    )


def _rule(item: JointEvidence, data: Sequence[CleanResidual], asked: tuple[float, int]) -> RecommendedRule:
    hours, tail = item.peaks.hours, item.tail
    gamma = threshold(tail, *asked)
    missing = _missing(item, gamma, sum(d.left_out_s for d in data))
    if tail is None or gamma is None:
        return RecommendedRule(None, item.n, None, None, hours, None, None, missing)
    quiet = np.concatenate([np.abs(d.residual_nm[d.clean]) for d in data])
    return RecommendedRule(
        gamma_nm=gamma,
        n=item.n,
        largest_clean_nm=tail.largest_nm,
        margin=gamma / tail.largest_nm if tail.largest_nm > 0 else None,
        clean_hours=hours,
        false_alarms_per_hour=tail.rate_bound(gamma),
        false_alarms_per_hour_upper95=_ZERO_EVENTS_95 / hours,
        missing=missing,
        tail=_facts(tail),
        noticed_nm=gamma + quantile_of(quiet, 0.95),
        loose=looseness(tail, gamma),
    )


def threshold(tail: JointTail | None, per_hour: float, joints: int = 1) -> float | None:
    """The threshold of one joint, two digits; None without a tail.

    Claimed is the rate that the hours support: there the tail's bound (95 %) keeps the joint's part. More hours support
    a rarer rate, which needs a higher level, by a narrower bound, which needs a lower one. gamma is the highest of the
    levels from the hours at hand to those that support the rate asked for, so that more hours like these never raise
    it. One log does not show how much logs differ: from one, 95 % hold at the
    rate asked for, too, which is the only room left for that. No level is chosen that the clean data passed, where less
    than one alarm is expected in them.

    Args:
        tail: of the joint.
        per_hour: false alarms of the arm that are asked for.
        joints: that share them.
    """
    return None if tail is None else threshold_with_hours(tail, per_hour, joints, tail.hours)


def threshold_with_hours(tail: JointTail, per_hour: float, joints: int, at_hand_h: float) -> float:
    """:func:`threshold` if so many hours had shown the same tail; fewer than there are tell no more."""
    share, enough = per_hour / joints, 1.0 / (REACH * per_hour)
    later = 10.0 ** (np.arange(int(_STEPS * np.log10(enough)) - 5 * _STEPS, _STEPS * np.log10(enough)) / _STEPS)
    hours = [at_hand_h, *(h for h in (*later, enough) if h > at_hand_h)]
    level = max(tail.level_bound(max(share, 1.0 / (REACH * h) / joints), h / tail.hours) for h in hours)
    if tail.logs < _FEW_LOGS:
        level = max(level, tail.level_bound(share, at_hand_h / tail.hours))
    return round_up(max(level, tail.largest_nm) if share * at_hand_h < 1.0 else level)


def looseness(tail: JointTail, gamma_nm: float) -> float:
    """At most (95 %) so many times the least threshold without an alarm in ``BEST_H`` hours is a threshold."""
    return gamma_nm / max(tail.least_level(1.0 / BEST_H), tail.largest_nm)


def _facts(tail: JointTail) -> TailFacts:
    law = tail.likelihood
    return TailFacts(
        begins_nm=tail.begins_nm,
        scale_nm2=law.scale,
        shape=law.shape,
        shape_ci95=law.shape_interval(STANDARD_ERRORS_95),
        peaks=law.peaks,
        fit_p=tail.fit_p,
        dispersion_minutes=tail.dispersion_minutes,
        dispersion_logs=tail.dispersion_logs,
        drift=tail.drift,
    )


def _missing(item: JointEvidence, gamma_nm: float | None, left_out_s: float) -> tuple[str, ...]:
    """What would make the recommendation firmer, or be needed for one."""
    peaks, tail = item.peaks, item.tail
    if peaks.hours * 3600.0 < LEAST_S:
        why = (
            f"only {peaks.hours * 3600.0:.3g} s of judged, contact-free time in stretches of n = {item.n} samples and "
            f"longer (at least {LEAST_S / 60.0:g} min are needed)"
        )
        return (why,)
    if tail is None:
        return ("a residual that varies: its peaks are too few or all alike to tell how often they would go higher",)
    missing = []
    if left_out_s > 0:
        missing.append(
            f"a statement on {left_out_s:.3g} s around alarms, taken for contact here (--clean, --truth or --labels): "
            "if nothing touched the arm then, gamma has to be higher"
        )
    if gamma_nm is not None and (times := looseness(tail, gamma_nm)) > LOOSE:
        missing.append(
            f"more hours: gamma may be up to {times:.2g} times as high as {BEST_H:g} h of such logs would need"
        )
    if peaks.log_of_window.size and peaks.log_of_window.max() == 0:
        missing.append("another log: one log does not show how much logs differ")
    apart = _logs_apart(peaks)
    if apart > LOOSE:
        missing.append(
            f"logs that are alike: the median level of the residual differs between them by a factor of {apart:.2g} "
            "(their findings may tell why: friction-level, log-velocity-derived)"
        )
    if tail.drift is not None:
        missing.append(
            f"a steady residual: its level changed by a factor of {tail.drift:.2g} from the first to the last third of "
            "the time; gamma is taken from the worse third"
        )
    if tail.fit_p < _POOR_FIT:
        missing.append(
            f"peaks that follow the law of the tail: they do not (p = {tail.fit_p:.2g}); the rate is uncertain"
        )
    return tuple(missing)


def _logs_apart(peaks: SustainedPeaks) -> float:
    """The highest median level of a log over the lowest; 1 with one log."""
    medians = [median_of(own) for k in np.unique(peaks.log) if (own := peaks.level_nm[peaks.log == k]).size]
    least = min(medians, default=0.0)
    return max(medians) / least if least > 0 else 1.0


def judge_set_rules(
    joints: Mapping[str, RecommendedRule],
    found: Mapping[str, JointEvidence],
    gamma_nm: Mapping[str, float],
    per_hour: float,
) -> dict[str, SetRule]:
    """The opinions on a rule that is set.

    Args:
        joints, found: of :func:`recommend_joints`, at the rule's own persistence.
        gamma_nm: as set, of the joints that have one.
        per_hour: false alarms of the arm that are accepted.
    """
    share = per_hour / max(1, len(joints))
    return {
        joint: judge_set_rule(gamma_nm[joint], rule, found[joint], share)
        for joint, rule in joints.items()
        if joint in gamma_nm
    }


def judge_set_rule(gamma_nm: float, rule: RecommendedRule, item: JointEvidence, share_per_hour: float) -> SetRule:
    """The opinion on one joint's threshold.

    Args:
        gamma_nm: as set.
        rule: recommended from the same evidence, at the same persistence.
        item: that evidence.
        share_per_hour: false alarms that the joint may have.
    """
    best = rule.gamma_nm
    if item.tail is None or best is None:
        return SetRule(gamma_nm, "not judged", None, None, None, item.n)
    expected, bound = _rates(gamma_nm, item)
    if gamma_nm < best and bound > share_per_hour:
        return SetRule(gamma_nm, "too tight", expected, bound, None, item.n, best)
    if gamma_nm > LOOSE * best:
        return SetRule(gamma_nm, "too loose", expected, bound, (best, gamma_nm), item.n, best)
    return SetRule(gamma_nm, "supported", expected, bound, None, item.n, best)


def _rates(gamma_nm: float, item: JointEvidence) -> tuple[float, float]:
    """Expected and at most (95 %), 1/h: extrapolated above the beginning of the tail, counted below it."""
    assert item.tail is not None
    if gamma_nm >= item.tail.begins_nm:
        return item.tail.rate_at(gamma_nm), item.tail.rate_bound(gamma_nm)
    seen = int((item.peaks.level_nm > gamma_nm).sum())
    scatter = item.tail.likelihood.count_dispersion
    bound = scatter * float(gamma_quantile(seen / scatter + 1.0, 0.95))
    return seen / item.peaks.hours, bound / item.peaks.hours
