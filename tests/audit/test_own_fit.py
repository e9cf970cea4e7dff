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
from collaudit.core.data.left_out import LeftOut, LeftOutSpan
from collaudit.fixtures.simulation import SimulatedFiles

Judge = Callable[..., AuditResult]


@pytest.fixture(scope="module")
def judge(made: Callable[..., SimulatedFiles]) -> Judge:
    files = made("free-clean", "paper6", duration_s=60.0)

    def audited(friction: FrictionFile, own: bool, gamma: object = 4.0) -> AuditResult:
        settings = load_config(files.config, {"detect.gamma_nm": gamma})
        prepared = prepare(files.log, settings)
        logs = {"it.csv": prepared.series.source.sha256} if own else {}
        known = replace(friction, provenance=replace(friction.provenance, logs=logs))
        return audit_log(prepared, settings.config, known, NOBODY).result

    return audited


def test_a_pass_by_a_fit_on_the_same_log_says_so(judge: Judge, friction: FrictionFile) -> None:
    found = judge(friction, own=True)
    assert found.verdict == "pass"
    assert any("fitted on the log that is judged" in text for text in found.exclusions)
    assert not any("gamma_nm" in text for text in found.exclusions)
    found = judge(friction, own=True, gamma="auto")
    assert any("a contact that the fit did not recognise raised them" in text for text in found.exclusions)
    assert not any("fitted on the log that is judged" in text for text in judge(friction, own=False).exclusions)


def test_contacts_denied_at_the_fit_are_said_at_every_audit(judge: Judge, friction: FrictionFile) -> None:
    spans = (LeftOutSpan(8.0, 14.0, ("joint1",), 40.0),)
    facts = LeftOut("stated", spans, 6.0, 0.1, 0.1, refused=False)
    found = judge(replace(friction, left_out={"night.csv": facts}), own=False)
    assert found.verdict == "pass"
    (text,) = [text for text in found.exclusions if "stated to be free of contact" in text]
    assert "8.0 to 14.0 s (joint1)" in text
    (said,) = [f for f in found.findings if f.code == "fit-contact-suspected"]
    assert not said.forbids_pass
