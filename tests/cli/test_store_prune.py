"""``collaudit store prune`` on folders of audits: the plan first, and a pruned run keeps its verdict."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest


@pytest.fixture
def nights(arm, collaudit, tmp_path: Path) -> Path:
    """Two audits of two programs, one of which is pushed."""
    for night in ("one", "two"):
        (tmp_path / "logs" / "A").mkdir(parents=True, exist_ok=True)
        shutil.copyfile(arm.clean, tmp_path / "logs" / "A" / "calm.csv")
        shutil.copyfile(arm.pushed, tmp_path / "logs" / "A" / "pushed.csv")
        settings = ("-c", arm.config, "--friction", arm.friction, "-o", tmp_path / "nights" / night)
        assert collaudit("audit", tmp_path / "logs", *settings).code == 1
    return tmp_path / "nights"


def test_the_plan_is_said_first_and_a_pruned_run_keeps_its_verdict(nights: Path, arm, collaudit) -> None:
    def files() -> dict[str, bytes]:
        return {str(path): path.read_bytes() for path in nights.rglob("*") if path.is_file()}

    before = files()
    late = ("store", "prune", nights, "-c", arm.config, "--as-of", "2100-01-01")
    planned = collaudit(*late, "--json")
    plan = json.loads(planned.out)
    assert planned.code == 0 and files() == before and "nothing was deleted" in planned.err
    assert len(plan["runs"]) == 2 and plan["kept"] == 2, "the latest of each program stays"
    kept = collaudit(*late, "--baseline", nights / "one", "--baseline", nights / "two", "--json")
    assert json.loads(kept.out)["runs"] == [], "logs of a baseline stay"
    assert collaudit(*late, "--yes").code == 0
    for run in plan["runs"]:
        there = {path.name for path in Path(run["place"]).iterdir()}
        assert there == {"audit.json", "report.html", "finished.json"}
        assert "Page and signals were pruned on 2100-01-01" in (Path(run["place"]) / "report.html").read_text()
    gone = {path for path, content in before.items() if not Path(path).is_file()}
    assert len(gone) == 2 and all(path.endswith("signals.parquet") for path in gone)
    for out in nights.iterdir():
        for line in (out / "SHA256SUMS").read_text().splitlines():
            assert line.startswith("#") or (out / line.partition("  ")[2]).is_file()
    assert json.loads(collaudit(*late, "--json").out)["runs"] == []
    assert collaudit("store", "prune", nights / "one" / "assets").code == 2
    assert collaudit("store", "prune", nights, "--keep", "90d", "--keep-failed", "30d").code == 2
