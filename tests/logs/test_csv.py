"""CSV: what is recognised, what is converted, and what is refused, by line and column."""

from __future__ import annotations

import bz2
import gzip
import lzma
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zstandard
from given_values import given_values

from collaudit.core.config.schema import LogConfig
from collaudit.core.errors import ConfigError, LogError
from collaudit.core.logs.inputs import group_inputs
from collaudit.core.logs.log_description import describe
from collaudit.core.logs.log_guess import guess_csv_columns
from collaudit.core.logs.log_reading import read_log

ROWS = [(0.01 * k, 0.1 * k, -0.2 * k, 1.0 + k, 2.0 - k) for k in range(40)]
PLAIN = "t,q1,q2,tau1,tau2"
NM: dict[str, Any] = {"units": {"effort": "Nm", "time": "s"}}


def table(header: str = PLAIN, sep: str = ",", decimal: str = ".", rows: Any = ROWS) -> str:
    cells = (sep.join(f"{x:.6g}".replace(".", decimal) for x in row) for row in rows)
    return "\n".join([header.replace(",", sep), *cells]) + "\n"


def write(path: Path, text: str | bytes) -> Path:
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


def read(path: Path, settings: dict[str, Any] | None = None, **extra: Any) -> Any:
    return read_log((path,), LogConfig.of(settings or {}), **{"robot_joints": None, **extra})


def check(log: Any, *, effort: bool = True) -> None:
    expected = np.array(ROWS)
    np.testing.assert_allclose(log.time_s, expected[:, 0], atol=1e-9)
    np.testing.assert_allclose(log.position_rad, expected[:, 1:3], rtol=1e-12)
    if effort:
        np.testing.assert_allclose(log.effort, expected[:, 3:5], rtol=1e-12)


@pytest.mark.parametrize(
    "text",
    [
        table(),
        table(sep=";"),
        table(sep=";", decimal=","),
        table(sep="\t"),
        table(sep="\t", decimal=","),
        table(sep="|"),
        table().replace(",", "   "),
        "\ufeff" + table(),
        "# made by a robot\n# on a Monday\n" + table(),
        table().replace("t,q1", "# t,q1"),
        table(header='"t","q1","q2","tau1","tau2"'),
        table(header=" t , q1 , q2 , tau1 , tau2 "),
        table().replace("\n", "\r\n"),
        table().replace("0.03,", "# a remark\n0.03,"),
        table() + "\n\n",
        table(header="t,q1 [rad],q2 [rad],tau1 [Nm],tau2 [Nm]"),
        table(header="Time,actual_q_0,actual_q_1,effort_0,effort_1"),
        table(header="timestamp,position_joint1,position_joint2,effort_joint1,effort_joint2"),
        table(header="t,a/position,b/position,a/effort,b/effort"),
        table(header="t,joint1_pos,joint2_pos,joint1_torque,joint2_torque"),
    ],
)
def test_written_in_many_ways(text: str, tmp_path: Path) -> None:
    log = read(write(tmp_path / "log.csv", text), NM)
    check(log)
    assert log.source.format == "csv"
    assert [finding.code for finding in log.findings] == ["log-guessed"]


@pytest.mark.parametrize(
    "pack",
    [gzip.compress, lzma.compress, bz2.compress, zstandard.ZstdCompressor().compress],
    ids=["gz", "xz", "bz2", "zst"],
)
def test_compressed_by_content(pack: Callable[[bytes], bytes], tmp_path: Path) -> None:
    check(read(write(tmp_path / "log", pack(table().encode())), NM))


def test_utf16(tmp_path: Path) -> None:
    check(read(write(tmp_path / "log.csv", table().encode("utf-16")), NM))


def test_headerless_by_number(tmp_path: Path) -> None:
    text = table().split("\n", 1)[1]
    settings = {**NM, "csv": {"time": 1, "position": [2, 3], "effort": [4, 5]}}
    log = read(write(tmp_path / "log.csv", text), settings)
    check(log)
    assert log.joint_names == ("joint1", "joint2")
    assert log.findings == ()
    robot = read(tmp_path / "log.csv", settings, robot_joints=("shoulder", "elbow"))
    assert robot.joint_names == ("shoulder", "elbow")
    assert "robot's joints in its order" in robot.findings[0].text
    with pytest.raises(LogError, match="no columns of joint positions"):
        read(tmp_path / "log.csv")


