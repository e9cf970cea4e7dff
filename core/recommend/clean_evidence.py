"""Recommendations from judged logs: their clean residuals, joint by joint, over all of them together."""

from __future__ import annotations

from collections.abc import Sequence

from collaudit.core.data.audit_result import Audit, RecommendedRule
from collaudit.core.recommend.arm_evidence import Times, gather_evidence
from collaudit.core.recommend.recommendation import recommend_rule


def recommend_rules(
    audits: Sequence[Audit], persistence_s: float | None = None, contact: Sequence[Times | None] = ()
) -> dict[str, RecommendedRule]:
    """Recommended gamma and n per joint over all given audits.

    Args:
        audits: judged logs.
        persistence_s: persistence in s; the longest the audits used when absent.
        contact: for each audit the start and end of all contacts, s, none where it is free of them; None where that is
            not known, and the alarms are taken for contact.
    """
    evidence = gather_evidence(audits, contact)
    wanted = persistence_s or max(a.result.rule.persistence_s for a in audits)
    return {joint: recommend_rule(evidence.of_joint(joint), wanted) for joint in evidence.joints}
