"""Cases that what_init_writes.md lists with what ``init`` writes: each builds its log in a folder of its own."""

from __future__ import annotations

import gzip
import json
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from log_writers import EPOCH, joint_state, write_any, write_mcap
from pyarrow import feather
from vocabularies import CURRENTS, TORQUE_CONSTANT, VOCABULARIES, table_of

from collaudit.core.numeric.arrays import FloatArray

Columns = dict[str, Any]
Build = Callable[[Path, "Motion"], list[Path]]
_CONSTANTS = f"log.units.torque_constant_nm_per_a={{ joint1 = {TORQUE_CONSTANT}, joint2 = {TORQUE_CONSTANT} }}"


@dataclass(frozen=True)
class Motion:
    """Two joints: (n,) s; (n, 2) rad, rad/s, N·m."""

    time_s: FloatArray
    signals: tuple[FloatArray, FloatArray, FloatArray]

    def plain(self, base: int = 1, **more: Any) -> Columns:
        """The columns t, q#, dq#, tau#, and further ones."""
        columns: Columns = {"t": self.time_s}
        for stem, values in zip(("q", "dq", "tau"), self.signals, strict=True):
            columns |= {f"{stem}{base + k}": values[:, k] for k in range(2)}
        return columns | more


@dataclass(frozen=True)
class Row:
    """One case.

    Attributes:
        group, case: what the table calls it.
        build: writes the log, returns its files.
        given: further arguments of ``init``.
        robot: whether the arm is given.
        finding: code that `inspect` must show with the file.
    """

    group: str
    case: str
    build: Build
    given: tuple[str, ...] = field(default=())
    robot: bool = True
    finding: str = ""


def csv(path: Path, columns: Mapping[str, Any], delimiter: str = ",", decimal: str = ".") -> list[Path]:
    names = list(columns)
    values = np.column_stack(list(columns.values()))
    row = delimiter.join(["%.9g"] * len(names)) + "\n"
    body = (row * len(values)) % tuple(values.ravel().tolist())
    path.write_text(delimiter.join(names) + "\n" + body.replace(".", decimal), encoding="utf-8")
    return [path]


def _vocabulary(name: str) -> Row:
    base = 0 if list(VOCABULARIES).index(name) % 2 else 1
    stems = [stem for stem in VOCABULARIES[name][1] if stem]
    case = ", ".join(f"`{stem.replace('#', str(base))}`" for stem in stems)
    return Row(
        "Vocabulary",
        f"{name}: {case} …",
        lambda folder, m: csv(folder / "run.csv", table_of(name, base, m.time_s, m.signals)),
        ("--set", _CONSTANTS) if name in CURRENTS else (),
    )


def _packed(folder: Path, motion: Motion) -> list[Path]:
    (path,) = csv(folder / "inner", motion.plain())
    (folder / "run.csv.gz").write_bytes(gzip.compress(path.read_bytes()))
    return [folder / "run.csv.gz"]


def _zipped(folder: Path, motion: Motion) -> list[Path]:
    (path,) = csv(folder / "inner", motion.plain())
    with zipfile.ZipFile(folder / "run.zip", "w") as archive:
        archive.write(path, "run.csv")
    return [folder / "run.zip"]


def _binary(name: str, write: Callable[[Path, Columns], None]) -> Build:
    def build(folder: Path, motion: Motion) -> list[Path]:
        write(folder / name, motion.plain())
        return [folder / name]

    return build


def _npz(path: Path, columns: Columns) -> None:
    with path.open("wb") as stream:
        np.savez(stream, **columns)


def _mat(path: Path, columns: Columns) -> None:
    from scipy.io import savemat

    savemat(path, columns, appendmat=False)


def _variable_each(folder: Path, motion: Motion) -> list[Path]:
    q, dq, tau = motion.signals
    for name, values in (("t", motion.time_s), ("q", q), ("dq", dq), ("tau", tau)):
        _mat(folder / f"{name}.mat", {name: values})
    return [folder / f"{name}.mat" for name in ("t", "q", "dq", "tau")]


def _structs(folder: Path, motion: Motion) -> list[Path]:
    q, dq, tau = motion.signals
    held = {"time": motion.time_s, "data": {"q": q.T, "dq": dq.T, "tau": tau.T}}
    _mat(folder / "run.mat", {"rec": held, "setup": {"gear": [100.0, 50.0]}})
    return [folder / "run.mat"]


def _matrix(folder: Path, motion: Motion) -> list[Path]:
    np.save(folder / "run.npy", np.column_stack(list(motion.plain().values())))
    return [folder / "run.npy"]


