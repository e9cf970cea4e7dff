"""A new kind of finding is one line in the table: verdict, page and schema know it then."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from origins import NOBODY
from user_guide.pages import findings_page

from collaudit.core import api
from collaudit.core.audit import audit_log
from collaudit.core.config import load_config
from collaudit.core.data.audit_result import AuditResult, FrictionFile
from collaudit.core.detection import judgement
from collaudit.core.findings import Finding, fact, finding_kinds
from collaudit.core.findings.finding_kinds import Effect, Severity
from collaudit.core.prepare.calibration import Calibration
from collaudit.core.prepare.preparation import prepare

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
    plain = audit_log(prepared, settings.config, friction, NOBODY, siblings=None).result
    assert plain.verdict == "pass", plain.reasons
    found = Finding(CODE, severity, "The gripper was open at 3 s.")
    told = replace(prepared, findings=(*prepared.findings, found))
    result = audit_log(told, settings.config, friction, NOBODY, siblings=None).result
    assert (result.verdict == "pass") == passes
    assert found in result.findings
    assert any("open at 3 s" in reason for reason in result.reasons) != passes
    assert "Close it." in findings_page()


def test_a_check_is_a_line_in_the_list(made, friction: FrictionFile, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(judgement, "CHECKS", (lambda log: [fact(f"It has {log.series.time_s.size} samples.")],))
    log = made("free-clean", "paper6", 1, duration_s=20.0).log[0]
    settings = load_config(Path(log).with_suffix(".toml"))
    prepared = api.prepare(log, settings, friction)
    result = audit_log(prepared, settings.config, friction, NOBODY, siblings=None).result
    assert f"It has {prepared.judged_series.time_s.size} samples." in [finding.text for finding in result.findings]


def test_a_check_that_excludes_a_joint_forbids_the_fail_as_it_forbids_the_pass(
    made, friction: FrictionFile, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a joint that a check excludes there is no alarm, and the others still fail."""
    path = made("free-clean", "paper6", 1, duration_s=20.0).log[0]
    settings = load_config(Path(path).with_suffix(".toml"))
    log = api.open_log([Path(path)], settings)
    effort = np.array(log.effort)
    for j, at_s in ((0, 6.0), (1, 6.0), (2, 12.0)):
        effort[(log.time_s > at_s) & (log.time_s < at_s + 0.3), j] += 40.0
    known = Calibration.of(friction, settings.config)
    robot = api.load_robot(settings, log.joint_names)
    prepared = prepare(replace(log, effort=effort), robot, settings.config, known)

    def judged(*joints: str) -> AuditResult:
        kind = finding_kinds.Kind("Its effort is no measurement.", "Measure it.", {"error": "not-judged-joint"})
        monkeypatch.setitem(finding_kinds.KINDS, CODE, kind)
        found = [Finding(CODE, "error", f"Nothing is judged by {joint}.", joint=joint) for joint in joints]
        monkeypatch.setattr(judgement, "CHECKS", (lambda log: found,))
        return audit_log(prepared, settings.config, friction, NOBODY, siblings=None).result

    plain = judged()
    assert plain.verdict == "fail"
    joint = plain.collisions[0].joint
    part = judged(joint)
    assert part.verdict == "fail"
    assert joint not in {c.joint for c in part.collisions} | {miss.joint for miss in part.near_misses}
    assert [c for c in plain.collisions if c.joint != joint] == list(part.collisions)
    whole = judged(*prepared.judged)
    assert (whole.verdict, whole.collisions, whole.near_misses) == ("not_judged", (), ())
