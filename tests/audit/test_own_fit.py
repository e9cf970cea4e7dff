"""A log judged with friction fitted on that very log, or on one whose contacts were denied: said in the exclusions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from origins import NOBODY
from push_campaign import free_log

from collaudit.core.api import prepare
from collaudit.core.audit import audit_log
from collaudit.core.config import load_config
from collaudit.core.data.audit_result import Audit, AuditResult, FrictionFile
from collaudit.core.data.identification_result import LeftOut, LeftOutSpan
from collaudit.core.fitting import fit_by_parts
from collaudit.fixtures.pushes import Push
from collaudit.fixtures.simulation import SimulatedFiles
from collaudit.reports.files.event_recount import check_events
from collaudit.reports.files.run_files import open_run, write_run

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
        return audit_log(prepared, settings.config, known, NOBODY, siblings=None).result

    return audited


def test_a_fit_on_the_judged_log_alone_is_no_evidence(judge: Judge, friction: FrictionFile) -> None:
    for gamma, raised in ((4.0, False), ("auto", True)):
        found = judge(friction, True, gamma=gamma)
        assert found.verdict == "not_judged"
        (reason,) = found.reasons
        assert "fitted on the judged log alone" in reason and 'same_log = "folds"' in reason
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
    found = audit_log(prepare(files.log, settings), settings.config, None, NOBODY, siblings=None).result
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


def by_folds(files: SimulatedFiles) -> tuple[Audit, AuditResult]:
    settings = load_config(files.config, {"detect.gamma_nm": "auto", "policy.same_log": "folds"})
    audit = audit_log(prepare(files.log, settings), settings.config, None, NOBODY, siblings=None)
    return audit, audit.result


@pytest.mark.parametrize("robot", ["paper6", pytest.param("seven", marks=pytest.mark.bench)])
def test_each_part_of_a_log_is_judged_by_a_fit_of_the_others(tmp_path: Path, robot: str) -> None:
    pushes = (Push(4, 100.0, "around", 31.0, 0.3), Push(3, 130.0, "around", 43.0, 0.3))
    audit, found = by_folds(free_log(robot, 5, 60.0, pushes, tmp_path / "hit"))
    assert found.verdict == "fail"
    assert [contact.onset_s for contact in found.contacts] == pytest.approx([31.0, 43.0], abs=0.15)
    write_run(tmp_path / "run", audit, None)
    check_events(tmp_path / "run", found, open_run(tmp_path / "run").signals)
    audit, clean = by_folds(free_log(robot, 5, 60.0, (), tmp_path / "clean"))
    assert clean.verdict == "pass", clean.reasons
    assert any("a touch that lasts through the log" in text for text in clean.exclusions), "it is no plain pass"
    lowest = np.array([clean.rule.gamma_nm[joint] for joint in audit.signals.joint_names])
    assert (audit.signals.gamma_nm >= np.float32(lowest)).all(), "no threshold in force lies below the printed one"
    assert {joint: found.rule.gamma_nm[joint] for joint in clean.rule.gamma_nm} == pytest.approx(
        clean.rule.gamma_nm, rel=0.15
    ), "what touched the arm does not raise the thresholds that it is judged by"


def test_the_thresholds_of_a_part_have_not_seen_it(tmp_path: Path) -> None:
    """Somebody leans on the arm in a block of a log that is stated to be free of contact, so all of it counts."""
    in_force: list[dict[bool, list[float]]] = []
    for pushes in ((), (Push(2, 150.0, "around", 20.4, 3.2),)):
        files = free_log("paper6", 5, 60.0, pushes, tmp_path / f"{len(pushes)}")
        settings = load_config(files.config, {"detect.gamma_nm": "auto", "fit.contact": "none"})
        parts = fit_by_parts(prepare(files.log, settings), settings.config, NOBODY)[1]
        at = round(22.0 / 60.0 * len(parts[0][0]))
        levels = [
            (rows[at], fit.thresholds.joints["joint1"].levels[-1].gamma_nm) for rows, fit in parts if fit.thresholds
        ]
        in_force.append(levels)
    clean, held = (
        {own: [gamma for its, gamma in levels if its == own] for own in (True, False)} for levels in in_force
    )
    assert held[True] == pytest.approx(clean[True], rel=0.15)
    assert min(held[False]) > 1.3 * max(clean[False]), "what is judged by it does see it"


def test_a_log_without_friction_takes_none_of_its_own_file(
    made: Callable[..., SimulatedFiles], friction: FrictionFile
) -> None:
    """Parts at rest tell no friction; a file with laws that names this log alone is not used in their stead."""
    files = made("rest-touches", "paper6")
    settings = load_config(files.config, {"policy.same_log": "folds"})
    prepared = prepare(files.log, settings)
    logs = {"it.csv": prepared.series.source.sha256}
    known = replace(friction, provenance=replace(friction.provenance, logs=logs))
    result = audit_log(prepared, settings.config, known, NOBODY, siblings=None).result
    assert all(fit.model is None for fit in result.friction.values())
    assert not any("Each part of the log was judged" in finding.text for finding in result.findings)
