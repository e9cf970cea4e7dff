"""Tables without a time column, tables of several runs, and files of one quantity each under the same names."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from collaudit.core.config.schema import LogConfig
from collaudit.core.errors import LogError
from collaudit.core.logs.inputs import group_inputs
from collaudit.core.logs.log_description import describe
from collaudit.core.logs.log_guess import guess_csv_columns
from collaudit.core.logs.log_reading import read_log

ROWS = 100
Q = np.column_stack([np.sin(0.05 * np.arange(ROWS)), np.cos(0.05 * np.arange(ROWS))])
NM: dict[str, Any] = {"units": {"effort": "Nm"}}


def write(path: Path, header: str, *columns: Any) -> Path:
    rows = np.column_stack(columns)
    path.write_text("\n".join([header, *(",".join(f"{x:.9g}" for x in row) for row in rows)]) + "\n")
    return path


def settings(**csv: Any) -> LogConfig:
    return LogConfig.of({**NM, "csv": csv})


def read(*paths: Path, **csv: Any) -> Any:
    return read_log(paths, settings(**csv), robot_joints=None)


def test_the_rate_stands_in_for_the_time_column(tmp_path: Path) -> None:
    path = write(tmp_path / "log.csv", "q1,q2", Q)
    with pytest.raises(LogError, match="no time column") as refused:
        read(path)
    assert "[log.csv] rate_hz = " in str(refused.value.hint)
    assert "rate_hz = " in describe((path,)).topics[0].note
    log = read(path, rate_hz=250.0)
    np.testing.assert_allclose(log.time_s, 0.004 * np.arange(ROWS), atol=1e-12)
    np.testing.assert_allclose(log.position_rad, Q, atol=1e-8)
    assert (log.source.time_source, log.source.start_ns) == ("rate", None)
    rate = describe((path,), settings(rate_hz=250.0)).topics[0].rate_hz
    assert rate == pytest.approx(250.0)


def test_a_stated_rate_wins_over_a_column_called_time(tmp_path: Path) -> None:
    path = write(tmp_path / "log.csv", "t,q1,q2", 7.0 * np.arange(ROWS), Q)
    np.testing.assert_allclose(read(path, rate_hz=10.0).time_s, 0.1 * np.arange(ROWS), atol=1e-12)


def test_two_statements_of_time_are_refused() -> None:
    with pytest.raises(ValueError, match="keep one"):
        settings(rate_hz=10.0, time="t")


def test_files_of_one_quantity_each_are_told_apart_by_their_names(tmp_path: Path) -> None:
    position = write(tmp_path / "pos_read_data.csv", "Joint_1,Joint_2", Q)
    effort = write(tmp_path / "trq_data.csv", "Joint_1,Joint_2", 3 * Q)
    assert group_inputs([position, effort], LogConfig()) == [(position, effort)]
    log = read(position, effort, rate_hz=100.0)
    np.testing.assert_allclose(log.position_rad, Q, atol=1e-8)
    np.testing.assert_allclose(log.effort, 3 * Q, atol=1e-8)
    guess = guess_csv_columns((position, effort))
    assert guess is not None
    assert guess.csv.position == "*pos*:Joint_{i}"
    stated = read(position, effort, rate_hz=100.0, position=guess.csv.position, effort=guess.csv.effort)
    np.testing.assert_array_equal(stated.effort, log.effort)
    assert stated.findings == ()


def test_a_stated_file_name_wins_over_its_words(tmp_path: Path) -> None:
    first = write(tmp_path / "pos.csv", "a1,a2", Q)
    second = write(tmp_path / "other.csv", "a1,a2", 2 * Q)
    log = read(first, second, rate_hz=100.0, position="other.csv:a{i}", effort=["pos.csv:a2", "pos.csv:a1"])
    np.testing.assert_allclose(log.position_rad, 2 * Q, atol=1e-8)
    np.testing.assert_allclose(log.effort[:, ::-1], Q, atol=1e-8)


def test_a_file_called_after_currents_holds_no_newton_metres(tmp_path: Path) -> None:
    position = write(tmp_path / "pos.csv", "Joint_1,Joint_2", Q)
    current = write(tmp_path / "curr.csv", "Joint_1,Joint_2", Q)
    with pytest.raises(Exception, match="torque_constant"):
        read_log((position, current), LogConfig.of({"csv": {"rate_hz": 10.0}}), robot_joints=None)
    read(position, current, rate_hz=10.0)  # with the unit stated it is read


def test_files_of_other_recordings_are_not_put_together(tmp_path: Path) -> None:
    names = ("run1_pos.csv", "run1_tau.csv", "run2_pos.csv", "run3_tau.csv", "both_pos_tau.csv")
    paths = [write(tmp_path / name, "j1,j2", Q) for name in names]
    assert group_inputs(paths, LogConfig()) == [(paths[0], paths[1]), (paths[2],), (paths[3],), (paths[4],)]
    longer = write(tmp_path / "run1_tau.csv", "j1,j2", np.vstack([Q, Q]))
    with pytest.raises(LogError, match="do not share their time"):
        read(paths[0], longer, rate_hz=10.0)


def test_a_time_column_that_begins_again_holds_runs(tmp_path: Path) -> None:
    time_s = np.tile(0.01 * np.arange(ROWS), 3)
    path = write(tmp_path / "log.csv", "t,q1,q2", time_s, np.tile(Q, (3, 1)))
    log = read(path)
    steps = np.diff(log.time_s)
    assert np.flatnonzero(steps > 0.05).tolist() == [ROWS - 1, 2 * ROWS - 1]
    assert steps.min() == pytest.approx(0.01)
    finding = next(f for f in log.findings if f.code == "time-gap")
    assert "3 runs" in finding.text
    assert "row 101, 201 " in finding.text
    summary = describe((path,))
    assert summary.topics[0].rate_hz == pytest.approx(100.0)
    assert "time-gap" in {f.code for f in summary.findings}


@pytest.mark.parametrize("name", ["trial", "index"])
def test_a_column_of_runs_or_rows_tells_runs_without_time(name: str, tmp_path: Path) -> None:
    numbers = np.repeat([4, 2, 9], ROWS) if name == "trial" else np.tile(np.arange(ROWS), 3)
    path = write(tmp_path / "log.csv", f"{name},q1,q2", numbers, np.tile(Q, (3, 1)))
    log = read(path, rate_hz=100.0)
    assert np.flatnonzero(np.diff(log.time_s) > 0.05).tolist() == [ROWS - 1, 2 * ROWS - 1]
    assert "time-gap" in {f.code for f in log.findings}


def test_a_stated_run_column_parts_also_what_time_does_not(tmp_path: Path) -> None:
    time_s = 0.01 * np.arange(3 * ROWS)
    path = write(tmp_path / "log.csv", "t,part,q1,q2", time_s, np.repeat([1, 2, 3], ROWS), np.tile(Q, (3, 1)))
    assert np.diff(read(path).time_s).max() < 0.011
    assert np.flatnonzero(np.diff(read(path, run="part").time_s) > 0.05).tolist() == [ROWS - 1, 2 * ROWS - 1]
    with pytest.raises(LogError, match="too often"):
        read(path, run="q1")
    with pytest.raises(LogError, match="does not have"):
        read(path, run="nope")


def test_the_mark_of_a_comment_may_be_part_of_a_name(tmp_path: Path) -> None:
    path = write(tmp_path / "log.csv", "%time,q1,q2", 0.01 * np.arange(ROWS), Q)
    for name in ("%time", "time"):
        log = read(path, time=name, position="q{i}")
        np.testing.assert_allclose(log.time_s, 0.01 * np.arange(ROWS), atol=1e-9)
