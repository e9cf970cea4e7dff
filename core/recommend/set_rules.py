"""What the evidence says of thresholds that a user has set."""

from __future__ import annotations

from collections.abc import Mapping

from scipy.special import gammaincinv as gamma_quantile

from collaudit.core.data.audit_result import RecommendedRule
from collaudit.core.data.recommendation_result import SetRule
from collaudit.core.recommend.arm_evidence import ArmEvidence
from collaudit.core.recommend.joint_thresholds import LOOSE, JointEvidence, recommend_joints


def judge_set_rules(
    evidence: ArmEvidence, gamma_nm: Mapping[str, float], persistence_s: float, per_hour: float
) -> dict[str, SetRule]:
    """The opinions on a rule that is set, at its own persistence.

    Args:
        evidence: of the arm, without what is left out.
        gamma_nm: as set, of the joints that have one.
        persistence_s: as set.
        per_hour: false alarms of the arm that are accepted.
    """
    joints, found = recommend_joints(evidence, persistence_s, per_hour)
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
