"""What is printed is what was applied: every event of a run follows again from its files, by the code of the page."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from origins import NOBODY
from repeated_program import GAMMA, Push, judged, program

from collaudit.core.api import prepare
from collaudit.core.audit import audit_log
from collaudit.core.config import load_config
from collaudit.core.data.audit_result import FrictionFile
from collaudit.core.errors import CollauditError
from collaudit.fixtures.simulation import SimulatedFiles
from collaudit.reports.files.event_recount import check_events
from collaudit.reports.files.run_files import open_run, write_run

PAGE = Path(__file__).resolve().parents[2] / "docs" / "python.md"
Made = Callable[..., SimulatedFiles]


def of_the_page() -> Callable[[Path], tuple[Any, list[tuple[float, str]], Any]]:
    """``recomputed`` as docs/python.md has it."""
    (block,) = re.findall(r"```python\n(import json\n.*?)\n\nfound,", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    names: dict[str, Any] = {}
    exec(compile(block, str(PAGE), "exec"), names)
    return names["recomputed"]


@pytest.mark.parametrize(
    ("scenario", "gamma_nm"),
    [("free-hits", "auto"), ("free-hits", "sharpest"), ("free-hits", 4.0), ("polish-const", 4.0), ("stop-go", "auto")],
)
def test_every_event_follows_from_the_files_of_its_run(
    made: Made, friction_of: Callable[[str], FrictionFile], tmp_path: Path, scenario: str, gamma_nm: str | float
) -> None:
    files = made(scenario, "paper6")
    settings = load_config(files.config, {"detect.gamma_nm": gamma_nm, "near_miss.amplitude": 0.5})
    friction = friction_of("paper6")
    audit = audit_log(prepare(files.log, settings), settings.config, friction, NOBODY, siblings=None)
    write_run(tmp_path, audit, friction)
    alarms, near_misses, contacts = of_the_page()(tmp_path)
    result, period = audit.result, audit.result.log.sample_period_s
    again = sorted(alarms.itertuples(index=False, name=None))
    ours = sorted((c.onset_s, c.onset_s + c.duration_s, c.joint) for c in result.collisions)
    assert [(onset, joint) for onset, _, joint in again] == [(onset, joint) for onset, _, joint in ours]
    assert [end for _, end, _ in again] == pytest.approx([end for _, end, _ in ours], abs=1e-3 * period)
    assert sorted(near_misses) == sorted((m.onset_s, m.joint) for m in result.near_misses)
    assert contacts.onset_s.tolist() == [c.onset_s for c in result.contacts]
    assert [set(c.joints) for c in result.contacts] == contacts.joint.tolist()
    assert result.collisions or scenario == "stop-go"
    assert all(m.ratio < 1.0 for m in result.near_misses)
    for event in result.collisions:
        assert abs(event.peak_nm) > event.gamma_nm >= result.rule.gamma_nm[event.joint] * (1 - 1e-6)


@pytest.mark.parametrize("detector", ["direct", "momentum"])
def test_a_report_counts_the_events_again(
    made: Made, friction_of: Callable[[str], FrictionFile], tmp_path: Path, detector: str
) -> None:
    files = made("free-hits", "paper6")
    settings = load_config(files.config, {"detect.gamma_nm": 4.0, "detect.detector": detector})
    friction = friction_of("paper6")
    audit = audit_log(prepare(files.log, settings), settings.config, friction, NOBODY, siblings=None)
    write_run(tmp_path, audit, friction)
    result, signals = audit.result, open_run(tmp_path).signals
    check_events(tmp_path, result, signals)
    first, *others = result.collisions
    for edited in (
        replace(result, collisions=tuple(others)),
        replace(result, collisions=(*result.collisions, replace(first, onset_s=first.onset_s + 1.0))),
        replace(result, collisions=(replace(first, onset_s=first.onset_s + 0.1), *others)),
        replace(result, collisions=(replace(first, duration_s=first.duration_s + 0.1), *others)),
        replace(result, collisions=(replace(first, peak_nm=0.5 * first.peak_nm), *others)),
        replace(result, near_misses=result.near_misses[1:]) if result.near_misses else replace(result, collisions=()),
        replace(result, rule=replace(result.rule, n=10 * result.rule.n)),
    ):
        with pytest.raises(CollauditError, match=r"contradicts signals\.parquet"):
            check_events(tmp_path, edited, signals)


@pytest.mark.parametrize("value", [0.0, np.nan])
def test_a_residual_that_was_wiped_out_is_no_report(
    made: Made, friction_of: Callable[[str], FrictionFile], tmp_path: Path, value: float
) -> None:
    files = made("free-hits", "paper6")
    settings = load_config(files.config, {"detect.gamma_nm": 4.0})
    friction = friction_of("paper6")
    audit = audit_log(prepare(files.log, settings), settings.config, friction, NOBODY, siblings=None)
    wiped = replace(audit.signals, residual_nm=np.full_like(audit.signals.residual_nm, value))
    write_run(tmp_path, replace(audit, signals=wiped), friction)
    with pytest.raises(CollauditError, match=r"contradicts signals\.parquet"):
        check_events(tmp_path, audit.result, open_run(tmp_path).signals)


def test_alarms_that_only_other_cycles_tell_follow_from_the_files_too(tmp_path: Path) -> None:
    heights = ((0.6, 6), (3.0, 9), (0.5, 11))
    audit = judged(program(16, pushes=[Push(cycle, 0.1, share * GAMMA["joint2"]) for share, cycle in heights])[0])
    write_run(tmp_path, audit, None)
    alarms, near_misses, _ = of_the_page()(tmp_path)
    assert [alarm.spoke for alarm in audit.result.collisions] == ["cycle", "both", "cycle"]
    ours = sorted((c.onset_s, c.joint) for c in audit.result.collisions)
    assert [(onset, joint) for onset, _, joint in sorted(alarms.itertuples(index=False, name=None))] == ours
    assert sorted(near_misses) == sorted((m.onset_s, m.joint) for m in audit.result.near_misses)
