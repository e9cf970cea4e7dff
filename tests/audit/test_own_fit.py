"""A log judged with friction fitted on that very log, or on one whose contacts were denied: said in the exclusions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest
from origins import NOBODY

from collaudit.core.api import prepare
from collaudit.core.audit import audit_log
from collaudit.core.config import load_config
from collaudit.core.data.audit_result import AuditResult, FrictionFile
from collaudit.core.data.identification_result import LeftOut, LeftOutSpan
from collaudit.fixtures.simulation import SimulatedFiles

Judge = Callable[..., AuditResult]


@pytest.fixture(scope="module")
def judge(made: Callable[..., SimulatedFiles]) -> Judge:
    files = made("free-clean", "paper6", duration_s=60.0)

    def audited(
        friction: FrictionFile, own: bool, *others: str, gamma: object = 4.0, same: str = "refuse"
    ) -> AuditResult:
        settings = load_config(files.config, {"detect.gamma_nm": gamma, "policy.same_log": same})
        prepared = prepare(files.log, settings)
        logs = dict.fromkeys(others, "1" * 64) | ({"it.csv": prepared.series.source.sha256} if own else {})
        known = replace(friction, provenance=replace(friction.provenance, logs=logs))
        return audit_log(prepared, settings.config, known, NOBODY).result

    return audited


def test_a_fit_on_the_judged_log_alone_is_no_evidence(judge: Judge, friction: FrictionFile) -> None:
    for gamma, raised in ((4.0, False), ("auto", True)):
        found = judge(friction, True, gamma=gamma)
        assert found.verdict == "not_judged"
        (reason,) = found.reasons
        assert "fitted on the judged log alone" in reason and 'same_log = "allow"' in reason
        assert ("raised the thresholds" in reason) == raised
        assert reason not in found.exclusions
    assert judge(friction, False).verdict == "pass"


def test_it_is_accepted_where_the_policy_says_so_and_stays_an_exclusion(judge: Judge, friction: FrictionFile) -> None:
    found = judge(friction, True, same="allow")
    assert found.verdict == "pass", found.reasons
    assert any("fitted on the judged log alone" in text for text in found.exclusions)


def test_a_fit_on_other_logs_too_is_an_exclusion(judge: Judge, friction: FrictionFile) -> None:
    found = judge(friction, True, "other.csv")
    assert found.verdict == "pass", found.reasons
    assert any("fitted on the log that is judged and 1 more" in text for text in found.exclusions)


def test_friction_that_was_fitted_in_passing_is_no_evidence_either(made: Callable[..., SimulatedFiles]) -> None:
    files = made("free-clean", "paper6", duration_s=60.0)
    settings = load_config(files.config)
    found = audit_log(prepare(files.log, settings), settings.config, None, NOBODY).result
    assert found.verdict == "not_judged"
    assert found.reasons == tuple(f.text for f in found.findings if f.code == "friction-same-log")


def test_contacts_denied_at_the_fit_are_said_at_every_audit(judge: Judge, friction: FrictionFile) -> None:
    spans = (LeftOutSpan(8.0, 14.0, ("joint1",), 40.0),)
    facts = LeftOut("stated", spans, 6.0, 0.1, 0.1, refused=False)
    found = judge(replace(friction, left_out={"night.csv": facts}), False)
    assert found.verdict == "pass"
    (text,) = [text for text in found.exclusions if "stated to be free of contact" in text]
    assert "8.0 to 14.0 s (joint1)" in text
    (said,) = [f for f in found.findings if f.code == "fit-contact-suspected"]
    assert not said.forbids_pass
