"""A night's left-out files stand by name in every file of its audit, and count as not judged."""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

LATIN = os.fsdecode(b"sto\xdf.log")
OTHERS = ("collision.log", "run2.txt", "run3.dat", "line\nbreak.dat", LATIN)
LEFTOVERS = ("run.csv.1", "night.bag.active")


@pytest.fixture(scope="module")
def folder(arm, tmp_path_factory: pytest.TempPathFactory) -> Path:
    night = tmp_path_factory.mktemp("night")
    shutil.copy(arm.clean, night / "run1.csv")
    for name in OTHERS:
        shutil.copy(arm.pushed, night / name)
    return night


def audited(arm, collaudit, folder: Path, out: Path, rule: str):
    config = out.with_name(f"{out.name}.toml")
    config.write_text(f'{arm.config.read_text()}\n[policy]\nother_files = "{rule}"\n')
    flags = ("--friction", arm.friction, "-o", out, "--format", "junit,sarif,markdown,github")
    done = collaudit("audit", folder, "-c", config, *flags)
    names = ("summary.json", "index.html", "summary.xml", "summary.sarif", "summary.md", "summary.txt", "SHA256SUMS")
    return done, {name: (out / name).read_text(encoding="utf-8") for name in names}


@pytest.mark.parametrize(("rule", "code"), [("not_judged", 3), ("list", 0), ("ignore", 0)])
def test_other_names(rule: str, code: int, arm, collaudit, folder: Path, tmp_path: Path) -> None:
    done, texts = audited(arm, collaudit, folder, tmp_path / "out", rule)
    assert done.code == code, done.err
    shown = ("collision.log", "run2.txt", "run3.dat", r"line\nbreak.dat", "sto")
    for file, text in texts.items():
        plain = re.sub(r"\\+x0a|%0A", r"\\n", text)
        found = [name for name in shown if name in plain]
        assert found == ([] if rule == "ignore" else list(shown)), file
    summary = json.loads(texts["summary.json"])
    assert summary["counts"]["not_judged"] == (len(OTHERS) if rule == "not_judged" else 0)
    assert texts["summary.xml"].count("<error") == summary["counts"]["not_judged"]


@pytest.mark.parametrize("name", LEFTOVERS)
def test_leftovers_count_even_where_other_names_are_ignored(name: str, arm, collaudit, tmp_path: Path) -> None:
    night = tmp_path / "night"
    night.mkdir()
    shutil.copy(arm.clean, night / "run1.csv")
    shutil.copy(arm.pushed, night / name)
    done, texts = audited(arm, collaudit, night, tmp_path / "out", "ignore")
    assert done.code == 3 and all(name in text.replace("\\_", "_") for text in texts.values())
    assert json.loads(texts["summary.json"])["verdict"] == "not_judged"


def test_checksums_are_read_by_sha256sum(arm, collaudit, folder: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    audited(arm, collaudit, folder, out, "not_judged")
    check = subprocess.run(["sha256sum", "--strict", "-c", "SHA256SUMS"], cwd=out, capture_output=True, text=True)
    assert check.returncode == 0, check.stderr
    written = {path.relative_to(out).as_posix() for path in out.rglob("*") if path.is_file()} - {"SHA256SUMS"}
    lines = [line for line in (out / "SHA256SUMS").read_text().splitlines() if not line.startswith("#")]
    assert {line.partition("  ")[2] for line in lines} == written
    assert lines[0].split()[0] == hashlib.sha256((out / lines[0].split()[1]).read_bytes()).hexdigest()
    audit = next(out.glob("*/audit.json"))
    audit.write_text(audit.read_text().replace('"pass"', '"fail"', 1))
    assert subprocess.run(["sha256sum", "-c", "SHA256SUMS"], cwd=out, capture_output=True).returncode == 1


def test_the_case_of_other_suffixes(collaudit, tmp_path: Path) -> None:
    case = Path(os.environ.get("COLLAUDIT_DATA", "")).parent / "cases" / "folder_of_other_suffixes"
    if not case.is_dir():
        pytest.skip("the folder of cases is not here")
    friction = case.parent / "friction.json"
    done = collaudit("audit", case / "night", "-c", case / "c.toml", "--friction", friction, "-o", tmp_path / "out")
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert done.code == 3 and {Path(one["name"]).name for one in summary["left_out"]} == {"run2.txt", "run3.dat"}
    assert "no time column" in next(log["reasons"][0] for log in summary["logs"] if log["name"] == "night/run4.h5")
