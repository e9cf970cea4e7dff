"""Parquet, Feather, .npz, .mat: the same numbers in, the same log out as from a CSV."""

from __future__ import annotations

import contextlib
import json
import sys
import zipfile
from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from given_values import given_values
from pyarrow import feather
from scipy.io import savemat

from collaudit.core.config.schema import LogConfig
from collaudit.core.errors import LogError
from collaudit.core.logs.inputs import expand_inputs, group_inputs
from collaudit.core.logs.log_description import describe
from collaudit.core.logs.log_guess import guess_csv_columns
from collaudit.core.logs.log_reading import read_log
from collaudit.core.logs.tables.array_files import check_elements

ROWS = 60
TIME_S = 0.01 * np.arange(ROWS)
COLUMNS: dict[str, Any] = {
    "t": TIME_S,
    "q1": np.sin(TIME_S),
    "q2": np.cos(TIME_S),
    "dq1": np.cos(TIME_S),
    "dq2": -np.sin(TIME_S),
    "tau1": 1.0 + TIME_S,
    "tau2": 2.0 - TIME_S,
}
NM: dict[str, Any] = {"units": {"effort": "Nm", "time": "s"}}


def csv(path: Path, columns: dict[str, Any]) -> None:
    rows = zip(*(np.asarray(values).tolist() for values in columns.values()), strict=True)
    path.write_text("\n".join([",".join(columns), *(",".join(map(str, row)) for row in rows)]) + "\n")


def parquet(path: Path, columns: dict[str, Any]) -> None:
    pq.write_table(pa.table(columns), path, row_group_size=17)


def write_feather(path: Path, columns: dict[str, Any]) -> None:
    feather.write_feather(pa.table(columns), path, compression="zstd")


def npz(path: Path, columns: dict[str, Any]) -> None:
    with path.open("wb") as stream:
        np.savez_compressed(stream, **columns)


def mat_5(path: Path, columns: dict[str, Any]) -> None:
    savemat(path, columns, appendmat=False)