def test_columns_by_names_in_any_order(tmp_path: Path) -> None:
    path = write(tmp_path / "log.csv", table(header="t,Angle B,Angle A,Kraft B,Kraft A"))
    settings = {**NM, "csv": {"time": "t", "position": ["Angle A", "Angle B"], "effort": ["Kraft A", "Kraft B"]}}
    log = read(path, settings)
    np.testing.assert_allclose(log.position_rad[:, ::-1], np.array(ROWS)[:, 1:3])
    settings["csv"]["effort"] = ["Kraft A", "Kraft C"]
    with pytest.raises(LogError, match="Kraft C"):
        read(path, settings)


def test_named_joints_are_mapped_by_name(tmp_path: Path) -> None:
    path = write(tmp_path / "log.csv", table(header="t,pos_elbow,pos_shoulder,eff_elbow,eff_shoulder"))
    settings = {**NM, "csv": {"time": "t", "position": "pos_{joint}", "effort": "eff_{joint}"}}
    log = read(path, settings, robot_joints=("shoulder", "elbow", "wrist"))
    assert log.joint_names == ("shoulder", "elbow")
    np.testing.assert_allclose(log.position_rad[:, 1], np.array(ROWS)[:, 1])
    assert [finding.code for finding in log.findings] == ["log-joints-missing"]


def test_units_in_headers_and_in_the_configuration(tmp_path: Path) -> None:
    path = write(tmp_path / "log.csv", table(header="t,q1 [deg],q2 [deg],tau1,tau2"))
    log = read(path)
    np.testing.assert_allclose(log.position_rad, np.radians(np.array(ROWS)[:, 1:3]))
    texts = {finding.text for finding in log.findings if finding.code == "log-guessed"}
    assert any("effort" in text and "N·m" in text for text in texts)
    assert any("time" in text for text in texts)
    stated = read(path, {"units": {"position": "rad", "effort": "raw", "time": "s"}})
    np.testing.assert_allclose(stated.position_rad, np.array(ROWS)[:, 1:3])
    assert stated.effort_unit == "raw"
    currents = write(tmp_path / "i.csv", table(header="t,q1,q2,actual_current_0,actual_current_1"))
    with pytest.raises(ConfigError, match="the efforts are currents"):
        read(currents)


@pytest.mark.parametrize(
    ("scale", "unit", "start"),
    [(1e3, "ms", None), (1e9, "ns", None), (1.0, "s", 1_700_000_000), (1e9, "auto", 1_700_000_000)],
)
def test_time_units(scale: float, unit: str, start: int | None, tmp_path: Path) -> None:
    whole = [(round(((start or 0) + row[0]) * 1e9) if scale == 1e9 else 0, *row[1:]) for row in ROWS]
    text = PLAIN + "\n"
    for row, exact in zip(ROWS, whole, strict=True):
        stamp = str(exact[0]) if scale == 1e9 else f"{((start or 0) + row[0]) * scale:.3f}"
        text += ",".join([stamp, *(f"{x:.6g}" for x in row[1:])]) + "\n"
    log = read(write(tmp_path / "log.csv", text), {"units": {"time": unit, "effort": "Nm"}})
    np.testing.assert_allclose(log.time_s, [row[0] for row in ROWS], atol=1e-6 if scale == 1e9 else 1e-12)
    assert log.source.start_ns == (start * 10**9 if start else None)


def test_iso_times(tmp_path: Path) -> None:
    text = PLAIN + "\n"
    for k, row in enumerate(ROWS):
        text += ",".join([f"2026-03-01T10:00:0{k // 10}.{k % 10}00Z", *(f"{x:.6g}" for x in row[1:])]) + "\n"
    log = read(write(tmp_path / "log.csv", text), {"units": {"effort": "Nm"}})
    np.testing.assert_allclose(log.time_s, np.arange(40) * 0.1, atol=1e-12)
    assert log.source.start_ns == 1772359200000000000


