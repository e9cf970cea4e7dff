"""docs/python.md is a promise: its code runs as it stands, from top to bottom."""

from __future__ import annotations

import re
from pathlib import Path

import pandas as pd
import pytest

PAGE = Path(__file__).resolve().parents[2] / "docs" / "python.md"


def test_the_page_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert len(blocks) >= 7
    names: dict[str, object] = {}
    for block in blocks:
        exec(compile(block, str(PAGE), "exec"), names)
    audit, same, friction, again = (names[name] for name in ("audit", "same", "friction", "again"))
    assert audit.result == same.result
    assert friction == again
    assert audit.result.verdict == "fail"
    assert audit.result.collisions
    table = names["table"]
    assert isinstance(table, pd.DataFrame)
    assert len(table) == audit.signals.time_s.size
    assert list(table["residual_nm"].columns) == list(audit.signals.joint_names)
    assert table["residual_nm"]["joint1"].to_numpy() == pytest.approx(audit.signals.residual_nm[:, 0], nan_ok=True)
    assert Path("report.html").stat().st_size > 100_000
    assert "joint1" in capsys.readouterr().out


def test_what_the_tables_hold_is_what_the_result_holds(tmp_path: Path) -> None:
    """Each table has a row an item and the item's own values, also when there is none."""
    from collaudit.core import api
    from collaudit.core.findings import Finding

    class Holder:
        findings = (Finding("time-gap", "warning", "A gap.", start_s=1.0, end_s=2.0),)

    table = api.findings(Holder())  # type: ignore[arg-type]
    assert table.to_dict("records")[0]["code"] == "time-gap"
    assert table["end_s"].tolist() == [2.0]

    class Empty:
        findings = ()

    assert list(api.findings(Empty()).columns) == list(table.columns)  # type: ignore[arg-type]
