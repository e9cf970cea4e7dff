"""Formats that people bring: HDF5 of teleoperation, KUKA traces, JSON lines; and those that are refused."""

from __future__ import annotations

import json
import pickle
import shlex
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from collaudit.core.config.schema import LogConfig
from collaudit.core.errors import LogError
from collaudit.core.logs.inputs import expand_inputs, group_inputs, left_out, other_files
from collaudit.core.logs.log_description import describe
from collaudit.core.logs.log_guess import guess_csv_columns
from collaudit.core.logs.log_reading import read_log

h5py = pytest.importorskip("h5py")

COUNT = 300
TIME_S = 0.01 * np.arange(COUNT)
Q = np.stack([np.sin(TIME_S), np.cos(2 * TIME_S), 0.3 * np.sin(3 * TIME_S)], axis=1)
DQ = np.gradient(Q, TIME_S, axis=0)
TAU = 3.0 * Q + np.sign(DQ)
JOINTS = ("a", "b", "c")


def hdf5(path: Path, arrays: dict[str, Any]) -> Path:
    with h5py.File(path, "w") as file:
        for name, values in arrays.items():
            file[name] = values
    return path


def read(*paths: Path, **settings: Any) -> Any:
    return read_log(paths, LogConfig.of(settings), robot_joints=JOINTS)


def same(log: Any) -> None:
    np.testing.assert_allclose(log.time_s, TIME_S, atol=1e-6)
    np.testing.assert_allclose(log.position_rad, Q)
    np.testing.assert_allclose(log.velocity_rad_s, DQ)
    np.testing.assert_allclose(log.effort, TAU)


RECORD = np.zeros(COUNT, dtype=[("t", float), ("q", float, 3), ("dq", float, 3), ("tau", float, 3)])
RECORD["t"], RECORD["q"], RECORD["dq"], RECORD["tau"] = TIME_S, Q, DQ, TAU
STATE = "observation/robot_state/"
#: Layouts of public data sets, and what a user states besides.
LAYOUTS: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "flat": ({"t": TIME_S, "q": Q, "dq": DQ, "tau": TAU}, {}),
    "records": ({"log": RECORD}, {}),
    "on their side": ({"rec/time": TIME_S, "rec/q": Q.T, "rec/dq": DQ.T, "rec/tau": TAU.T}, {}),
    "observations and actions, no time": (
        {"observations/qpos": Q, "observations/qvel": DQ, "observations/effort": TAU, "action": Q + 9,
         "observations/images/top": np.zeros((COUNT, 2, 2, 3), np.uint8)},
        {"csv": {"rate_hz": 100.0}},
    ),
    "states and commands, a split stamp": (
        {f"{STATE}joint_positions": Q, f"{STATE}joint_velocities": DQ, f"{STATE}motor_torques_measured": TAU,
         f"{STATE}joint_torques_computed": TAU + 5, "action/joint_position": Q + 9, "action/joint_velocity": DQ + 9,
         f"{STATE}timestamp_seconds": np.full(COUNT, 1_700_000_000) + (TIME_S // 1).astype(int),
         f"{STATE}timestamp_nanos": np.round(TIME_S % 1 * 1e9).astype(int)},
        {"csv": {"time": [f"{STATE}timestamp_seconds".replace("/", "."), f"{STATE}timestamp_nanos".replace("/", ".")]}},
    ),
}  # fmt: skip


@pytest.mark.parametrize("layout", LAYOUTS)
def test_a_layout_is_read_also_as_init_writes_it(layout: str, tmp_path: Path) -> None:
    arrays, stated = LAYOUTS[layout]
    path = hdf5(tmp_path / "recording", arrays)  # by its content
    same(read(path, **stated))
    guess = guess_csv_columns((path,))
    assert guess is not None
    columns = {key: getattr(guess.csv, key) for key in ("position", "velocity", "effort")}
    same(read(path, csv={"time": guess.csv.time, **columns, **stated.get("csv", {})}))


def demos(folder: Path, *rows: int, time: bool = False) -> Path:
    arrays: dict[str, Any] = {"mask/train": np.array([b"demo_0", b"demo_1"])}
    for k, count in enumerate(rows):
        held = {"obs/robot0_joint_pos": Q + k, "obs/robot0_joint_vel": DQ, "obs/robot0_joint_effort": TAU, "actions": Q}
        held |= {"obs/t": TIME_S} if time else {}
        arrays |= {f"data/demo_{k}/{name}": values[:count] for name, values in held.items()}
    return hdf5(folder / "demos.hdf5", arrays)


