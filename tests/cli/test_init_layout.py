"""``init`` writes what reading a table takes besides its columns: lines to skip, units, remarks, times in parts."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from collaudit.core.config import load_config
from collaudit.core.logs.log_reading import read_log

Lines = list[str]


@pytest.fixture(scope="module")
def plain(arm: Any) -> Lines:
    return arm.clean.read_text(encoding="utf-8").splitlines()


@pytest.fixture(scope="module")
def robot(arm: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("robot") / "robot.toml"
    path.write_text(arm.config.read_text(encoding="utf-8").partition("[log.csv]")[0], encoding="utf-8")
    return path


def between(lines: Lines, *remarks: str) -> Lines:
    return [*lines[:9], remarks[0], *lines[9:50], *remarks[1:], *lines[50:]]


def stamped(lines: Lines, names: str, stamp: Callable[[float], str]) -> Lines:
    """The first column given by others."""
    rest = [line.partition(",")[2] for line in lines]
    return [f"{names},{rest[0]}", *(f"{stamp(float(line.split(',')[0]))},{row}"
                                    for line, row in zip(lines[1:], rest[1:], strict=True))]  # fmt: skip


def clock(t: float) -> str:
    return f"{8 + int(t // 3600):02d}:{int(t // 60) % 60:02d}:{t % 60:09.6f}"


def split(t: float) -> str:
    ns = 1_760_000_000_700_000_000 + round(t * 1e9)
    return f"{ns // 10**9},{ns % 10**9}"


def echoed(lines: Lines) -> Lines:
    """As ``ros2 topic echo --csv`` writes a JointState."""
    return [",".join([split(float(t)), "base", "joint1", "joint2", *values])
            for t, *values in (line.split(",")[:7] for line in lines[1:])]  # fmt: skip


HEAD = "a,b,c,d,e,f,g"
#: How the lines of a plain table are changed, and what the configuration must state for them.
LAYOUTS: dict[str, tuple[Callable[[Lines], Lines], dict[str, object]]] = {
    "a title as wide as rows": (lambda p: [HEAD, *p], {"header": 2}),
    "titles as wide as rows": (lambda p: [HEAD, "h,i,j,k,l,m,n", *p], {"header": 3}),
    "a title and an empty line": (lambda p: [HEAD, "", HEAD, *p], {"header": 4}),
    "a row of other words": (lambda p: [p[0], "-,angle,angle,,,,x", *p[1:]], {"units_row": True}),
    "a title and a row of a word": (lambda p: [HEAD, p[0], "z,,,,,,", *p[1:]], {"header": 2, "units_row": True}),
    "a remark": (lambda p: between(p, "paused"), {"comment": ["paused"]}),
    "a remark as wide as rows": (lambda p: between(p, "note,,,,,,x"), {"comment": ["note"]}),
    "two kinds of remarks": (lambda p: between(p, "paused by A", "go, on", "paused by A"),
                             {"comment": ["paused by A", "go"]}),
    "a date and a time": (lambda p: stamped(p, "Datum,Uhrzeit", lambda t: f"24.11.2026,{clock(t)}"),
                          {"time": ["Datum", "Uhrzeit"]}),
    "time before the date": (lambda p: stamped(p, "Time,Date", lambda t: f"{clock(t)},2026-11-24"),
                             {"time": ["Date", "Time"]}),
    "a date, a time and milliseconds": (
        lambda p: stamped(p, "Date,Time,ms", lambda t: f"2026-11-24,{clock(t)[:8]},{round(t * 1000) % 1000}"),
        {"time": ["Date", "Time", "ms"]},
    ),
    "seconds and nanoseconds": (lambda p: stamped(p, "u,v", split), {"time": ["u", "v"]}),
    "a JointState in a line": (echoed, {"time": [1, 2], "position": [6, 7], "velocity": [8, 9], "effort": [10, 11]}),
}  # fmt: skip


@pytest.mark.parametrize("layout", LAYOUTS)
def test_what_detect_needs_is_written_as_a_guess(
    layout: str, plain: Lines, robot: Path, arm: Any, collaudit: Any, tmp_path: Path
) -> None:
    change, stated = LAYOUTS[layout]
    log, written = tmp_path / "run.csv", tmp_path / "written.toml"
    log.write_text("\n".join(change(plain)) + "\n", encoding="utf-8")
    given = ("--set", f'friction.file="{arm.friction}"')
    outcome = collaudit("init", log, "-c", robot, *given, "-o", written)
    text = written.read_text(encoding="utf-8")
    csv = tomllib.loads(text)["log"]["csv"]
    assert {key: csv[key] for key in stated} == stated
    for key in stated:
        assert re.search(rf"^{key} = .*# GUESS", text, re.MULTILINE), "nobody stated it"
    assert "header" in stated or "header" not in csv
    if layout == "a row of other words":  # words that are no unit
        assert outcome.code == 3
        assert "a unit that is not converted" in outcome.err
        return
    assert outcome.code == 0, outcome.err
    read = read_log((log,), load_config(written, {}).config.log, robot_joints=("joint1", "joint2"))
    wanted = np.loadtxt(plain[1:], delimiter=",")
    np.testing.assert_allclose(read.time_s, wanted[:, 0] - wanted[0, 0], atol=6e-4 if "milli" in layout else 1e-6)
    np.testing.assert_allclose(read.position_rad, wanted[:, 1:3])
    assert read.effort is not None
    np.testing.assert_allclose(read.effort, wanted[:, 5:7])


def test_a_stated_key_stays_and_no_other_is_guessed(plain: Lines, robot: Path, collaudit: Any, tmp_path: Path) -> None:
    log, written = tmp_path / "run.csv", tmp_path / "written.toml"
    log.write_text("\n".join([HEAD, *between(plain, "paused", "resumed")]) + "\n", encoding="utf-8")
    given = ("--set", "log.csv.header=2", "--set", 'log.csv.comment=["paused"]')
    collaudit("init", log, "-c", robot, *given, "-o", written)
    text = written.read_text(encoding="utf-8")
    csv = tomllib.loads(text)["log"]["csv"]
    assert (csv["header"], csv["comment"]) == (2, ["paused", "resumed"])
    assert not re.search(r"^header = .*GUESS", text, re.MULTILINE)
