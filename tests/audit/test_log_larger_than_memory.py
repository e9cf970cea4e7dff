"""A log whose tables do not fit in memory is judged all the same, with the same bytes as result."""

from __future__ import annotations

from pathlib import Path

import pytest

from collaudit.core.api import audit
from collaudit.core.config import load_config
from collaudit.core.data.audit_result import Audit, FrictionFile
from collaudit.core.numeric import tables
from collaudit.reports.files.run_files import AUDIT_NAME, SIGNALS_NAME, write_run


def judged(log: Path, friction: FrictionFile, run: Path) -> Audit:
    made = audit(log, load_config(log.with_suffix(".toml")), friction)
    write_run(run, made, friction)
    return made


def test_results_are_the_same(
    hits: Path, friction: FrictionFile, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    judged(hits, friction, tmp_path / "in-memory")
    made, in_a_file = [], tables._in_a_file
    monkeypatch.setattr(tables, "memory_bytes", lambda: 0.0)
    monkeypatch.setattr(tables, "_in_a_file", lambda *shape: made.append(shape[:2]) or in_a_file(*shape))
    signals = judged(hits, friction, tmp_path / "in-files").signals
    assert made.count(signals.residual_nm.shape) >= 4, "velocity, model torque, residual, its uncertainty"
    for name in (AUDIT_NAME, SIGNALS_NAME):
        assert (tmp_path / "in-memory" / name).read_bytes() == (tmp_path / "in-files" / name).read_bytes()
