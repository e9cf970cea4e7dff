"""A new kind of finding is one line in the table: verdict, page and schema know it then."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import pytest
from origins import NOBODY
from user_guide.pages import findings_page

from collaudit.core import api, audit
from collaudit.core.audit import audit_log
from collaudit.core.config import load_config
from collaudit.core.data.audit_result import FrictionFile
from collaudit.core.findings import Finding, fact, finding_kinds
from collaudit.core.findings.finding_kinds import Effect, Severity

CODE = "gripper-open"


@pytest.mark.parametrize(
    ("effects", "severity", "passes"),
    [({"warning": "none"}, "warning", True), ({"error": "not-judged-log"}, "error", False)],
)
def test_its_effect_is_all_that_counts(
    made, friction: FrictionFile, monkeypatch: pytest.MonkeyPatch, effects: Mapping[Severity, Effect], severity, passes
) -> None:
    kind = finding_kinds.Kind("The gripper was open.", "Close it.", effects)
    monkeypatch.setitem(finding_kinds.KINDS, CODE, kind)
    log = made("free-clean", "paper6", 1, duration_s=20.0).log[0]
    settings = load_config(Path(log).with_suffix(".toml"), {"detect.watch": ["joint1"]})
    prepared = api.prepare(log, settings, friction)
    plain = audit_log(prepared, settings.config, friction, NOBODY).result
    assert plain.verdict == "pass", plain.reasons
    found = Finding(CODE, severity, "The gripper was open at 3 s.")
    told = replace(prepared, findings=(*prepared.findings, found))
    result = audit_log(told, settings.config, friction, NOBODY).result
    assert (result.verdict == "pass") == passes
    assert found in result.findings
    assert any("open at 3 s" in reason for reason in result.reasons) != passes
    assert "Close it." in findings_page()


def test_a_check_is_a_line_in_the_list(made, friction: FrictionFile, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(audit, "CHECKS", (lambda log: [fact(f"It has {log.series.time_s.size} samples.")],))
    log = made("free-clean", "paper6", 1, duration_s=20.0).log[0]
    settings = load_config(Path(log).with_suffix(".toml"))
    prepared = api.prepare(log, settings, friction)
    result = audit_log(prepared, settings.config, friction, NOBODY).result
    assert f"It has {prepared.judged_series.time_s.size} samples." in [finding.text for finding in result.findings]
