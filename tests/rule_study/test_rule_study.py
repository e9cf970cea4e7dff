"""The study of a simulated log through the front door: its files, its page, its text."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from simulated_logs import Maker

from collaudit.core import api
from collaudit.core.config import load_config
from collaudit.core.data.audit_result import Audit, FrictionFile
from collaudit.reports.files.run_files import read_run, write_run
from collaudit.reports.page.html import html_text
from collaudit.reports.terminal.command_texts import study_text


@pytest.fixture(scope="module")
def studied(made: Maker, friction_of: Callable[[str], FrictionFile]) -> Audit:
    files = made("free-clean", "paper6", 41, duration_s=60.0)
    settings = load_config(
        files.config, {"study.run": True, "study.contacts": 60, "detect.watch": ["joint1", "joint3"]}
    )
    return api.audit(files.log, settings, friction_of("paper6"))


def test_planes_count_what_the_rule_counts(studied: Audit) -> None:
    assert studied.study is not None
    for joint, plane in studied.study.joints.items():
        assert len(plane.gamma_nm) == 100 and len(plane.n) == 50
        assert plane.configured is not None and plane.configured.alarms == 0
        assert plane.configured.n == studied.result.rule.n
        alarms = np.array(plane.alarms)
        assert np.all(np.diff(alarms[:, -1]) <= 0) and alarms[-1].max() == 0
        assert plane.clean_hours * 3600.0 <= 60.0
        torque = plane.configured.torque_nm
        assert torque is not None and torque > plane.configured.gamma_nm
        assert set(studied.study.parts[joint].falls_nm) >= {"noise", "reversal", "model", "ripple", "drift"}


def test_contacts_are_noticed_the_harder_the_more(studied: Audit) -> None:
    assert studied.study is not None
    configured = next(rule for rule in studied.study.rules if rule.name == "configured")
    everywhere = {c.shape: c for c in configured.contacts if c.place is None and c.motion is None}
    assert list(everywhere) == ["knock 5 ms", "knock 10 ms", "knock 20 ms", "push 100 ms", "clamp 1 s"]
    for contact in everywhere.values():
        forces = [noticed.force_n or np.inf for noticed in contact.noticed]
        assert contact.contacts == 60 and forces == sorted(forces)
    half = [everywhere[name].noticed[0].force_n or np.inf for name in everywhere]
    assert half == sorted(half, reverse=True), "a shorter contact needs more force"
    assert studied.study.force_map is not None
    first = next(pose for pose in studied.study.force_map.blind if pose.place == "end of link1")
    assert first.share == 1.0, "a force at the first joint's end goes through or along its axis in some direction"
    assert sum(cell.moments for cell in studied.study.force_map.cells) > 100


def test_a_study_survives_its_file_and_is_shown(studied: Audit, tmp_path: Path) -> None:
    write_run(tmp_path, studied, None)
    again = read_run(tmp_path)
    assert again.study == studied.study
    page = html_text([again])
    assert "What the rule costs and notices" in page and page.count('class="plot plane"') == 2
    assert page.count('class="plot forces"') == 1 and "Verdict on what is set" in page
    assert studied.study is not None and set(studied.study.set_rules) == {"joint1", "joint3"}
    text = study_text(studied.study, 120)
    assert "Verdict on what is set" in text and "too loose" not in study_text(studied.study, 120, answer=False)
    assert "knock 10 ms" in text and "By place and motion" in study_text(studied.study, 120, detail=True)
    assert all(len(line) <= 120 for line in text.splitlines())
    plain = Audit(studied.result, studied.signals)
    write_run(tmp_path, plain, None)
    assert read_run(tmp_path).study is None, "a study of an earlier audit must not outlive it"
    assert "What the rule costs" not in html_text([plain])


def test_no_study_unless_asked(made: Maker, friction_of: Callable[[str], FrictionFile]) -> None:
    files = made("free-clean", "paper6", 41, duration_s=60.0)
    assert load_config(files.config).config.study.run is False
