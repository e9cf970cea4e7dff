"""What the evidence says of thresholds that a user has set."""

from __future__ import annotations

from collections.abc import Mapping

from scipy.special import gammaincinv as gamma_quantile

from collaudit.core.data.audit_result import RecommendedRule
from collaudit.core.data.recommendation_result import Opinion, SetRule
from collaudit.core.recommend.arm_evidence import ArmEvidence
from collaudit.core.recommend.joint_thresholds import LOOSE, JointEvidence, recommend_joints


def judge_set_rules(
    evidence: ArmEvidence,
    gamma_nm: Mapping[str, float],
    persistence_s: float,
    per_hour: float,
    units: Mapping[str, str],
) -> dict[str, SetRule]:
    """The opinions on a rule that is set, at its own persistence.

    Args:
        evidence: of the arm, without what is left out.
        gamma_nm: as set, of the joints that have one.
        persistence_s: as set.
        per_hour: false alarms of the arm that are accepted.
        units: by joint, of what its drive exerts; N·m where absent.
    """
    joints, found = recommend_joints(evidence, persistence_s, per_hour)
    share = per_hour / max(1, len(joints))
    return {
        joint: judge_set_rule(gamma_nm[joint], rule, found[joint], share, units.get(joint, "N·m"))
        for joint, rule in joints.items()
        if joint in gamma_nm
    }


def judge_set_rule(
    gamma_nm: float, rule: RecommendedRule, item: JointEvidence, share_per_hour: float, unit: str
) -> SetRule:
    """The opinion on one joint's threshold.

    Args:
        gamma_nm: as set.
        rule: recommended from the same evidence, at the same persistence.
        item: that evidence.
        share_per_hour: false alarms that the joint may have.
        unit: of what the joint's drive exerts.
    """
    tail = item.tail
    if tail is None or rule.gamma_nm is None:
        text = "Not judged: the evidence supports no threshold."
        return SetRule(gamma_nm, "not judged", None, None, None, text, item.n)
    best = rule.gamma_nm
    expected, bound = _rates(gamma_nm, item)
    if gamma_nm < best and bound > share_per_hour:
        opinion: Opinion = "too tight"
        text = (
            f"Too tight: {_rate(expected)} false alarms expected, up to {_rate(bound)} (95 %), where "
            f"{_rate(share_per_hour)} are this joint's part."
        )
        return SetRule(gamma_nm, opinion, expected, bound, None, text, item.n, best)
    if gamma_nm > LOOSE * best:
        text = (
            f"Too loose: external {'forces' if unit == 'N' else 'torques'} of {best:.2g} to {gamma_nm:.3g} {unit} go "
            "unnoticed that the evidence would allow to be noticed."
        )
        return SetRule(gamma_nm, "too loose", expected, bound, (best, gamma_nm), text, item.n, best)
    return SetRule(gamma_nm, "supported", expected, bound, None, "Supported by the evidence.", item.n, best)


def _rates(gamma_nm: float, item: JointEvidence) -> tuple[float, float]:
    """Expected and at most (95 %), 1/h: extrapolated above the beginning of the tail, counted below it."""
    assert item.tail is not None
    if gamma_nm >= item.tail.begins_nm:
        return item.tail.rate_at(gamma_nm), item.tail.rate_bound(gamma_nm)
    seen = int((item.peaks.level_nm > gamma_nm).sum())
    scatter = item.tail.likelihood.count_dispersion
    bound = scatter * float(gamma_quantile(seen / scatter + 1.0, 0.95))
    return seen / item.peaks.hours, bound / item.peaks.hours


def _rate(per_hour: float) -> str:
    """A rate in words: per hour, or per 1,000 h where it is rare."""
    return f"{per_hour:.2g} per hour" if per_hour >= 0.1 else f"{1000.0 * per_hour:.2g} per 1,000 h"