def test_demonstrations_are_runs_in_the_order_of_their_numbers(tmp_path: Path) -> None:
    rows = [100 + k for k in range(11)]
    path = demos(tmp_path, *rows)
    with pytest.raises(LogError, match="no time column") as refused:
        read(path)
    assert "rate_hz" in str(refused.value.hint)
    log = read(path, csv={"rate_hz": 100.0})
    np.testing.assert_allclose(log.position_rad[:, 1], np.concatenate([Q[:n, 1] + k for k, n in enumerate(rows)]))
    assert "11 runs" in next(finding.text for finding in log.findings if finding.code == "time-gap")
    assert np.count_nonzero(np.diff(log.time_s) > 0.05) == 10


def test_demonstrations_with_times_begin_again(tmp_path: Path) -> None:
    log = read(demos(tmp_path, 120, 130, 140, time=True))
    assert "3 runs" in next(finding.text for finding in log.findings if finding.code == "time-gap")
    assert log.time_s.shape == (390,)


def test_an_empty_demonstration_and_arrays_of_one_only_are_said_or_missing(tmp_path: Path) -> None:
    path = demos(tmp_path, 120, 0, 140)
    with h5py.File(path, "a") as file:
        file["data/demo_0/obs/extra"] = np.ones(120)
    log = read(path, csv={"rate_hz": 100.0})
    assert log.time_s.shape == (260,)
    text = next(finding.text for finding in log.findings if finding.code == "log-left-out")
    assert "data.demo_1 (no rows)" in text
    extra = next(column for column in describe((path,)).columns if column.name == "obs.extra")
    assert (extra.min, extra.max) == (1.0, 1.0)


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"demo_0/t": TIME_S, "demo_1/t": np.array([b"x"] * COUNT)}, "as runs of one table"),
        ({}, "no arrays"),
        ({"data/demo_0/obs/q": np.zeros((0, 3))}, "no arrays"),
        ({"note": "hello", "count": 3}, "no arrays"),
        ({"t": np.array([b"x", b"y"] * 50), "q": np.zeros((100, 3)), "tau": np.zeros((100, 3))}, "neither numbers nor"),
        ({"t": TIME_S, "q": np.zeros((COUNT, 3), complex), "tau": TAU}, "no columns of joint positions"),
        ({"a/b": TIME_S, "a.b": TIME_S}, "same name"),
        ({"t": TIME_S, "q": Q, "tau": TAU[:-5]}, "effort"),
    ],
    ids=[
        "words beside numbers",
        "nothing",
        "an empty group",
        "settings",
        "times as words",
        "complex numbers",
        "one name twice",
        "other rows",
    ],
)
def test_what_is_no_table_is_refused_once(arrays: dict[str, Any], message: str, tmp_path: Path) -> None:
    with pytest.raises(LogError, match=message):
        read_effort(hdf5(tmp_path / "run.h5", arrays))


def read_effort(path: Path) -> None:
    if read(path).effort is None:
        raise LogError("no effort", where=str(path))


def test_numbers_in_other_files_are_not_read(tmp_path: Path) -> None:
    secret = tmp_path / "secret.bin"
    secret.write_bytes(np.arange(COUNT, dtype=float).tobytes())
    with h5py.File(tmp_path / "outside.h5", "w") as file:
        file.create_dataset("t", (COUNT,), float, external=[(str(secret), 0, COUNT * 8)])
    hdf5(tmp_path / "other.h5", {"q": Q})
    layout = h5py.VirtualLayout((COUNT, 3), float)
    layout[:] = h5py.VirtualSource(str(tmp_path / "other.h5"), "q", (COUNT, 3))
    with h5py.File(tmp_path / "virtual.h5", "w") as file:
        file.create_virtual_dataset("q", layout)
    for name in ("outside.h5", "virtual.h5"):
        with pytest.raises(LogError, match="in other files"):
            read(tmp_path / name)


def test_more_rows_than_a_file_can_hold_are_refused(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "huge.h5", "w") as file:
        file.create_dataset("q", (1 << 40, 3), float, chunks=(1 << 10, 3))
    with pytest.raises(LogError, match="claims more rows"):
        read(tmp_path / "huge.h5")