@pytest.mark.parametrize(
    ("old", "new", "line", "words"),
    [
        ("0.5,-1,6,-3", "0.5,-1,6", 7, ("4 cells", "5")),
        ("0.5,-1,6,-3", "0.5,-1,6,-3,9", 7, ("6 cells",)),
        ("0.5,-1,6,-3", "0.5,OFF,6,-3", 7, ("'q2'", "'OFF'")),
        ("0.5,-1,6,-3", "0.5,-1,6,1.2.3", 7, ("'tau2'", "'1.2.3'")),
        ("0.05,0.5", "noon,0.5", 7, ("'t'", "'noon'")),
    ],
)
def test_errors_name_line_and_column(old: str, new: str, line: int, words: tuple[str, ...], tmp_path: Path) -> None:
    text = table()
    assert old in text
    with pytest.raises(LogError) as caught:
        read(write(tmp_path / "log.csv", text.replace(old, new)))
    said = caught.value.render()
    assert f"line {line}" in said
    for word in words:
        assert word in said, said


def test_empty_cells_are_missing_values(tmp_path: Path) -> None:
    log = read(write(tmp_path / "log.csv", table().replace("0.5,-1,6,-3", "0.5,,6,NaN")), NM)
    assert np.isnan(log.position_rad[5, 1])
    assert np.isnan(log.effort[5, 1])
    assert np.isnan(log.position_rad).sum() == 1


@pytest.mark.parametrize("text", ["", "\n\n", PLAIN + "\n", "# only a remark\n"])
def test_files_without_rows(text: str, tmp_path: Path) -> None:
    with pytest.raises(LogError):
        read(write(tmp_path / "log.csv", text))


def test_a_text_called_mcap(tmp_path: Path) -> None:
    path = write(tmp_path / "log.mcap", "version https://git-lfs.github.com/spec/v1\nsize 12\n")
    for function in (lambda: read(path), lambda: describe((path,)) and read(path)):
        with pytest.raises(LogError, match=r"called \.mcap and holds text") as caught:
            function()
        assert "LFS" in caught.value.render()


def test_thousands_of_columns(tmp_path: Path) -> None:
    names = ["t", *(f"q{j + 1}" for j in range(7)), *(f"tau{j + 1}" for j in range(7)), *(f"x{j}" for j in range(4000))]
    rows = [[0.01 * k, *np.arange(len(names) - 1)] for k in range(30)]
    log = read(write(tmp_path / "log.csv", table(",".join(names), rows=rows)), NM)
    assert log.joint_names == tuple(f"joint{j + 1}" for j in range(7))
    np.testing.assert_array_equal(log.position_rad[3], np.arange(7))


def test_quantities_over_files_need_one_time_column(tmp_path: Path) -> None:
    rows = np.array(ROWS)
    first = write(tmp_path / "a_pos.csv", table("t,a_position,b_position", rows=rows[:, :3]))
    second = write(tmp_path / "b_eff.csv", table("t,a_effort,b_effort", rows=rows[:, [0, 3, 4]]))
    other = write(tmp_path / "c_all.csv", table())
    settings = LogConfig.of(NM)
    assert group_inputs([first, second, other], settings) == [(first, second), (other,)]
    check(read_log((second, first), settings, robot_joints=None))
    shifted = write(tmp_path / "d_eff.csv", table("t,a_effort,b_effort", rows=rows[1:, [0, 3, 4]]))
    assert group_inputs([first, shifted], settings) == [(first,), (shifted,)]
    longer = write(tmp_path / "e_eff.csv", table("t,a_effort,b_effort", rows=rows[1:, [0, 3, 4]]))
    with pytest.raises(LogError, match="do not share their time column"):
        read_log((first, longer), settings, robot_joints=None)


def test_wrench_columns(tmp_path: Path) -> None:
    names = ["fx", "fy", "fz", "mx", "my", "mz"]
    rows = np.hstack([np.array(ROWS), np.arange(240).reshape(40, 6)])
    path = write(tmp_path / "log.csv", table(PLAIN + "," + ",".join(names), rows=rows))
    log = read(path, {**NM, "csv": {"wrench": names}})
    check(log)
    np.testing.assert_array_equal(log.wrench.wrench, np.arange(240).reshape(40, 6))


def test_temperature_columns(tmp_path: Path) -> None:
    warm = [(*row, 30.0 + k, 31.0 + k) for k, row in enumerate(ROWS)]
    for head, settings in (
        (f"{PLAIN},temp1,temp2", NM),
        (
            f"{PLAIN},a,b",
            {**NM, "csv": {"time": "t", "position": "q{i}", "effort": "tau{i}", "temperature": ["a", "b"]}},
        ),
    ):
        log = read(write(tmp_path / "t.csv", table(head, rows=warm)), settings)
        check(log)
        np.testing.assert_allclose(log.temperature_c, np.array(warm)[:, 5:])
    assert read(write(tmp_path / "c.csv", table()), NM).temperature_c is None


