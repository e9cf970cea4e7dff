"""Contact that was found from the wrist's force: a collision of the tool must not declare itself intended."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from origins import NOBODY

from collaudit.core.api import prepare
from collaudit.core.audit import audit_log
from collaudit.core.config import load_config
from collaudit.core.config.schema import PhasesConfig
from collaudit.core.data.audit_result import FrictionFile
from collaudit.core.data.joint_log import Annotation
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.prepare import phases
from collaudit.core.prepare.commanded_force import contact_torque
from collaudit.core.prepare.phases import commanded_share, contact_mask, excess_findings, find_phases, found_finding
from collaudit.core.prepare.prepared import Prepared

T = 0.008
FIND = PhasesConfig(find="wrench")


def pushes(*sizes_n: float, lasting_s: float = 2.0) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Time, force and what is found of one push every ten seconds."""
    time_s = T * np.arange(round(10.0 * (len(sizes_n) + 1) / T))
    force = np.full(time_s.size, 0.5)
    for k, size in enumerate(sizes_n, start=1):
        force[(time_s >= 10.0 * k) & (time_s < 10.0 * k + lasting_s)] = size
    return time_s, force, contact_mask(find_phases(force, T))


@pytest.mark.parametrize("lasting_s", [0.6, 3.0])
@pytest.mark.parametrize("sizes_n", [(117.0,), (117.0, 117.0)])
def test_few_pushes_do_not_show_themselves_to_be_usual(sizes_n: tuple[float, ...], lasting_s: float) -> None:
    time_s, force, contact = pushes(*sizes_n, lasting_s=lasting_s)
    share, excess = commanded_share(time_s, force, contact, FIND, found=True)
    assert (share[force > 100.0] == 0.0).all()
    said = excess_findings(excess, FIND)
    assert [round(finding.start_s or 0.0) for finding in said] == [10, 20][: len(sizes_n)]
    assert all("117 N" in finding.text and "All of it was judged" in finding.text for finding in said)


@pytest.mark.parametrize("sizes_n", [(40.0,) * 3, (40.0, 55.0, 30.0, 45.0), (40.0,) * 9])
def test_work_again_and_again_is_commanded(sizes_n: tuple[float, ...]) -> None:
    share, excess = commanded_share(*pushes(*sizes_n), FIND, found=True)
    assert (share == 1.0).all()
    assert excess == ()


@pytest.mark.parametrize("sizes_n", [(40.0, 40.0, 117.0), (40.0, 117.0, 117.0), (40.0, 117.0, 40.0, 40.0, 40.0)])
def test_a_collision_among_work_is_judged_whole(sizes_n: tuple[float, ...]) -> None:
    time_s, force, contact = pushes(*sizes_n)
    share, excess = commanded_share(time_s, force, contact, FIND, found=True)
    assert (share[force > 100.0] == 0.0).all()
    assert (share[force == 40.0] == 1.0).all()
    assert len(excess) == sizes_n.count(117.0)


def test_a_blow_in_found_work_is_meant_up_to_what_is_usual() -> None:
    time_s, force, contact = pushes(40.0, 40.0, 40.0, lasting_s=6.0)
    blow = (time_s > 22.0) & (time_s < 22.2)
    force[blow] = 150.0
    share, (found,) = commanded_share(time_s, force, contact, FIND, found=True)
    assert found.limit_n == pytest.approx(65.0)
    assert (share * force)[blow].max() == pytest.approx(65.0)
    assert (share[~blow] == 1.0).all()


def test_a_stated_limit_holds_for_found_contact() -> None:
    time_s, force, contact = pushes(40.0)
    config = PhasesConfig(find="wrench", force_limit_n=60.0)
    share, excess = commanded_share(time_s, force, contact, config, found=True)
    assert (share == 1.0).all()
    assert excess == ()
    assert "force up to 60 N is taken" in found_finding(time_s, force, contact, config).text


def test_found_contact_is_an_exclusion_with_number_times_and_force() -> None:
    time_s, force, contact = pushes(40.0, 41.0, 42.0, 40.0)
    said = found_finding(time_s, force, contact, FIND)
    assert said.excludes
    assert "4 contact phases" in said.text
    assert "9.984 to 12.02 s" in said.text
    assert "and 1 more" in said.text
    assert "42 N at 30 s" in said.text


def polished(log: Path, **phases: object) -> Prepared:
    """The log with no phase but those that its wrench tells."""
    of_log = {"approach": [], "contact": [], "retreat": [], "force_control": [], "find": "wrench", **phases}
    return prepare((log,), load_config(log.with_suffix(".toml"), {f"phases.{key}": of_log[key] for key in of_log}))


def test_one_found_contact_of_a_log_is_judged_unless_its_force_is_stated(polishing: Path) -> None:
    for limit, commanded in ((None, False), (60.0, True)):
        log = polished(polishing, **({} if limit is None else {"force_limit_n": limit}))
        assert log.contact_nm is not None
        working = contact_mask(log.phases)
        assert working.any()
        assert np.any(np.abs(log.contact_nm[working]) > 1.0) == commanded
        (said,) = (finding for finding in log.findings if finding.code == "phases-unknown")
        assert said.excludes


def test_no_force_is_commanded_where_no_contact_is_found(polishing: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(phases, "CONTACT_FORCE_N", 500.0)
    log = polished(polishing)
    assert log.contact_nm is not None
    assert not contact_mask(log.phases).any()
    assert not np.any(log.contact_nm)
    assert "phases-unknown" not in {finding.code for finding in log.findings}


def test_a_tool_force_that_must_be_noticed_is_no_pass_where_nothing_says_that_it_was_meant(
    polishing: Path, friction: FrictionFile
) -> None:
    for asked_n, stated, said in ((25.0, {}, True), (100.0, {}, False), (25.0, {"force_limit_n": 60.0}, False)):
        log = polished(polishing, find="off", **stated)
        settings = {"policy.observable_n": {"tool": asked_n, "forearm": 300.0}}
        config = load_config(polishing.with_suffix(".toml"), settings).config
        found = audit_log(log, config, friction, NOBODY, siblings=None).result
        reasons = [reason for reason in found.reasons if "nothing says that it was meant to" in reason]
        assert len(reasons) == said, (asked_n, stated, found.reasons)
        assert found.verdict == "fail", "its pushes are before the sensor"


def test_no_force_is_commanded_where_the_log_says_that_all_of_it_is_free(polishing: Path) -> None:
    log = polished(polishing, find="off")
    free = (Annotation("free", "/phase", ((0.0, float(log.series.time_s[-1])),)),)
    for said, commanded in (((), True), (free, False)):
        config = load_config(polishing.with_suffix(".toml"), {"phases.contact": [], "phases.force_control": []}).config
        made = contact_torque(replace(log.series, phases=said), log.robot, np.zeros_like(log.phases), config)
        assert made.torque_nm is not None
        assert np.any(made.torque_nm) == commanded
        assert ("phases-unknown" in {finding.code for finding in made.findings}) == commanded