def test_a_table_of_pandas_says_how_it_is_converted(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "run.h5", "w") as file:
        file.create_group("log").attrs["pandas_type"] = "frame"
    with pytest.raises(LogError, match="only pandas reads") as refused:
        read(tmp_path / "run.h5")
    assert 'pandas.read_hdf("' in str(refused.value.hint)


def test_a_matrix_beside_an_array_of_its_numbered_name_keeps_both(tmp_path: Path) -> None:
    path = hdf5(tmp_path / "run.h5", {"t": TIME_S, "q": Q, "q1": TIME_S})
    names = [column.name for column in describe((path,)).columns]
    assert names == ["q_1", "q_2", "q_3", "q1", "t"]


def trace(
    folder: Path, axis: int, *, stem: str = "CELL_NextGenDrive", names: tuple[str, ...] = (), **changes: Any
) -> Path:
    """One pair of a header and its values; ``changes`` are other lines of the header, by number."""
    names = names or ("Programmed_Velocity", "Actual_Velocity", "Actual_Moment", "Actual_Position")
    k = axis - 1
    values = np.degrees(np.stack([DQ[:, k] + 9, DQ[:, k], np.radians(TAU[:, k]), Q[:, k]], axis=1))
    units = ("°/s", "°/s", "Nm", "°")
    name = f"{stem}#{axis}"
    lines = ["DIAEXTENDED", "#BEGINGLOBALHEADER", "112,High -> Low", "#ENDGLOBALHEADER", "#BEGINCHANNELHEADER"]
    lines += ["200,Zeit", "202,sec", "210,IMPLIZIT", f"220,{COUNT}", "240,0.0", "241,0.01", "#ENDCHANNELHEADER"]
    for place, (channel, unit) in enumerate(zip(names, units, strict=True), 1):
        held = {"200": channel, "202": unit, "210": "EXPLIZIT", "211": f"{name}.r64", "213": "BLOCK", "214": "REAL64",
                "220": COUNT, "221": place, "240": 0, "241": 1.0, **changes}  # fmt: skip
        lines += ["#BEGINCHANNELHEADER", *(f"{number},{value}" for number, value in held.items()), "#ENDCHANNELHEADER"]
    path = folder / f"{name}.dat"
    path.write_bytes("\r\n".join([*lines, ""]).encode("cp1252"))
    values.tofile(folder / f"{name}.r64")
    return path


def test_traces_of_all_axes_are_one_log(tmp_path: Path) -> None:
    paths = [trace(tmp_path, axis) for axis in (1, 2, 3)]
    other = [trace(tmp_path, axis, stem="CELL_LATER") for axis in (1, 2, 3)]
    assert expand_inputs([tmp_path]) == [*other, *paths]
    assert group_inputs([*paths, *other], LogConfig()) == [tuple(paths), tuple(other)]
    assert group_inputs([paths[0], other[1]], LogConfig()) == [(paths[0],), (other[1],)]
    robot = ("joint_a1", "joint_a2", "joint_a3")
    log = read_log(tuple(paths), LogConfig(), robot_joints=robot)
    assert log.joint_names == robot
    same(log)
    guess = guess_csv_columns(paths)
    assert guess is not None
    same(read_log(tuple(paths), LogConfig.of({"csv": guess.csv}), robot_joints=robot))
    assert describe((paths[0],)).size_bytes == sum((tmp_path / f"CELL_NextGenDrive#1.{end}").stat().st_size
                                                   for end in ("dat", "r64"))  # fmt: skip


def test_traces_in_german_and_stored_channel_by_channel(tmp_path: Path) -> None:
    names = ("Sollgeschwindigkeit", "Istgeschwindigkeit", "Istmoment", "Istposition")
    path = trace(tmp_path, 1, names=names)
    text = path.read_bytes().replace(b"213,BLOCK", b"213,CHANNEL")
    for place in (2, 3, 4):
        text = text.replace(b"221,%d\r" % place, b"221,%d\r" % ((place - 1) * COUNT + 1))
    path.write_bytes(text)
    values = path.with_suffix(".r64")
    np.fromfile(values).reshape(COUNT, 4).T.ravel().tofile(values)
    log = read_log((path,), LogConfig(), robot_joints=("joint_a1",))
    np.testing.assert_allclose(log.position_rad[:, 0], Q[:, 0])
    np.testing.assert_allclose(log.effort[:, 0], TAU[:, 0])


