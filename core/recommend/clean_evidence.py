"""Recommendations from judged logs: their clean residuals, joint by joint, over all of them together."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from collaudit.core.data.audit_result import Audit, RecommendedRule
from collaudit.core.data.signals import Signals, State
from collaudit.core.detection.clean_samples import clean_samples
from collaudit.core.numeric.arrays import BoolArray
from collaudit.core.recommend.recommendation import CleanResidual, recommend_rule

#: Start and end of stretches of time, s.
Times = Sequence[tuple[float, float]]


def clean_residual(signals: Signals, joint: str, clean: BoolArray, period_s: float) -> CleanResidual:
    """One joint's residual with its clean samples (n,), and the judged seconds that are not among them."""
    k = signals.joint_names.index(joint)
    left_out = np.count_nonzero(signals.state[:, k] == State.JUDGED) - np.count_nonzero(clean)
    return CleanResidual(signals.residual_nm[:, k], clean, period_s, float(left_out) * period_s)


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
    known = [*contact, *[None] * (len(audits) - len(contact))]
    wanted = persistence_s or max(a.result.rule.persistence_s for a in audits)
    joints = list(dict.fromkeys(j for a in audits for j in a.result.recommended))
    out = {}
    for joint in joints:
        data = []
        for audit, stated in zip(audits, known, strict=True):
            if joint in audit.signals.joint_names:
                found = [(c.onset_s, c.onset_s + c.duration_s) for c in audit.result.collisions if c.joint == joint]
                clean = clean_samples(audit.signals, found if stated is None else stated, joint)
                data.append(clean_residual(audit.signals, joint, clean, audit.result.log.sample_period_s))
        out[joint] = recommend_rule(data, wanted)
    return out