def mat_73(path: Path, columns: dict[str, Any]) -> None:
    """As MATLAB writes it: an HDF5 file behind a block of text, matrices on their side."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in columns.items():
            array = np.asarray(values)
            numbers = np.array([[ord(c) for c in str(array)]]) if array.dtype.kind == "U" else np.atleast_2d(array.T)
            dataset = file.create_dataset(name.replace(".", "/"), data=numbers)
            dataset.attrs["MATLAB_class"] = np.bytes_("char" if array.dtype.kind == "U" else "double")
    with path.open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")


def hdf5(path: Path, columns: dict[str, Any]) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        for name, values in columns.items():
            file[name] = str(values) if np.asarray(values).dtype.kind == "U" else values


def json_lines(path: Path, columns: dict[str, Any]) -> None:
    rows = zip(*(np.asarray(values).tolist() for values in columns.values()), strict=True)
    path.write_text("".join(json.dumps(dict(zip(columns, row, strict=True))) + "\n" for row in rows))


WRITERS: dict[str, Callable[[Path, dict[str, Any]], None]] = {
    "csv": csv,
    "parquet": parquet,
    "feather": write_feather,
    "npz": npz,
    "mat5": mat_5,
    "mat73": mat_73,
    "hdf5": hdf5,
    "jsonl": json_lines,
}
BY_COLUMN = [name for name in WRITERS if name not in ("csv", "jsonl")]
OF_ARRAYS = ["npz", "mat5", "mat73", "hdf5"]


@pytest.fixture(params=list(WRITERS))
def writer(request: pytest.FixtureRequest) -> Callable[[Path, dict[str, Any]], None]:
    return WRITERS[request.param]


def read(*paths: Path, **settings: Any) -> Any:
    robot = settings.pop("robot_joints", None)
    return read_log(paths, LogConfig.of({**NM, **settings}), robot_joints=robot)


def test_the_same_numbers_are_the_same_log(writer: Any, tmp_path: Path) -> None:
    path = tmp_path / "recording"
    writer(path, COLUMNS)
    log = read(path, robot_joints=("shoulder", "elbow"))
    np.testing.assert_allclose(log.time_s, TIME_S, atol=1e-12)
    for name, values in (("q", log.position_rad), ("dq", log.velocity_rad_s), ("tau", log.effort)):
        np.testing.assert_array_equal(values, np.column_stack([COLUMNS[f"{name}1"], COLUMNS[f"{name}2"]]))
    assert log.joint_names == ("shoulder", "elbow")
    assert {finding.code for finding in log.findings} == {"log-guessed"}
    summary = describe((path,))
    assert (summary.topics[0].count, set(summary.csv_columns)) == (ROWS, set(COLUMNS))
    guess = guess_csv_columns((path,))
    assert guess is not None
    assert (guess.csv.time, guess.csv.position, guess.csv.effort) == ("t", "q{i}", "tau{i}")
    again = read(path, csv=given_values(guess.csv))
    np.testing.assert_array_equal(again.effort, log.effort)


def test_columns_are_stated_labelled_and_joined_as_of_a_csv(writer: Any, tmp_path: Path) -> None:
    position, effort = tmp_path / "a", tmp_path / "b"
    writer(position, {"t": TIME_S, "Winkel A": COLUMNS["q1"], "Winkel B": COLUMNS["q2"], "flag": TIME_S > 0.3})
    writer(effort, {"t": TIME_S, "Kraft A": COLUMNS["tau1"], "Kraft B": COLUMNS["tau2"]})
    stated = {"time": "t", "position": "Winkel {joint}", "effort": "Kraft {joint}"}
    assert group_inputs([position, effort], LogConfig.of({"csv": stated})) == [(position, effort)]
    log = read(position, effort, csv=stated, labels=["flag"])
    assert log.joint_names == ("A", "B")
    np.testing.assert_array_equal(log.effort[:, 1], COLUMNS["tau2"])
    assert log.annotations[0].intervals_s[0][0] == pytest.approx(0.31)
    with pytest.raises(LogError, match="time column"):
        read(_shifted(tmp_path, writer), position, csv=stated)


def _shifted(folder: Path, writer: Any) -> Path:
    path = folder / "late"
    writer(path, {"t": TIME_S + 0.5 * TIME_S, "Kraft A": COLUMNS["tau1"], "Kraft B": COLUMNS["tau2"]})
    return path


def test_without_time_the_line_to_add_is_named(writer: Any, tmp_path: Path) -> None:
    path = tmp_path / "log"
    writer(path, {name: values for name, values in COLUMNS.items() if name != "t"})
    with pytest.raises(LogError, match="no time column") as refused:
        read(path)
    assert "rate_hz" in str(refused.value.hint)
    np.testing.assert_allclose(read(path, csv={"rate_hz": 100.0}).time_s, TIME_S, atol=1e-12)


@pytest.mark.parametrize("kind", BY_COLUMN)
def test_damaged_files_and_files_without_rows_are_refused(kind: str, tmp_path: Path) -> None:
    path = tmp_path / "log"
    WRITERS[kind](path, COLUMNS)
    whole = path.read_bytes()
    for cut in (8, 200, len(whole) // 2, len(whole) - 6):
        path.write_bytes(whole[:cut])
        with pytest.raises(LogError):
            read(path)
    WRITERS[kind](path, {name: np.array([]) for name in COLUMNS})
    with pytest.raises(LogError):
        read(path)


@pytest.mark.parametrize("kind", OF_ARRAYS)
def test_matrices_and_settings_among_arrays(kind: str, tmp_path: Path) -> None:
    path = tmp_path / "log"
    q = np.column_stack([COLUMNS["q1"], COLUMNS["q2"]])
    tau = np.column_stack([COLUMNS["tau1"], COLUMNS["tau2"]]).T
    WRITERS[kind](path, {"t": TIME_S[:, None], "q": q, "tau": tau, "gains": np.arange(7.0), "who": np.array("me")})
    log = read(path)
    np.testing.assert_array_equal(log.position_rad, q)
    np.testing.assert_array_equal(log.effort, tau.T)


def test_fields_of_a_struct(tmp_path: Path) -> None:
    savemat(tmp_path / "log.mat", {"log": {"state": {"t": TIME_S, "q": np.column_stack([TIME_S, TIME_S])}}})
    assert describe((tmp_path / "log.mat",)).csv_columns == ("t", "q1", "q2")
    mat_73(tmp_path / "log2.mat", {"log.t": TIME_S, "log.q": np.column_stack([TIME_S, TIME_S])})
    assert describe((tmp_path / "log2.mat",)).csv_columns == ("q1", "q2", "t")


def test_a_matlab_file_without_arrays_says_how_to_export(tmp_path: Path) -> None:
    savemat(tmp_path / "log.mat", {"note": "hello"})
    with pytest.raises(LogError, match="no arrays") as refused:
        read(tmp_path / "log.mat")
    assert "writetable" in str(refused.value.hint)


@pytest.mark.parametrize("write", [mat_73, hdf5])
def test_without_h5py_the_extra_is_named(write: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(tmp_path / "log", COLUMNS)
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(LogError, match="needs the package h5py") as refused:
        read(tmp_path / "log")
    assert "pip install 'collaudit[hdf5]'" in str(refused.value.hint)


def test_pickled_objects_are_never_loaded(tmp_path: Path) -> None:
    with (tmp_path / "log.npz").open("wb") as stream:
        np.savez(stream, allow_pickle=True, evil=np.array([print, {}], dtype=object), **COLUMNS)
    assert "evil" not in describe((tmp_path / "log.npz",)).csv_columns


def test_lists_structs_and_stamps_of_parquet(tmp_path: Path) -> None:
    start = 1_700_000_000_000_000
    table = pa.table(
        {
            "header": [{"stamp": start + round(t * 1e6)} for t in TIME_S],
            "position": [[float(a), float(b)] for a, b in zip(COLUMNS["q1"], COLUMNS["q2"], strict=True)],
            "ragged": [[0.0] * (k % 3) for k in range(ROWS)],
        }
    )
    stamps = table.flatten().column("header.stamp").cast(pa.timestamp("us"))
    table = table.append_column("time", stamps)
    pq.write_table(table, tmp_path / "log.parquet", row_group_size=7)
    log = read(tmp_path / "log.parquet")
    assert log.source.start_ns == start * 1000
    np.testing.assert_allclose(log.time_s, TIME_S, atol=1e-9)
    np.testing.assert_array_equal(log.position_rad[:, 1], COLUMNS["q2"])


def test_times_as_texts_and_a_column_of_words(tmp_path: Path) -> None:
    texts = [datetime.fromtimestamp(1.7e9 + t).isoformat() for t in TIME_S]
    parquet(tmp_path / "log.parquet", {**COLUMNS, "t": texts, "q1": ["x"] * ROWS})
    with pytest.raises(LogError, match="'q1' does not hold numbers"):
        read(tmp_path / "log.parquet")
    parquet(tmp_path / "log.parquet", {**COLUMNS, "t": texts})
    np.testing.assert_allclose(read(tmp_path / "log.parquet").time_s, TIME_S, atol=2e-6)


@pytest.mark.parametrize("member", ["[Content_Types].xml", "xl/workbook.xml"])
def test_workbooks_are_refused_with_the_way_to_export(member: str, tmp_path: Path) -> None:
    path = tmp_path / "log.xlsx"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(member, "<x/>")
    with pytest.raises(LogError, match="Excel workbook") as refused:
        read(path)
    assert "Save As > CSV" in str(refused.value.hint)
    csv(tmp_path / "log.csv", COLUMNS)
    assert expand_inputs([tmp_path]) == [tmp_path / "log.csv"]


def test_own_signals_are_read_by_what_they_state_and_are_no_logs_of_a_folder(tmp_path: Path) -> None:
    joints = ("shoulder", "elbow")
    columns: dict[str, Any] = {"time_s": TIME_S}
    for name, word in (("position_rad", "q"), ("velocity_rad_s", "dq"), ("measured_nm", "tau"), ("model_nm", "q")):
        columns |= {f"{name}:{joint}": COLUMNS[f"{word}{k + 1}"] for k, joint in enumerate(joints)}
    path = tmp_path / "signals.parquet"
    parquet(path, columns)
    log = read(path, robot_joints=joints)
    assert log.findings == ()
    np.testing.assert_array_equal(log.effort[:, 1], COLUMNS["tau2"])
    np.testing.assert_array_equal(log.velocity_rad_s[:, 0], COLUMNS["dq1"])
    assert expand_inputs([tmp_path]) == [path]
    (tmp_path / "audit.json").write_text("{}")
    with pytest.raises(LogError, match="no logs"):
        expand_inputs([tmp_path])


@pytest.mark.parametrize("kind", BY_COLUMN)
@pytest.mark.filterwarnings("ignore")
def test_mutated_files_are_read_or_refused(kind: str, tmp_path: Path) -> None:
    path = tmp_path / "log"
    WRITERS[kind](path, COLUMNS)
    whole = np.frombuffer(path.read_bytes(), dtype=np.uint8)
    chance = np.random.default_rng(7)
    for _ in range(120):
        mutant = whole.copy()
        mutant[chance.integers(0, mutant.size, 8)] = chance.integers(0, 256, 8)
        path.write_bytes(mutant.tobytes())
        with contextlib.suppress(LogError):
            read(path)


def test_what_matlab_writes_passes_the_check_of_elements(tmp_path: Path) -> None:
    held = {"q": np.eye(9), "z": np.ones(3) * 1j, "cells": np.array(["a", 1, [2]], dtype=object), "flag": np.bool_([1])}
    held["nested"] = {"a": np.int8([1, 2]), "b": {"text": "x", "none": np.zeros((0, 3))}}  # type: ignore[assignment]
    for compressed in (False, True):
        savemat(tmp_path / "log.mat", held, do_compression=compressed)
        check_elements(tmp_path / "log.mat")
        (tmp_path / "log.mat").write_bytes((tmp_path / "log.mat").read_bytes()[:-9])
        with pytest.raises(LogError, match="cannot be read as a MATLAB file"):
            check_elements(tmp_path / "log.mat")


@pytest.mark.parametrize("kind", OF_ARRAYS)
def test_arrays_of_another_length_are_named(kind: str, tmp_path: Path) -> None:
    path = tmp_path / "log"
    q, tau = (np.column_stack([COLUMNS[f"{name}1"], COLUMNS[f"{name}2"]]) for name in ("q", "tau"))
    WRITERS[kind](path, {"t": TIME_S, "q": q, "tau": tau, "dq": q[1:], "mass": np.arange(5.0)})
    said = [finding for finding in read(path).findings if finding.code == "log-left-out"]
    assert [finding.severity for finding in said] == ["warning"]
    assert "dq" in said[0].text and str(ROWS - 1) in said[0].text and "mass" not in said[0].text
    WRITERS[kind](path, {"t": TIME_S, "q": q[1:], "tau": tau, "dq": COLUMNS["dq1"]})
    with pytest.raises(LogError, match="no columns of joint positions") as caught:
        read(path)
    assert "arrays of another length 'q " in str(caught.value.found)