def test_a_factor_and_a_renamed_file_of_values(tmp_path: Path) -> None:
    path = trace(tmp_path, 1, **{"241": 0.5, "240": 1, "211": r"C:\TRACE\before#1.r64"})
    log = read_log((path,), LogConfig.of({"units": {"position": "rad"}}), robot_joints=("joint_a1",))
    np.testing.assert_allclose(log.position_rad[:, 0], 1 + 0.5 * np.degrees(Q[:, 0]))


def test_the_hash_of_a_trace_is_of_its_values_too(tmp_path: Path) -> None:
    path = trace(tmp_path, 1)
    before = read_log((path,), LogConfig(), robot_joints=None).source.sha256
    trace(tmp_path, 1)
    values = np.fromfile(path.with_suffix(".r64"))
    values[-1] += 1
    values.tofile(path.with_suffix(".r64"))
    assert read_log((path,), LogConfig(), robot_joints=None).source.sha256 != before


def _cut(path: Path) -> None:
    path.with_suffix(".r64").write_bytes(path.with_suffix(".r64").read_bytes()[:-8])


def _lone(path: Path) -> None:
    path.with_suffix(".r64").unlink()


def _changed(old: bytes, new: bytes) -> Callable[[Path], None]:
    return lambda path: path.write_bytes(path.read_bytes().replace(old, new)) and None


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (_cut, "not as many"),
        (_lone, "values are missing"),
        (_changed(b"221,2", b"221,99999"), "not as many"),
        (_changed(b"220,300\r\n221,1", b"221,1"), "header lacks '220'"),
        (_changed(b"214,REAL64", b"214,TEXT"), "header lacks 'TEXT'"),
        (_changed(b"220,300", b"220,many"), "header lacks"),
        (_changed(b"High -> Low", b"Low -> High"), "order of bytes"),
        (_changed(b"Programmed_Velocity", b"Actual_Velocity"), "same name"),
        (_changed(b"0.01", b"soon"), "header lacks"),
        (lambda path: path.write_bytes(path.read_bytes()[:60]), "no rows"),
    ],
)
def test_a_damaged_trace_is_refused_once(damage: Callable[[Path], None], message: str, tmp_path: Path) -> None:
    path = trace(tmp_path, 1)
    damage(path)
    with pytest.raises(LogError, match=message):
        read_log((path,), LogConfig(), robot_joints=None)


def test_values_beside_their_header_are_no_file_left_out(tmp_path: Path) -> None:
    trace(tmp_path, 1)
    (tmp_path / "CELL_NextGenDrive#1.trc").write_text("<x/>")
    (tmp_path / "lone.r64").write_bytes(bytes(80))
    found = {Path(item.name).suffix + str(item.not_judged) for item in left_out(other_files([tmp_path]), "not_judged")}
    assert found == {".r64False", ".trcFalse", ".r64True"}
    with pytest.raises(LogError, match="values of a KUKA trace") as refused:
        read(tmp_path / "lone.r64")
    assert "lone.dat" in str(refused.value.hint)


def lines(path: Path, rows: list[dict[str, Any]]) -> Path:
    path.write_text("".join(json.dumps(row) + "\n" for row in rows))
    return path