def _nameless_each(folder: Path, motion: Motion) -> list[Path]:
    for name, values in zip(("ang", "vel", "torque"), motion.signals, strict=True):
        np.savetxt(folder / f"joint_{name}.txt", np.column_stack([motion.time_s, values]), fmt="%.9g")
    return [folder / f"joint_{name}.txt" for name in ("ang", "vel", "torque")]


def _no_names(folder: Path, motion: Motion) -> list[Path]:
    values = np.column_stack(list(motion.plain().values()))
    np.savetxt(folder / "run.csv", values, delimiter=",", fmt="%.9g")
    return [folder / "run.csv"]


def _workbook(folder: Path, motion: Motion) -> list[Path]:
    with zipfile.ZipFile(folder / "run.xlsx", "w") as archive:
        archive.writestr("[Content_Types].xml", "<Types/>")
        archive.writestr("xl/workbook.xml", "<workbook/>")
    return [folder / "run.xlsx"]


def _hdf5(folder: Path, arrays: Mapping[str, Any]) -> list[Path]:
    import h5py

    with h5py.File(folder / "run.h5", "w") as file:
        for name, values in arrays.items():
            file[name] = values
    return [folder / "run.h5"]


def _of_observations(folder: Path, motion: Motion) -> list[Path]:
    q, dq, tau = motion.signals
    held = {"qpos": q, "qvel": dq, "effort": tau}
    return _hdf5(folder, {"action": q} | {f"observations/{name}": values for name, values in held.items()})


def _demonstrations(folder: Path, motion: Motion) -> list[Path]:
    half = len(motion.time_s) // 2
    names = ("robot0_joint_pos", "robot0_joint_vel", "robot0_joint_torque")
    return _hdf5(folder, {f"data/demo_{k}/obs/{name}": values[part] for name, values in
                          zip(names, motion.signals, strict=True)
                          for k, part in enumerate((slice(0, half), slice(half, None)))})  # fmt: skip


def kuka_trace(folder: Path, motion: Motion) -> list[Path]:
    """One pair of header and values an axis."""
    written = []
    period = float(np.median(np.diff(motion.time_s)))
    for k in range(motion.signals[0].shape[1]):
        q, dq, tau = (values[:, k] for values in motion.signals)
        channels = (("Actual_Velocity", "°/s", np.degrees(dq)), ("Calculated_Moment", "Nm", 0.9 * tau),
                    ("Actual_Moment", "Nm", tau), ("Actual_Position", "°", np.degrees(q)))  # fmt: skip
        stem = f"CELL_NextGenDrive#{k + 1}"
        head = [{200: "Zeit", 202: "sec", 210: "IMPLIZIT", 220: q.size, 240: 0, 241: period}]
        head += [{200: name, 202: unit, 210: "EXPLIZIT", 211: f"{stem}.r64", 213: "BLOCK", 214: "REAL64", 220: q.size,
                  221: place, 240: 0, 241: 1} for place, (name, unit, _) in enumerate(channels, 1)]  # fmt: skip
        lines = ["DIAEXTENDED", "#BEGINGLOBALHEADER", "112,High -> Low", "#ENDGLOBALHEADER"]
        for channel in head:
            lines += ["#BEGINCHANNELHEADER", *(f"{number},{said}" for number, said in channel.items())]
            lines.append("#ENDCHANNELHEADER")
        (folder / f"{stem}.dat").write_bytes("\r\n".join([*lines, ""]).encode("cp1252"))
        np.column_stack([values for _, _, values in channels]).tofile(folder / f"{stem}.r64")
        written.append(folder / f"{stem}.dat")
    return written


def _json_lines(name: str, row: Callable[[Motion, int], Mapping[str, Any]]) -> Build:
    def build(folder: Path, motion: Motion) -> list[Path]:
        rows = (json.dumps(row(motion, k)) for k in range(len(motion.time_s)))
        (folder / name).write_text("\n".join(rows) + "\n", encoding="utf-8")
        return [folder / name]

    return build


