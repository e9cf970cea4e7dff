"""``collaudit recommend`` from the shell: the answer, what it is pasted into, and what a person confirms."""

from __future__ import annotations

import json
import re
import shutil
import tomllib
from pathlib import Path

import numpy as np
import pytest
from residual_audits import audit_of, coloured

from collaudit.core.config.schema import Config
from collaudit.reports.files.run_files import write_run


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Ten minutes of two joints, with one push that nobody told of."""
    x = coloured(1, 600.0, joints=2)
    x[100_000:100_100] += np.array([8.0, 0.0])
    folder = tmp_path_factory.mktemp("recommend") / "run"
    write_run(folder, audit_of(x, gamma_nm=[100.0, 1.0]), None)
    return folder


def test_one_screen_with_the_answer_first(collaudit, run: Path) -> None:
    found = collaudit("recommend", run)
    lines = found.out.splitlines()
    assert found.code == 0 and len(lines) < 25
    assert lines[0] == "Asked: false alarms of the arm below 1 per 1,000 h, persistence 26 ms"
    assert lines[1].startswith("Answer: NOT SUPPORTED: 9 min 59 s of clean time support 1.2 per hour; ")
    assert "199 h 50 min more would support 1 per 1,000 h" in lines[1]
    assert "too loose" in found.out and "too tight" in found.out
    assert re.search(r"made\.mcap 199\.\d-200\.\d s: suspicious joint1, \S+ N·m for n samples", found.out)
    assert "joint1 " in next(line for line in lines if line.startswith("If nothing touched"))
    assert "1 stretch was left out" in found.err


def test_confirmed_by_a_person(collaudit, run: Path) -> None:
    found = json.loads(collaudit("recommend", run, "--clean", "--json").out)
    assert found["to_confirm"] == [] and found["counted"][0]["joints"] == ["joint1"]
    assert found["joints"]["joint1"]["largest_clean_nm"] > 6.0
    assert found["logs"][0]["contact_known"] is True


def test_the_folder_of_an_audit_stands_for_its_runs(collaudit, run: Path, tmp_path: Path) -> None:
    shutil.copytree(run, tmp_path / "out" / "run")
    (tmp_path / "out" / "summary.json").write_text("{}")
    whole = collaudit("recommend", tmp_path / "out", "--json")
    assert (whole.code, json.loads(whole.out)["joints"]) == (
        0,
        json.loads(collaudit("recommend", run, "--json").out)["joints"],
    )
    (tmp_path / "out" / "summary.json").unlink()
    assert "the folder holds no logs" in collaudit("recommend", tmp_path / "out").err, "a folder that is no audit's"


def test_rate_and_delay_are_asked_for(collaudit, run: Path) -> None:
    often = json.loads(collaudit("recommend", run, "--per-hour", "2", "--json").out)
    seldom = json.loads(collaudit("recommend", run, "--json").out)
    assert often["arm"]["supported"] is True and often["arm"]["bound_per_hour"] <= 2.0
    assert often["joints"]["joint2"]["gamma_nm"] < seldom["joints"]["joint2"]["gamma_nm"]
    quick = json.loads(collaudit("recommend", run, "--max-delay-ms", "20", "--json").out)
    assert quick["joints"]["joint1"]["n"] == 9, "nine samples and one of jitter"
    assert quick["joints"]["joint2"]["gamma_nm"] >= seldom["joints"]["joint2"]["gamma_nm"]
    never = collaudit("recommend", run, "--max-delay-ms", "2")
    assert never.code == 2 and "--max-delay-ms" in never.err


def test_snippets(collaudit, run: Path) -> None:
    made = tomllib.loads(collaudit("recommend", run, "--snippet", "config").out)
    detect = Config.model_validate({"detect": made["detect"]}).detect
    assert isinstance(detect.gamma_nm, dict) and set(detect.gamma_nm) == {"joint1", "joint2"}
    assert detect.persistence_ms == 26.0 and set(detect.evidence) == {"joint1", "joint2"}
    franka = collaudit("recommend", run, "--snippet", "franka").out
    values = ", ".join(f"{gamma:g}" for gamma in detect.gamma_nm.values())
    assert f"torque_nm{{{{{values}}}}}" in franka and "setCollisionBehavior(" in franka and "NOT SUPPORTED" in franka
    assert "not comparable" in collaudit("recommend", run, "--snippet", "ur").out


def test_too_little_is_refused(collaudit, tmp_path: Path) -> None:
    write_run(tmp_path / "short", audit_of(coloured(1, 100.0)), None)
    found = collaudit("recommend", tmp_path / "short")
    assert found.code == 3
    assert "refused" in found.out and "at least 3 min are needed" in found.out