def test_a_guess_can_be_written_down_and_read_without_guessing(tmp_path: Path) -> None:
    path = write(tmp_path / "log.csv", table(header="zeit;q1;q2;tau1;tau2".replace(";", ","), sep=";", decimal=","))
    assert guess_csv_columns([path]) is not None
    path = write(tmp_path / "log.csv", table(sep=";", decimal=","))
    guess = guess_csv_columns([path])
    assert guess is not None
    config, joints = guess.csv, guess.joints
    assert joints == ("joint1", "joint2")
    assert (config.position, config.effort, config.delimiter, config.decimal) == ("q{i}", "tau{i}", ";", ",")
    log = read(path, {**NM, "csv": given_values(config)})
    check(log)
    assert log.findings == ()


def test_a_bomb_is_refused(tmp_path: Path) -> None:
    text = (PLAIN + "\n").encode() + b"0,0,0,0,0\n" * 8_000_000
    path = write(tmp_path / "log.csv.zst", zstandard.ZstdCompressor().compress(text))
    assert path.stat().st_size < 30_000
    with pytest.raises(LogError, match="holds more than a log of this size is read for"):
        read(path, NM)


@pytest.mark.parametrize("method", ["gzip", "xz", "zstd", "bz2"])
def test_a_compressed_table_cut_short_is_partial(tmp_path: Path, method: str) -> None:
    """The whole lines before the cut are read, and that they are not all is said."""
    pack = {
        "gzip": gzip.compress, "xz": lambda data: lzma.compress(data, preset=0),
        "zstd": zstandard.ZstdCompressor().compress, "bz2": bz2.compress,
    }[method]  # fmt: skip
    rng = np.random.default_rng(1)
    values = rng.normal(size=60_000)
    text = "t,q1\n" + "".join(f"{k / 100:.2f},{value!r}\n" for k, value in enumerate(values.tolist()))
    whole, path = tmp_path / "whole.csv", tmp_path / "log.csv"
    data = pack(text.encode())
    whole.write_bytes(data)
    assert "log-partial" not in {
        finding.code for finding in read_log((whole,), LogConfig(), robot_joints=None).findings
    }
    path.write_bytes(data[: len(data) * 9 // 10])
    log = read_log((path,), LogConfig(), robot_joints=None)
    assert [finding.severity for finding in log.findings if finding.code == "log-partial"] == ["error"]
    count = log.time_s.shape[0]
    assert 1000 < count < 60_000
    np.testing.assert_array_equal(log.position_rad[:, 0], values[:count])


@pytest.mark.parametrize("form", ["plain", "crlf", "blanks", "semicolons", "gzip"])
@pytest.mark.parametrize("drop", [3, 5, 9, 12])
def test_a_table_cut_inside_its_last_row_is_partial(drop: int, form: str, tmp_path: Path) -> None:
    """The rows before are read, and that one is missing is said."""
    rows = [(*row[:4], -1.5 - row[4] * 1e-9) for row in ROWS]
    text = table(rows=rows, sep={"blanks": "  ", "semicolons": ";"}.get(form, ",")).rstrip("\n")
    last = text.rsplit("\n", 1)[1]
    assert last.endswith("-1.5")
    cut = text[:-drop] if drop != 3 else text[:-3] + "-"  # drop 3 leaves a lone sign: no number
    data = cut.replace("\n", "\r\n").encode() if form == "crlf" else cut.encode()
    log = read(write(tmp_path / "log.csv", gzip.compress(data) if form == "gzip" else data), NM)
    np.testing.assert_allclose(log.position_rad, np.array(ROWS)[:-1, 1:3])
    (said,) = [finding for finding in log.findings if finding.code == "log-partial"]
    assert said.severity == "error"
    assert "line 41" in said.text
    assert [finding.code for finding in describe((tmp_path / "log.csv",)).findings].count("log-partial") == 1


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("0.39,3.9,-7.8,40,-37\n", "0.39,3.9,-7.8\n"),  # the line is ended
        ("0.39,3.9,-7.8,40,-37\n", "0.39,OFF,-7.8"),  # damage before the end of the line
        ("0.39,3.9,-7.8,40,-37\n", "0.39,3.9,OFF,40,-37"),
        ("0.39,3.9,-7.8,40,-37\n", "0.39,3.9,-7.8,40,-37,4"),  # more than the columns
        ("0.05,0.5,-1,6,-3\n", "0.05,0.5,-1\n"),  # damage elsewhere, and a cut
    ],
)
def test_other_damage_is_refused(old: str, new: str, tmp_path: Path) -> None:
    text = table()
    assert old in text
    text = text.replace(old, new)
    with pytest.raises(LogError, match=r"line|cells"):
        read(write(tmp_path / "log.csv", text if "0.05" not in old else text[:-8]), NM)


