"""Arrays as programs save them: one variable a file, matrices and tables without names, structs inside structs."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from scipy.io import savemat

from collaudit.core.config.schema import LogConfig
from collaudit.core.errors import LogError
from collaudit.core.logs.inputs import expand_inputs, group_inputs
from collaudit.core.logs.log_description import describe
from collaudit.core.logs.log_guess import guess_csv_columns
from collaudit.core.logs.log_reading import read_log

TIME_S = 0.01 * np.arange(300)
Q = np.stack([np.sin(TIME_S), np.cos(2 * TIME_S), 0.3 * np.sin(3 * TIME_S)], axis=1)
DQ = np.gradient(Q, TIME_S, axis=0)
TAU = 3.0 * Q + np.sign(DQ)


def saved(folder: Path, variables: dict[str, Any]) -> list[Path]:
    for name, values in variables.items():
        savemat(folder / f"{name}.mat", {name: values})
    return [folder / f"{name}.mat" for name in variables]


def written(folder: Path, tables: dict[str, Any]) -> list[Path]:
    for name, values in tables.items():
        np.savetxt(folder / name, values)
    return [folder / name for name in tables]


def nested(folder: Path) -> list[Path]:
    held = {"data": {"q": Q.T, "dq": DQ.T, "tau": TAU.T}, "time": TIME_S, "serial": "A7"}
    savemat(folder / "run.mat", {"rec": held, "setup": {"gain": np.eye(3), "gear": [100.0, 100.0, 50.0]}})
    return [folder / "run.mat"]


def flobaroid(folder: Path) -> list[Path]:
    arrays = {"positions": Q + 1, "velocities": DQ + 1, "torques": TAU + 1, "accelerations": DQ, "times": TIME_S}
    raw = {"positions_raw": Q, "velocities_raw": DQ, "torques_raw": TAU, "frequency": 100.0, "contacts": np.array({})}
    np.savez(folder / "run.npz", **arrays, **raw)
    return [folder / "run.npz"]


SHAPES: dict[str, Callable[[Path], list[Path]]] = {
    "one variable a .mat": lambda to: saved(to, {"t": TIME_S, "q": Q, "dq": DQ.T, "tau": TAU}),
    "the time last": lambda to: saved(to, {"q": Q, "dq": DQ, "tau": TAU, "time": TIME_S}),
    "structs in structs": nested,
    "FloBaRoID": flobaroid,
    "no names, time apart": lambda to: written(
        to, {"time.txt": TIME_S, "joint_ang.txt": Q, "joint_vel.txt": DQ, "joint_torque.txt": TAU}
    ),
    "no names, the same time in front": lambda to: written(
        to, {f"{name}.txt": np.column_stack([TIME_S, x]) for name, x in
             (("ang", Q), ("jointVel", DQ), ("measured_torque", TAU))}
    ),
}  # fmt: skip


@pytest.mark.parametrize("shape", SHAPES)
def test_they_are_read_as_one_log_and_as_init_writes_it(shape: str, tmp_path: Path) -> None:
    paths = SHAPES[shape](tmp_path)
    assert group_inputs(paths, LogConfig()) == [tuple(paths)]
    guess = guess_csv_columns(paths)
    assert guess is not None
    for settings in ({}, {"csv": guess.csv}):
        log = read_log(tuple(paths), LogConfig.of(settings), robot_joints=["a", "b", "c"])
        np.testing.assert_allclose(log.time_s, TIME_S)
        np.testing.assert_allclose(log.position_rad, Q)
        np.testing.assert_allclose(log.velocity_rad_s, DQ)
        np.testing.assert_allclose(log.effort, TAU)


def test_each_episode_of_a_lerobot_folder_is_a_log(tmp_path: Path) -> None:
    for part in ("data/chunk-000", "meta/episodes"):
        (tmp_path / part).mkdir(parents=True)
    (tmp_path / "meta" / "info.json").write_text('{"codebase_version": "v2.1", "fps": 100}')
    for episode, shift in enumerate((0.0, 1.0)):
        lists = {f"observation.{name}": (values + shift).tolist() for name, values in
                 (("state", Q), ("velocity", DQ), ("effort", TAU))}  # fmt: skip
        columns = {**lists, "action": (Q + 9).tolist(), "timestamp": TIME_S, "episode_index": [episode] * TIME_S.size}
        pq.write_table(pa.table(columns), tmp_path / "data" / "chunk-000" / f"episode_{episode:06d}.parquet")
    pq.write_table(pa.table({"length": [300, 300]}), tmp_path / "meta" / "episodes" / "file-000.parquet")
    logs = group_inputs(expand_inputs([tmp_path]), LogConfig())
    assert [path.name for (path,) in logs] == ["episode_000000.parquet", "episode_000001.parquet"]
    for paths, shift in zip(logs, (0.0, 1.0), strict=True):
        log = read_log(paths, LogConfig(), robot_joints=["a", "b", "c"])
        np.testing.assert_allclose(log.position_rad, Q + shift)
        np.testing.assert_allclose(log.effort, TAU + shift)


def test_rows_without_a_time_must_be_as_many(tmp_path: Path) -> None:
    paths = saved(tmp_path, {"t": TIME_S, "q": Q, "tau": TAU[:-1]})
    with pytest.raises(LogError, match="share their time"):
        read_log(tuple(paths), LogConfig(), robot_joints=["a", "b", "c"])


def test_tables_without_names_and_time_ask_for_the_rate(tmp_path: Path) -> None:
    paths = written(tmp_path, {"joint_ang.txt": Q, "joint_vel.txt": DQ, "joint_torque.txt": TAU})
    with pytest.raises(LogError, match="no time column") as caught:
        read_log(tuple(paths), LogConfig(), robot_joints=["a", "b", "c"])
    assert "rate_hz" in str(caught.value.hint)
    log = read_log(tuple(paths), LogConfig.of({"csv": {"rate_hz": 100.0}}), robot_joints=["a", "b", "c"])
    np.testing.assert_allclose(log.effort, TAU)


@pytest.mark.parametrize("lying", [False, True])
def test_a_matrix_by_the_numbers_of_its_columns(tmp_path: Path, lying: bool) -> None:
    path = tmp_path / "run.npy"
    matrix = np.column_stack([TIME_S, Q, DQ, TAU])
    np.save(path, matrix.T if lying else matrix)
    with pytest.raises(LogError, match="no columns of joint positions") as caught:
        read_log((path,), LogConfig(), robot_joints=["a", "b", "c"])
    assert "time = 1, position = [2, 3]" in str(caught.value.hint)
    csv = {"time": 1, "position": [2, 3, 4], "velocity": [5, 6, 7], "effort": [8, 9, 10]}
    log = read_log((path,), LogConfig.of({"csv": csv}), robot_joints=["a", "b", "c"])
    np.testing.assert_allclose(log.time_s, TIME_S)
    np.testing.assert_allclose(log.velocity_rad_s, DQ)
    np.testing.assert_allclose(log.effort, TAU)


def test_an_array_of_records_has_names(tmp_path: Path) -> None:
    path = tmp_path / "run.npy"
    records = np.zeros(300, dtype=[("t", float), ("q", float, 3), ("tau", float, 3)])
    records["t"], records["q"], records["tau"] = TIME_S, Q, TAU
    np.save(path, records)
    log = read_log((path,), LogConfig(), robot_joints=["a", "b", "c"])
    np.testing.assert_allclose(log.effort, TAU)


@pytest.mark.parametrize("content", [b"\x93NUMPY\x01\x00", b"objects"])
def test_damaged_arrays_are_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "run.npy"
    if content == b"objects":
        np.save(path, np.array([{}, {}], dtype=object), allow_pickle=True)
    else:
        path.write_bytes(content)
    with pytest.raises(LogError, match="NumPy array"):
        read_log((path,), LogConfig(), robot_joints=["a"])


def test_a_struct_of_rows_is_described_in_seconds(tmp_path: Path) -> None:
    """Matrices of one row a joint, of several structs, as controllers of industrial arms export them."""
    rng = np.random.default_rng(1)
    rows = {f"part{k}": rng.normal(size=(6, 2501)) for k in range(20)}
    savemat(tmp_path / "run.mat", {"rec": {**rows, "time": 0.004 * np.arange(2501)}, "ref": {"phi": rows["part0"]}})
    started = time.process_time()
    summary = describe((tmp_path / "run.mat",))
    assert time.process_time() - started < 3.0
    assert len(summary.columns) == 6 * 21 + 1
