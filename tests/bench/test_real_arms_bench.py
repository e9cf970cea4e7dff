"""How the bench of imperfect arms counts."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(str(Path(__file__).parent))
    import real_arms

    return real_arms


def event(onset_s: float, duration_s: float) -> dict[str, float]:
    return {"onset_s": onset_s, "duration_s": duration_s}


def test_pushes_found_and_false_contacts(bench: Any) -> None:
    truth = {"collisions": [event(1, 0.2), event(5, 0.2)], "near_misses": [event(8, 0.1)], "below_threshold": None}
    audit = {
        "collisions": [event(1.1, 0.1), event(1.15, 0.1), event(8.05, 0.02), event(12, 0.1), event(12.3, 0.1)],
        "log": {"duration_s": 20.0},
        "coverage": {"joints": {"a": {"judged_s": 10.0}, "b": {"judged_s": 20.0}}},
        "findings": [{"code": "x", "severity": "warning"}, {"code": "y", "severity": "info"}],
    }
    counted = bench._counted(audit, truth)
    assert (counted["pushes"], counted["found"], counted["false"]) == (2, 1, 1)
    assert counted["judged"] == 0.75 and counted["findings"] == ["x"]
    cells = [bench.Cell((0, 0, 1), 2, 1, 1, 1800.0, 0.75, ("x",)), bench.Cell((0, 3))]
    assert bench.table_row("odd", cells, set()) == "| odd | `x` | 1 of 2 | 50 % (1/2) | 1 in 30.0 min | 75 % |"
    assert "0 of 1 (exit 3)" in bench.table_row("odd", cells[1:], set())
