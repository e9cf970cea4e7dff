"""What counts as evidence: time away from the events of every joint."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from residual_audits import audit_of

from collaudit.core.data.audit_result import Audit, Collision, NearMiss
from collaudit.core.data.signals import State
from collaudit.core.recommend.arm_evidence import MARGIN_S, LeftOutStretch, gather_evidence


def with_events(audit: Audit) -> Audit:
    hit = Collision("joint1", 2.0, 2.026, 0.1, 9.0, 4.0, "free")
    near = NearMiss("joint2", 5.0, 0.05, 3.5, 4.0, 0.875, "amplitude", "free")
    return replace(audit, result=replace(audit.result, collisions=(hit,), near_misses=(near,)))


def at(evidence_time: np.ndarray, time_s: float) -> int:
    return int(np.searchsorted(evidence_time, time_s))


def test_events_of_any_joint_are_left_out_for_all() -> None:
    audit = with_events(audit_of(np.ones((5000, 3))))
    evidence = gather_evidence([audit])
    (log,) = evidence.logs
    t = audit.signals.time_s
    for inside in (2.0 - 0.9 * MARGIN_S, 2.05, 2.1 + 0.9 * MARGIN_S, 5.02):
        assert not log.clean[at(t, inside)].any()
    for outside in (2.0 - 1.1 * MARGIN_S, 2.1 + 1.1 * MARGIN_S, 5.05 + 1.1 * MARGIN_S):
        assert log.clean[at(t, outside)].all()
    assert [(s.why, s.joints) for s in evidence.left_out] == [("alarm", ("joint1",)), ("near miss", ("joint2",))]
    clean_s = float(np.count_nonzero(log.clean[:, 2])) * log.period_s
    assert clean_s == pytest.approx(10.0 - 1.1 - 1.05, rel=1e-3)
    assert log.left_out_s("joint3") == pytest.approx(2.15, abs=0.01)


def test_known_contact_decides_and_alarms_elsewhere_count() -> None:
    audit = with_events(audit_of(np.ones((5000, 2))))
    evidence = gather_evidence([audit, audit], [[(5.0, 5.1)], ()])
    first, second = evidence.logs
    t = audit.signals.time_s
    assert first.contact_known and first.clean[at(t, 2.05)].all()
    assert not first.clean[at(t, 5.05)].any()
    assert second.clean.all(), "no contact at all, by a person's word"


def test_what_the_rule_fires_on_is_evidence_and_nothing_else() -> None:
    audit = audit_of(np.ones((3000, 2)))
    audit.signals.state[:1000, 0] = State.FRICTION_INTERVAL
    audit.signals.state[1000:2000, 0] = State.GAP
    audit.signals.residual_nm[2500, 0] = np.nan
    (log,) = gather_evidence([audit]).logs
    assert log.clean[:1000, 0].all(), "the rule fires at rest, too, beyond what friction explains"
    assert not log.clean[1000:2000, 0].any()
    assert not log.clean[2500, 0] and log.clean[2500, 1]


def test_further_stretches_are_left_out_for_all_joints() -> None:
    (log,) = gather_evidence([audit_of(np.ones((5000, 2)))]).logs
    less = log.without([LeftOutStretch(log.name, 3.0, 4.0, "suspicious", ("joint2",))])
    assert np.count_nonzero(~less.clean) == 2 * 500
    assert log.clean.all(), "the first stays as it was"
    assert less.left_out[0].why == "suspicious"
