"""Recommendations of one log by its audit, and of several as a table by joint."""

from __future__ import annotations

from collections.abc import Sequence

from collaudit.core.data.audit_result import Audit, RecommendedRule
from collaudit.core.recommend.arm_evidence import ArmEvidence, LogEvidence, Times
from collaudit.core.recommend.arm_recommendation import recommend_arm
from collaudit.core.recommend.joint_thresholds import DEFAULT_PER_HOUR, recommend_joints
from collaudit.core.recommend.outlying_peaks import outlying_stretches, without_outliers


def recommend_rules(
    audits: Sequence[Audit], persistence_s: float | None = None, contact: Sequence[Times | None] = ()
) -> dict[str, RecommendedRule]:
    """Recommended gamma and n per joint over all given audits; arguments as of :func:`recommend_arm`."""
    return recommend_arm(audits, persistence_s, contact).joints


def recommended_of_log(
    log: LogEvidence, persistence_s: float, per_hour: float = DEFAULT_PER_HOUR
) -> dict[str, RecommendedRule]:
    """A threshold for each watched joint from one log alone."""
    return _of_log(log, persistence_s, per_hour, others=True)


def thresholds_of_log(
    log: LogEvidence, persistence_s: float, per_hour: float = DEFAULT_PER_HOUR
) -> dict[str, float | None]:
    """Gamma of each watched joint from one log alone: what :func:`recommend_arm` says of that log."""
    rules = _of_log(log, persistence_s, per_hour, others=False)
    return {joint: rule.gamma_nm for joint, rule in rules.items()}


def _of_log(log: LogEvidence, persistence_s: float, per_hour: float, others: bool) -> dict[str, RecommendedRule]:
    evidence = ArmEvidence((log,), log.watched)
    evidence = without_outliers(evidence, outlying_stretches(evidence, persistence_s))
    return recommend_joints(evidence, persistence_s, per_hour, others)[0]