def test_a_huge_cell_is_refused_without_a_traceback(tmp_path: Path) -> None:
    text = table().replace("0.05,0.5", "0.05," + "9" * 300_000)
    try:
        read(write(tmp_path / "log.csv", text), NM)
    except LogError as error:
        assert str(tmp_path) in error.render()
    with pytest.raises(LogError):
        read(write(tmp_path / "b.csv", text.replace("9" * 300_000, '"' + "x" * 300_000)), NM)
    with pytest.raises(LogError):
        read(write(tmp_path / "c.csv", "t,q1," + "x" * 300_000 + "\n1,2,3\n"), NM)


@pytest.mark.parametrize("row", ["# 0.05,0.5,-1,6,-3", "  % 0,0,0,0,0", "# a, b", "   ", "\t"])
@pytest.mark.parametrize("pack", [bytes, gzip.compress], ids=["plain", "gzip"])
def test_comments_and_blank_lines_between_rows_are_no_rows(
    row: str, pack: Callable[[bytes], bytes], tmp_path: Path
) -> None:
    """Also a row that was commented out, which has as many cells as any other."""
    text = table().replace("0.05,", f"{row}\n0.05,")
    check(read(write(tmp_path / "log.csv", pack(text.encode())), NM))


@pytest.mark.parametrize(
    ("cell", "value"),
    [
        *(("1_000", None), ("0x10", None), ("True", None), ("1d5", None), ("٣", None), ("\u00a05", None), ("5e", None)),
        *(('"1,5"', None), ("#N/A", None), ("- 5", None)),
        *(("+5", 5.0), (" 5 ", 5.0), ('"1.5"', 1.5), ("5.", 5.0), (".5", 0.5), ("1e-400", 0.0), ("1E3", 1e3)),
        *(("12345678.901234567890123", 12345678.901234567), ("12345678901234567890123", np.nan)),  # no joint is there
        ("0.1000000000000000055511151231257827", 0.1),
        ("null", np.nan),
    ],
)
def test_what_a_number_may_look_like(cell: str, value: float | None, tmp_path: Path) -> None:
    path = write(tmp_path / "log.csv", table().replace("0.05,0.5,", f"0.05,{cell},"))
    if value is None:
        with pytest.raises(LogError, match="not a number") as caught:
            read(path, NM)
        assert "line 7" in caught.value.render()
    else:
        np.testing.assert_array_equal(read(path, NM).position_rad[5, 0], value)


def cell(text: str, row: int, column: int) -> str:
    """The plain table with one cell written otherwise."""
    lines = table().splitlines()
    cells = lines[row].split(",")
    cells[column] = text.format(cells[column])
    lines[row] = ",".join(cells)
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize(("row", "column"), [(1, 2), (37, 2), (40, 4), (39, 1)])
@pytest.mark.parametrize("text", ['"{}"', " {} ", '" {}"'])
def test_a_quoted_cell_anywhere_is_the_number_in_it(tmp_path: Path, text: str, row: int, column: int) -> None:
    check(read(write(tmp_path / "log.csv", cell(text, row, column)), NM))


@pytest.mark.parametrize("text", ["", "nan", "NaN", "-nan", "null", "NA", "n/a", '""', '"NA"'])
@pytest.mark.parametrize("row", [1, 38])
def test_a_missing_number_is_nan_however_it_is_written(tmp_path: Path, text: str, row: int) -> None:
    log = read(write(tmp_path / "log.csv", cell(text, row, 3)), NM)
    expected = np.array(ROWS)[:, 3]
    expected[row - 1] = np.nan
    np.testing.assert_allclose(log.effort[:, 0], expected, rtol=1e-12)
    assert log.position_rad.flags.writeable is False