def _joint_state_row(motion: Motion, k: int) -> Mapping[str, Any]:
    q, dq, tau = (values[k].tolist() for values in motion.signals)
    ns = 1_700_000_000_000_000_000 + round(1e9 * float(motion.time_s[k]))
    stamp = {"sec": ns // 10**9, "nanosec": ns % 10**9}
    return {"header": {"stamp": stamp}, "name": ["joint1", "joint2"], "position": q, "velocity": dq, "effort": tau}


def _begun_with(name: str, head: bytes) -> Build:
    def build(folder: Path, motion: Motion) -> list[Path]:
        (folder / name).write_bytes(head + bytes(64))
        return [folder / name]

    return build


def _messages(kind: str) -> Build:
    def build(folder: Path, motion: Motion) -> list[Path]:
        q, dq, tau = motion.signals

        def said(encoding: str) -> list[Any]:
            start = 1_700_000_000_000_000_000
            return [
                joint_state(["joint1", "joint2"], q[k], dq[k], tau[k], encoding=encoding,
                            stamp_ns=start + round(1e9 * float(motion.time_s[k])))
                for k in range(motion.time_s.size)
            ]  # fmt: skip

        return [write_any(folder, kind, said)]

    return build


def _text(name: str = "run.csv", delimiter: str = ",", decimal: str = ".") -> Build:
    return lambda folder, m: csv(folder / name, m.plain(), delimiter, decimal)


def _changed(change: Callable[[Motion], Columns]) -> Build:
    return lambda folder, m: csv(folder / "run.csv", change(m))


def _without(*names: str) -> Build:
    return _changed(lambda m: {name: values for name, values in m.plain().items() if name not in names})


def _renamed(rename: Callable[[str], str]) -> Build:
    return _changed(lambda m: {rename(name): values for name, values in m.plain().items()})


def _one_quantity_each(folder: Path, motion: Motion) -> list[Path]:
    files = []
    for quantity, values in zip(("position", "velocity", "effort"), motion.signals, strict=True):
        columns = {"t": motion.time_s, "Joint_1": values[:, 0], "Joint_2": values[:, 1]}
        files += csv(folder / f"{quantity}.csv", columns)
    return files


def _wrapped(m: Motion) -> Columns:
    return m.plain() | {"q1": np.mod(m.signals[0][:, 0] - 0.5, 2 * np.pi) + 0.5}


def _garbage(m: Motion) -> Columns:
    time = m.time_s.copy()
    time[100] = 1e154
    return m.plain() | {"t": time}


def _restarted(m: Motion) -> Columns:
    half = m.time_s.size // 2
    return m.plain() | {"t": np.concatenate([m.time_s[:half], m.time_s[: m.time_s.size - half]])}


def _six(*stems: str) -> Build:
    return _changed(
        lambda m: m.plain() | {stem: 5 * np.sin(m.time_s + k) for k, stem in enumerate(stems)},
    )


def _beside(m: Motion, *stems: str) -> Columns:
    return m.plain() | {stem.replace("#", str(k)): np.cos(m.time_s + k) for stem in stems for k in (1, 2)}


def _two_arms(name: Callable[[str, int], str], topic: str) -> Build:
    """Two arms in one MCAP; the right one does what the left one does half a log later."""

    def build(folder: Path, motion: Motion) -> list[Path]:
        half = len(motion.time_s) // 2
        told = []
        for late, side in ((0, "left"), (half, "right")):
            names, values = [name(side, k) for k in (1, 2)], [np.roll(each, late, axis=0) for each in motion.signals]
            for t, *row in zip(motion.time_s, *values, strict=True):
                stamp = EPOCH + round(t * 1e9) + 100_000 * bool(late)
                told.append(joint_state(names, *row, stamp_ns=stamp, topic=topic.format(side)))
        return [write_mcap(folder / "run.mcap", sorted(told, key=lambda one: one.log_ns))]

    return build


ROWS: tuple[Row, ...] = (
    *(_vocabulary(name) for name in VOCABULARIES),
    Row("Format", "CSV, decimal point", _text()),
    Row("Format", "CSV with `;` and decimal comma", _text(delimiter=";", decimal=",")),
    Row("Format", "text with blanks between", _text(delimiter=" ")),
    Row("Format", "text without names of columns", _no_names),
    Row("Format", "`.csv.gz`", _packed),
    Row("Format", "`.zip` of one log", _zipped),
    Row("Format", "Parquet", _binary("run.parquet", lambda path, columns: pq.write_table(pa.table(columns), path))),
    Row("Format", "Feather",
        _binary("run.feather", lambda path, columns: feather.write_feather(pa.table(columns), path))),
    Row("Format", "NumPy `.npz`", _binary("run.npz", _npz)),
    Row("Format", "MATLAB `.mat`", _binary("run.mat", _mat)),
    Row("Format", "MATLAB, one variable a `.mat`", _variable_each),
    Row("Format", "MATLAB, structs in structs, one row a joint", _structs),
    Row("Format", "NumPy `.npy`, a matrix", _matrix),
    Row("Format", "NumPy `.npy`, a matrix, columns stated", _matrix,
        ("--set", "log.csv={ time = 1, position = [2, 3], velocity = [4, 5], effort = [6, 7] }")),
    Row("Format", "`*ang*`, `*vel*`, `*torque*`, no names of columns", _nameless_each),
    Row("Format", "HDF5, an array a signal",
        lambda folder, m: _hdf5(folder, {"t": m.time_s} | dict(zip(("q", "dq", "tau"), m.signals, strict=True)))),
    Row("Format", "HDF5, `observations/qpos` …, no time", _of_observations),
    Row("Format", "HDF5, `observations/qpos` …, rate stated", _of_observations, ("--set", "log.csv.rate_hz=125")),
    Row("Format", "HDF5, `data/demo_0/obs/robot0_joint_pos` …, rate stated", _demonstrations,
        ("--set", "log.csv.rate_hz=125"), finding="time-gap"),
    Row("Format", "KUKA trace, a `.dat` and a `.r64` an axis", kuka_trace),
    Row("Format", "JSON lines, a key a column", _json_lines(
        "run.jsonl", lambda m, k: {name: float(values[k]) for name, values in m.plain().items()})),
    Row("Format", "JSON lines, a JointState a line", _json_lines("run.ndjson", _joint_state_row)),
    Row("Format", "Excel `.xlsx`", _workbook),
    Row("Format", "TDMS", _begun_with("run.tdms", b"TDSm")),
    Row("Format", "a pickle", _begun_with("run.pkl", b"\x80\x04")),
    Row("Format", "MCAP, ROS 2", _messages("mcap-zstd")),
    Row("Format", "MCAP, ROS 1", _messages("mcap-ros1")),
    Row("Format", "ROS 1 bag", _messages("bag-lz4")),
    Row("Format", "lone `.db3`", _messages("db3")),
    Row("Format", "ROS 2 bag folder", _messages("folder-mcap")),
    Row("Trap", "no robot stated", _text(), robot=False),
    Row("Trap", "positions count from 0, efforts from 1",
        _changed(lambda m: {{"q1": "q0", "q2": "q1"}.get(n, n): v for n, v in m.plain().items()})),
    Row("Trap", "one column a joint too few", _without("q2", "dq2", "tau2")),
    Row("Trap", "`q1`, `q3`: a number is missing", _renamed(lambda name: name.replace("2", "3"))),
    Row("Trap", "only desired positions", _renamed(lambda n: n.replace("q", "q_des_") if n[0] == "q" else n)),
    Row("Trap", "two torques that both may be measured",
        _changed(lambda m: {n: v for n, v in _beside(m, "torque_sensor_a_#", "torque_sensor_b_#").items()
                            if not n.startswith("tau")})),
    Row("Trap", "desired and commanded columns beside", _changed(lambda m: _beside(m, "q_des_#", "tau_cmd_#"))),
    Row("Trap", "a word that the vocabulary lacks beside", _changed(lambda m: _beside(m, "master_q#"))),
    Row("Trap", "`left_…` and `right_…`: two arms",
        _changed(lambda m: {"t": m.time_s} | {f"{side}_{n}": v for side in ("left", "right")
                                              for n, v in m.plain().items() if n != "t"})),
    Row("Trap", "two arms, a topic each, the same names", _two_arms(lambda side, k: f"joint{k}", "/{}/joint_states")),
    Row("Trap", "two arms, publishers of one topic, names with a side",
        _two_arms(lambda side, k: f"{side}_joint{k}", "/joint_states")),
    Row("Trap", "no time column", _without("t")),
    Row("Trap", "no time column, rate stated", _without("t"), ("--set", "log.csv.rate_hz=125")),
    Row("Trap", "time that begins again", _changed(_restarted), finding="time-gap"),
    Row("Trap", "time in ms, by its name",
        _changed(lambda m: {"time_ms": 1e3 * m.time_s} | {n: v for n, v in m.plain().items() if n != "t"})),
    Row("Trap", "a stamp of 1e154 s", _changed(_garbage), finding="log-nan"),
    Row("Trap", "one quantity a file, the same names", _one_quantity_each),
    Row("Trap", "an angle wrapped by 2π", _changed(_wrapped), finding="fact"),
    Row("Trap", "a `label` column", _changed(lambda m: m.plain(label=(np.sin(m.time_s) > 0.9).astype(float)))),
    Row("Trap", "columns of a force/torque sensor", _six("Fx", "Fy", "Fz", "Mx", "My", "Mz")),
    Row("Trap", "a wrench that was estimated", _six(*(f"O_F_ext_hat_K_{k}" for k in range(6)))),
    Row("Trap", "currents, no torque constants",
        lambda folder, m: csv(folder / "run.csv", table_of("units", 1, m.time_s, m.signals))),
    Row("Trap", "an inverted effort", _changed(lambda m: m.plain() | {"tau1": -m.signals[2][:, 0]})),
)  # fmt: skip