def stamped(k: int) -> dict[str, int]:
    return {"sec": 1_700_000_000 + k // 100, "nanosec": k % 100 * 10**7}


#: Rows of JSON lines, as loggers of Python and converters of ROS messages write them.
ROWS: dict[str, Callable[[int], dict[str, Any]]] = {
    "flat": lambda k: {"t": k * 0.01} | {f"{name}{j + 1}": float(values[k, j]) for name, values in
                                         (("q", Q), ("dq", DQ), ("tau", TAU)) for j in range(3)},
    "lists": lambda k: {"time": k * 0.01, "q": Q[k].tolist(), "dq": DQ[k].tolist(), "tau": TAU[k].tolist()},
    "JointState": lambda k: {"header": {"stamp": stamped(k)}, "name": list(JOINTS), "position": Q[k].tolist(),
                             "velocity": DQ[k].tolist(), "effort": TAU[k].tolist()},
    "objects, a note now and then": lambda k: {"t": k * 0.01, "q": dict(zip(JOINTS, Q[k].tolist(), strict=True)),
                                               "dq": dict(zip(JOINTS, DQ[k].tolist(), strict=True)),
                                               "tau": dict(zip(JOINTS, TAU[k].tolist(), strict=True)),
                                               **({"note": "x"} if k % 50 == 7 else {})},
}  # fmt: skip


@pytest.mark.parametrize("name", ["run.jsonl", "run.ndjson", "run"])
@pytest.mark.parametrize("row", ROWS)
def test_json_lines_are_read(row: str, name: str, tmp_path: Path) -> None:
    same(read(lines(tmp_path / name, [ROWS[row](k) for k in range(COUNT)])))


def test_whole_numbers_first_and_missing_keys_are_no_matter(tmp_path: Path) -> None:
    rows = [ROWS["flat"](k) for k in range(COUNT)]
    rows[0] |= {"q1": 0, "tau1": 1}
    del rows[5]["q2"]
    rows[6]["q2"] = None
    log = read(lines(tmp_path / "run.jsonl", rows))
    assert np.flatnonzero(np.isnan(log.position_rad[:, 1])).tolist() == [5, 6]


def test_a_last_line_that_was_cut_is_left_out_and_said(tmp_path: Path) -> None:
    path = lines(tmp_path / "run.jsonl", [ROWS["flat"](k) for k in range(COUNT)])
    path.write_bytes(path.read_bytes()[:-20])
    log = read(path)
    assert log.time_s.shape == (COUNT - 1,)
    assert any(finding.code == "log-partial" for finding in log.findings)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('{"t": 1, "q1": 2}\n{"t": "x", "q1": 3}\n', "JSON lines"),
        ('{"t": 1, "q1": 2}\n[3, 4]\n', "JSON lines"),
        ('{"t": 1, "q1": 2}\n{"t": 2, "q1"\n{"t": 3}\n', "JSON lines"),
        ('{"a": {"b": 1}, "a.b": 2}\n', "same name"),
        ("{}\n", "no rows"),
        ('{"t": 1, "q\udc80": 2}\n', "JSON lines"),
    ],
)
def test_lines_that_are_no_rows_are_refused_once(text: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "run.jsonl").write_text(text, errors="surrogateescape")
    with pytest.raises(LogError, match=message):
        read(tmp_path / "run.jsonl")


TABLE = {"t": TIME_S} | {f"q{j + 1}": Q[:, j] for j in range(3)} | {f"tau{j + 1}": TAU[:, j] for j in range(3)}


class Evil:
    """What a pickle may do when it is loaded."""

    def __reduce__(self) -> tuple[Any, tuple[str]]:
        return exec, ("raise SystemExit('executed')",)


@pytest.mark.parametrize("kept", [{"t": TIME_S, "q": Q, "tau": TAU}, pd.DataFrame(TABLE), TABLE])
@pytest.mark.parametrize("name", ["run.pkl", "run.pickle", "run.bin"])
def test_a_pickle_is_refused_with_a_line_that_converts_it(name: str, kept: Any, tmp_path: Path) -> None:
    path = tmp_path / name
    path.write_bytes(pickle.dumps(kept))
    with pytest.raises(LogError, match="is never loaded") as refused:
        read(path)
    command = shlex.split(str(refused.value.hint).partition("wrote it: ")[2])
    if name != "run.bin":  # pandas tells pickles by their names
        subprocess.run([sys.executable, *command[1:]], check=True)
        np.testing.assert_allclose(read(tmp_path / "run.npz").effort, TAU)


@pytest.mark.parametrize("name", ["run.pkl", "run.joblib", "old.pkl"])
def test_no_pickle_is_executed(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    path.write_bytes(pickle.dumps(Evil(), protocol=0 if name == "old.pkl" else None))
    for run in (lambda: read(path), lambda: describe((path,))):
        with pytest.raises(LogError, match="is never loaded"):
            run()
    assert "run any program" in left_out([path], "list")[0].text


def test_tdms_and_workbooks_are_refused_with_a_line(tmp_path: Path) -> None:
    for name, head, line in (("run.tdms", b"TDSm", "nptdms.TdmsFile.read("), ("run", b"TDSm", "pip install npTDMS"),
                             ("run.xlsx", b"PK\x03\x04", "pandas.read_excel(")):  # fmt: skip
        (tmp_path / name).write_bytes(head + bytes(100))
        with pytest.raises(LogError, match="is not read") as refused:
            read(tmp_path / name)
        assert line in str(refused.value.hint)
