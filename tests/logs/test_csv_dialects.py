"""Ways to write a CSV besides a line of names and rows of numbers: read where they say one thing, else refused by name.

Each is compared with the plain table of the same motion.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from collaudit.core.config.schema import LogConfig
from collaudit.core.data.joint_log import JointLog
from collaudit.core.errors import LogError
from collaudit.core.logs.log_reading import read_log

ROWS = 300
TIME_S = 0.002 * np.arange(ROWS)
NAMES = ("t", "q1", "q2", "tau1", "tau2")
VALUES = np.column_stack([TIME_S, *(np.round(1000 * np.sin((k + 1) * TIME_S), 3) / 1000 for k in range(4))])


def rows(separator: str = ",", time: list[str] | None = None, decimal: str = ".") -> list[str]:
    stamps = time or [f"{t:.3f}" for t in TIME_S]
    cells = [[stamp, *(f"{x:.6f}" for x in row[1:])] for stamp, row in zip(stamps, VALUES, strict=True)]
    return [separator.join(cell.replace(".", decimal) for cell in row) for row in cells]


def read(path: Path, *lines: str, **csv: Any) -> JointLog:
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return read_log((path,), LogConfig.of({"units": {"effort": "Nm"}, "csv": csv}), robot_joints=None)


def assert_plain(log: JointLog, count: int = ROWS) -> None:
    np.testing.assert_allclose(log.time_s, TIME_S[:count], atol=1e-9)
    np.testing.assert_allclose(log.position_rad, VALUES[:count, 1:3], atol=1e-6)
    np.testing.assert_allclose(log.effort, VALUES[:count, 3:], atol=1e-6)


HEADER = ",".join(NAMES)
BODY = rows()
MIDDLE = [*BODY[:150], HEADER, *BODY[150:]]
READ = {
    "lines before": ["Start Time:,24.11.2026", "Rate:,500", "Units:,Nm", HEADER, *BODY],
    "text before": ["Recorded by the cell", "", "Operator: A, B and C", HEADER, *BODY],
    "a comment and lines before": ["# made by a tool", "Rate:,500", HEADER, *BODY],
    "a row of units": [HEADER, "s,rad,rad,Nm,Nm", *BODY],
    "a row of units in brackets": [HEADER, "[s],[rad],[rad],[Nm],[Nm]", *BODY],
    "lines before and a row of units": ["Rate:,500", HEADER, "s,rad,rad,Nm,Nm", *BODY],
    "its names again": [HEADER, *MIDDLE],
    "its names again and again": [HEADER, HEADER, *MIDDLE, HEADER],
    "lines behind": [HEADER, *BODY, "Samples: 300", "Operator: A"],
    "a line behind": [HEADER, *BODY, "--- end of the log ---"],
    "all of it": ["Rate:,500", HEADER, "s,rad,rad,Nm,Nm", *MIDDLE, "Samples: 300"],
    "semicolons": ["Rate:;500", HEADER.replace(",", ";"), *rows(";", decimal=","), "Samples: 300"],
}


@pytest.mark.parametrize("kind", READ)
def test_what_says_one_thing_is_read(kind: str, tmp_path: Path) -> None:
    assert_plain(read(tmp_path / "log.csv", *READ[kind]))


def test_units_of_a_row_are_those_of_the_columns(tmp_path: Path) -> None:
    log = read(tmp_path / "log.csv", HEADER, "ms,deg,deg,Nm,Nm", *BODY)
    np.testing.assert_allclose(log.time_s, TIME_S / 1e3, atol=1e-12)
    np.testing.assert_allclose(log.position_rad, np.radians(VALUES[:, 1:3]), atol=1e-6)


@pytest.mark.parametrize(("mark", "decimal"), [(".", ","), (",", ".")])
def test_marks_between_thousands(mark: str, decimal: str, tmp_path: Path) -> None:
    lines = rows(";", decimal=decimal)
    stamps = [f"{1000 + t:,.3f}".replace(",", "#").replace(".", decimal).replace("#", mark) for t in TIME_S]
    lines = [";".join([stamp, *line.split(";")[1:]]) for stamp, line in zip(stamps, lines, strict=True)]
    assert_plain(read(tmp_path / "log.csv", HEADER.replace(",", ";"), *lines, decimal=decimal, delimiter=";"))


#: What is refused, the line that is proposed, and what stating it is.
ASKED: dict[str, tuple[list[str], str, dict[str, Any]]] = {
    "a row of other words": ([HEADER, "x,y,y,z,z", *BODY], "units_row = true",
                             {"header": False, "comment": ["t,", "x,"], "time": 1,
                              "position": [2, 3], "effort": [4, 5]}),
    "remarks as wide as rows": ([HEADER, *BODY[:9], "note,a,b,c,d", *BODY[9:]], 'comment = ["note"]',
                                {"comment": ["note"]}),
    "remarks between": ([HEADER, *BODY[:9], "paused", *BODY[9:]], 'comment = ["paused"]', {"comment": ["paused"]}),
    "lines before as wide as rows": (["a,b,c,d,e", "f,g,h,i,j", HEADER, *BODY], "header", {"header": 3}),
}  # fmt: skip


@pytest.mark.parametrize("kind", ASKED)
def test_what_may_be_meant_otherwise_is_asked_for(kind: str, tmp_path: Path) -> None:
    lines, proposed, stated = ASKED[kind]
    with pytest.raises(LogError) as refused:
        read(tmp_path / "log.csv", *lines)
    hint = str(refused.value.hint)
    if kind != "lines before as wide as rows":  # its first line is taken for the names of columns
        assert proposed in hint
    assert_plain(read(tmp_path / "log.csv", *lines, **stated))


def test_a_cut_row_is_no_text_behind_the_table(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("\n".join([HEADER, *BODY])[:-20])
    log = read_log((path,), LogConfig.of({"units": {"effort": "Nm"}}), robot_joints=None)
    assert_plain(log, ROWS - 1)
    assert "log-partial" in {finding.code for finding in log.findings}


def of_day(begin_s: float) -> list[str]:
    whole = [begin_s + t for t in TIME_S]
    return [f"{int(t // 3600) % 24:02d}:{int(t // 60) % 60:02d}:{t % 60:06.3f}" for t in whole]


MIDNIGHT = 86_400.0
PARTS = {
    "time of day": (["Time"], [of_day(3600.0)], None),
    "past midnight": (["Time"], [of_day(MIDNIGHT - 0.2)], None),
    "date and time": (["Date", "Time"], [["2026-11-24"] * ROWS, of_day(3600.0)], ["Date", "Time"]),
    "a date with dots": (["Date", "Time"], [["4.1.2026"] * ROWS, of_day(3600.0)], ["Date", "Time"]),
    "time before the date": (["Time", "Date"], [of_day(3600.0), ["2026-11-24"] * ROWS], ["Time", "Date"]),
    "date, time and milliseconds": (
        ["Date", "Time", "ms"],
        [["24.11.2026"] * ROWS, ["08:53:20"] * ROWS, [str(round(1e3 * t)) for t in TIME_S]],
        ["Date", "Time", "ms"],
    ),
    "seconds and nanoseconds": (
        ["a", "b"],
        [[str(1_760_000_000 + int((0.7 + t) // 1)) for t in TIME_S],
         [str(round(1e9 * ((0.7 + t) % 1))) for t in TIME_S]],
        ["a", "b"],
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", PARTS)
def test_times_of_day_and_of_several_columns(kind: str, tmp_path: Path) -> None:
    names, columns, stated = PARTS[kind]
    lines = [",".join([*stamp, line.partition(",")[2]]) for *stamp, line in zip(*columns, BODY, strict=True)]
    header = ",".join([*names, *NAMES[1:]])
    csv = {"position": "q{i}", "effort": "tau{i}", "time": stated} if stated else {}
    log = read(tmp_path / "log.csv", header, *lines, **csv)
    np.testing.assert_allclose(log.time_s - log.time_s[0], TIME_S, atol=1e-6)
    assert (log.source.start_ns is not None) == (len(names) > 1), "a time of day tells no date"
    if len(names) > 1:
        stray = read_error(tmp_path / "log.csv", header, *lines, **{**csv, "time": ["q1", "q2"]})
        assert "expected" in stray


def read_error(path: Path, *lines: str, **csv: Any) -> str:
    with pytest.raises(LogError) as refused:
        read(path, *lines, **csv)
    return refused.value.render()


@pytest.mark.parametrize(("unit", "bits"), [("us", 32), ("ns", 32), ("us", 31)])
def test_counters_that_wrap_go_on(unit: str, bits: int, tmp_path: Path) -> None:
    scale = {"us": 1e6, "ns": 1e9}[unit]
    count = np.round(TIME_S * scale).astype(np.int64) + 2**bits - round(0.1 * scale)
    wrapped = count % 2**32 if bits == 32 else (count + 2**31) % 2**32 - 2**31
    path = tmp_path / "log.csv"
    path.write_text("\n".join([HEADER, *rows(time=[str(k) for k in wrapped.tolist()])]) + "\n")
    log = read_log((path,), LogConfig.of({"units": {"effort": "Nm", "time": unit}}), robot_joints=None)
    assert_plain(log)
    assert not [finding for finding in log.findings if finding.code == "log-clock"]


@pytest.mark.parametrize("joints", [["a", "b"], ["shoulder", "elbow"], ["x.y", "z"]])
def test_a_joint_state_as_ros2_topic_echo_writes_it_is_told_how_to_read(joints: list[str], tmp_path: Path) -> None:
    path = tmp_path / "echo.csv"
    lines = [
        ",".join([str(1_760_000_000 + k // 500), str(2_000_000 * (k % 500)), "base", *joints,
                  *(f"{x:.6f}" for x in (*row[1:3], 0, 0, *row[3:]))])
        for k, row in enumerate(VALUES)
    ]  # fmt: skip
    hint = read_error(path, *lines)
    said = re.findall(r"\[log(?:\.csv)?\] [^\[]*(?:\[[\d, ]*\][^\[]*)*", hint)
    stated = tomllib.loads(
        "\n".join(part.strip().removesuffix(";").replace("] ", "]\n", 1).replace("; ", "\n") for part in said)
    )
    settings = {**stated["log"], "units": {"effort": "Nm"}}
    log = read_log((path,), LogConfig.of(settings), robot_joints=joints)
    assert log.joint_names == tuple(joints)
    assert_plain(log)


@pytest.mark.parametrize(("joint", "names"), [("joint", ("a", "b")), ("name", ("j1", "j2")), ("axis", ("A1", "A2"))])
def test_a_table_with_a_row_a_joint_is_made_wide_by_the_command_it_is_told(
    joint: str, names: tuple[str, str], tmp_path: Path
) -> None:
    lines = [f"time,{joint},position,effort"]
    for row in VALUES:
        lines += [f"{row[0]:.3f},{name},{row[1 + k]:.6f},{row[3 + k]:.6f}" for k, name in enumerate(names)]
    said = read_error(tmp_path / "long.csv", *lines)
    command = re.search(r"python -c '(.*)'", said)
    assert command is not None
    subprocess.run([sys.executable, "-c", command[1]], cwd=tmp_path, check=True)
    log = read_log((tmp_path / "long.wide.csv",), LogConfig.of({"units": {"effort": "Nm"}}), robot_joints=names)
    assert log.joint_names == names
    assert_plain(log)


LISTED = {
    "commas": (", ", '"[{}]"', ","),
    "blanks": (" ", "[{}]", ","),
    "many blanks": ("   ", "[ {} ]", ","),
    "semicolons between": (", ", "[{}]", ";"),
    "tabs between": (",", "[{}]", "\t"),
}


def with_lists(kind: str) -> list[str]:
    inside, cell, between = LISTED[kind]
    packed = [[cell.format(inside.join(f"{x:.6f}" for x in row[a : a + 2])) for a in (1, 3)] for row in VALUES]
    lines = [between.join(["STATE", f"{t:.3f}", *two]) for t, two in zip(TIME_S, packed, strict=True)]
    return [between.join(["type", "timestamp", "positions", "torques"]), *lines]


@pytest.mark.parametrize("kind", LISTED)
def test_lists_in_cells_are_columns(kind: str, tmp_path: Path) -> None:
    log = read(tmp_path / "x.csv", *with_lists(kind))
    assert_plain(log)
    assert log.joint_names == ("joint1", "joint2")


@pytest.mark.parametrize("bad", ["[0.1]", "[0.1, 0.2, 0.3]", "0.1", "[0.1, x]", ""])
def test_a_list_of_another_length_is_refused_by_its_line(bad: str, tmp_path: Path) -> None:
    lines = with_lists("commas")
    lines[200] = f'STATE,{TIME_S[199]:.3f},"{bad}","[0.1, 0.2]"'
    assert "line 201" in read_error(tmp_path / "x.csv", *lines)


def test_lists_without_a_line_of_names_are_counted_as_they_stand(tmp_path: Path) -> None:
    log = read(tmp_path / "x.csv", *with_lists("commas")[1:], time=2, position=[3, 4], effort=[5, 6])
    assert_plain(log)