@pytest.mark.parametrize("text", ["nan", "-nan", "NA", "inf"])
def test_time_counts_from_the_first_stamp_that_is_one(tmp_path: Path, text: str) -> None:
    log = read(write(tmp_path / "log.csv", cell(text, 1, 0)), NM)
    np.testing.assert_allclose(log.time_s[1:], np.array(ROWS)[1:, 0] - 0.01, atol=1e-12)
    assert not np.isfinite(log.time_s[0])
    np.testing.assert_allclose(log.position_rad, np.array(ROWS)[:, 1:3], rtol=1e-12)


@pytest.mark.parametrize("text", ['"{}', "x", '"1,2"', "1 2"])
def test_what_is_no_number_is_named_by_line_and_column(tmp_path: Path, text: str) -> None:
    with pytest.raises(LogError, match="line 38"):
        read(write(tmp_path / "log.csv", cell(text, 37, 2)), NM)


def test_a_quoted_comma_is_none_even_in_a_column_not_asked_for(tmp_path: Path) -> None:
    lines = [f"{line},note,more" if k == 0 else f"{line},0,1" for k, line in enumerate(table().splitlines())]
    lines[37] = lines[37].removesuffix(",0,1") + ',"a,b",c'
    check(read(write(tmp_path / "whole.csv", "\n".join(lines) + "\n"), NM))
    lines[37] = lines[37].removesuffix(",c")
    with pytest.raises(LogError, match="line 38") as caught:
        read(write(tmp_path / "short.csv", "\n".join(lines) + "\n"), NM)
    assert "6 cells" in str(caught.value)


@pytest.mark.parametrize("sep", [",", "   ", ";", "\t"])
def test_utf_16_is_text_as_any_other(tmp_path: Path, sep: str) -> None:
    text = table().replace(",", sep)
    check(read(write(tmp_path / "log.csv", text.encode("utf-16")), NM))
    with pytest.raises(LogError, match="line 4"):
        read(write(tmp_path / "fault.csv", text.replace("0.02", "x", 1).encode("utf-16")), NM)
    rows = text.replace("\n0.03", "\n# a remark\n0.03", 1)
    check(read(write(tmp_path / "remark.csv", rows.encode("utf-16")), NM))


def test_what_is_no_whole_utf_16_is_refused_in_words(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="begins as UTF-16"):
        read(write(tmp_path / "log.csv", table().encode("utf-16")[:-1]), NM)


def test_stamps_in_quotes_between_blanks_keep_their_digits(tmp_path: Path) -> None:
    rows = ["time q1 tau1", "1700000000.0000000 1 2"]
    rows += [f'"1700000000.{10 * k:03d}000" "1.01" "2"' for k in range(1, 30)]
    log = read(write(tmp_path / "log.csv", "\n".join(rows) + "\n"), NM)
    np.testing.assert_allclose(log.time_s, 0.01 * np.arange(30), atol=1e-12)  # a float64 would be 1e-7 off


def test_the_column_of_time_may_be_a_position_too(tmp_path: Path) -> None:
    rows = "\n".join(f"{k},{k + 1}" for k in range(30))
    settings = {"csv": {"time": "q1", "position": "q1", "effort": "tau1"}, "units": {"effort": "Nm", "time": "s"}}
    log = read(write(tmp_path / "log.csv", f"q1,tau1\n{rows}\n"), settings)
    np.testing.assert_array_equal(log.position_rad[:, 0], np.arange(30.0))


@pytest.mark.parametrize("suffix", ["", ".gz"])
def test_no_thread_of_arrow_calls_python(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, suffix: str) -> None:
    """Arrow's threads go on after an error and may abort the process."""
    from pyarrow import csv

    calls: list[bool] = []
    read_csv = csv.read_csv

    def spy(source: Any, *, read_options: Any, parse_options: Any, convert_options: Any) -> Any:
        calls.append(read_options.use_threads)
        return read_csv(source, read_options=read_options, parse_options=parse_options, convert_options=convert_options)

    monkeypatch.setattr(csv, "read_csv", spy)
    lines = table().splitlines(keepends=True)
    text = "".join([*lines[:9], "# a comment\n", *lines[9:]])
    path = tmp_path / f"run.csv{suffix}"
    path.write_bytes(gzip.compress(text.encode()) if suffix else text.encode())
    check(read(path, NM))
    assert calls and not any(calls)
