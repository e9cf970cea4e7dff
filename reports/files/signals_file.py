"""``signals.parquet``: the sample-by-sample evidence of an audit.

One row a sample, ``time_s`` first, then for each joint ``QUANTITY:JOINT``. The residual and the time are
float64, since the residual is compared with a threshold and must not be rounded across it. Position,
velocity, measured and modelled torque are float32: they are there to be looked at and cross-checked, their
7 digits are finer than any encoder or current sensor, and the file shrinks by 40 %. To differentiate or to
audit again, take the log itself. The same holds for the range of the residual where friction is an interval
(``least_nm``, ``most_nm``) and for the wrist sensor (``wrench:fx`` …); both are absent where there are none.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any, cast

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from collaudit.core.data.signals import Signals, State
from collaudit.core.errors import CollauditError
from collaudit.core.numeric.arrays import FloatArray
from collaudit.reports.files.arrow_columns import column_of, number_kind
from collaudit.reports.plots.joint_trace import JointTrace, size

SIGNALS_SCHEMA = "collaudit/signals/1"

_META = b"collaudit"
_ROWS = 1 << 17
_WIDE = {
    "position_rad": pa.float32(),
    "velocity_rad_s": pa.float32(),
    "measured_nm": pa.float32(),
    "model_nm": pa.float32(),
    "residual_nm": pa.float64(),
    "state": pa.int8(),
}
_RANGE = {"least_nm": pa.float32(), "most_nm": pa.float32()}
#: What a trace takes as it stands.
_TRACED = ("position_rad", "velocity_rad_s", "measured_nm", "residual_nm", "least_nm", "most_nm")
_WRENCH = tuple(f"wrench:{axis}" for axis in ("fx", "fy", "fz", "mx", "my", "mz"))


def write_signals(path: Path, signals: Signals, log_sha256: str) -> None:
    """Write the signals; the same signals give the same bytes with the same pyarrow.

    Args:
        path: the file to make.
        signals: n samples of j joints.
        log_sha256: hash of the log they are from, which ties the file to its ``audit.json``.
    """
    schema = _schema(signals, log_sha256)
    floats = [name for name in schema.names if not name.startswith("state:")]
    states = [name for name in schema.names if name.startswith("state:")]
    with pq.ParquetWriter(
        path,
        schema,
        compression="zstd",
        compression_level=1,
        use_dictionary=states,
        use_byte_stream_split=floats,
        write_statistics=False,
        store_schema=True,
    ) as writer:
        for start in range(0, len(signals.time_s), _ROWS):
            writer.write_table(_rows(signals, schema, slice(start, start + _ROWS)))


def read_signals(path: Path, log_sha256: str) -> Signals:
    """Read signals back.

    Args:
        path: the file.
        log_sha256: hash of the log that ``audit.json`` names.

    Returns:
        The signals; position, velocity, measured and modelled torque as stored, in 7 digits.

    Raises:
        CollauditError: no such file, not Parquet, another kind or version, or of another log.
    """
    table = _load(path)
    meta = _checked_meta(table.schema, path, log_sha256)
    joints = tuple(meta["joints"])
    wide = {name: _wide(table, name, joints, path) for name in _WIDE}
    least, most = (
        _wide(table, name, joints, path) if f"{name}:{joints[0]}" in table.column_names else None for name in _RANGE
    )
    wrench = [_column(table, name, path) for name in _WRENCH if name in table.column_names]
    return Signals(
        time_s=_column(table, "time_s", path).astype(np.float64),
        joint_names=joints,
        gamma_nm=np.array([math.nan if g is None else g for g in meta["gamma_nm"]], dtype=np.float64),
        state=_checked_states(wide.pop("state"), path),
        least_nm=least,
        most_nm=most,
        wrench=np.stack(wrench, axis=1).astype(np.float64) if len(wrench) == len(_WRENCH) else None,
        **{name: values.astype(np.float64, copy=False) for name, values in wide.items()},
    )


class StoredSignals:
    """The signals of a run, read joint by joint when they are asked for."""

    def __init__(self, path: Path, log_sha256: str) -> None:
        """``path``: of the file; ``log_sha256``: hash of the log that ``audit.json`` names.

        Raises:
            CollauditError: as :func:`read_signals`.
        """
        self._path = path
        self._file = _open(path)
        self._meta = _checked_meta(self._file.schema_arrow, path, log_sha256)
        self._time_s = self._read(["time_s"])["time_s"].astype(np.float64)

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Joints there are signals of."""
        return tuple(self._meta["joints"])

    @property
    def end_s(self) -> float | None:
        """Time of the last sample; None without samples."""
        return float(self._time_s[-1]) if len(self._time_s) else None

    def trace(self, column: int) -> JointTrace:
        """One joint's signals."""
        joint, known = self.joint_names[column], set(self._file.schema_arrow.names)
        wanted = [name for name in (*_WIDE, *_RANGE) if f"{name}:{joint}" in known and name != "model_nm"]
        read = self._read([f"{name}:{joint}" for name in wanted])
        of = {name: read.get(f"{name}:{joint}") for name in (*_WIDE, *_RANGE)}
        for name in _WIDE:
            if of[name] is None and name != "model_nm":
                raise CollauditError("a column is missing", where=str(self._path), expected=f"column {name}:{joint!r}")
        gamma = self._meta["gamma_nm"][column]
        return JointTrace(
            joint=joint,
            time_s=self._time_s,
            state=_checked_states(cast(Any, of["state"]), self._path),
            gamma_nm=math.nan if gamma is None else gamma,
            **{name: cast(Any, of[name]) for name in _TRACED},
        )

    def force_n(self) -> tuple[FloatArray, FloatArray] | None:
        """Time and size of the force at the wrist sensor (n,); None without one."""
        if not set(_WRENCH) <= set(self._file.schema_arrow.names):
            return None
        read = self._read(list(_WRENCH[:3]))
        return self._time_s, size(np.stack([read[name] for name in _WRENCH[:3]], axis=1))

    def _column(self, name: str) -> np.ndarray[Any, Any]:
        """One column; row group by row group, so that it is in memory once."""
        kind = number_kind(self._file.schema_arrow.field(name).type)
        out: np.ndarray[Any, Any] = np.empty(self._file.metadata.num_rows, dtype=kind)
        at = 0
        for group in range(self._file.num_row_groups):
            part = self._file.read_row_group(group, columns=[name], use_threads=False).column(0)
            out[at : at + len(part)] = part.to_numpy()
            at += len(part)
        return out

    def _read(self, columns: list[str]) -> dict[str, np.ndarray[Any, Any]]:
        try:
            return {name: self._column(name) for name in columns}
        except (pa.ArrowException, OSError, KeyError) as error:
            raise _unreadable(self._path, error) from error


def _schema(signals: Signals, log_sha256: str) -> pa.Schema:
    columns = [pa.field("time_s", pa.float64())]
    for joint in signals.joint_names:
        columns += [pa.field(f"{name}:{joint}", kind) for name, kind in _kinds(signals).items()]
    columns += [pa.field(name, pa.float32()) for name in _WRENCH if signals.wrench is not None]
    meta = {
        "schema": SIGNALS_SCHEMA,
        "log_sha256": log_sha256,
        "joints": list(signals.joint_names),
        "gamma_nm": [float(g) if math.isfinite(g) else None for g in signals.gamma_nm],
        "states": {str(int(state)): state.code for state in State},
    }
    return pa.schema(columns, metadata={_META: json.dumps(meta, allow_nan=False).encode()})


def _rows(signals: Signals, schema: pa.Schema, rows: slice) -> pa.Table:
    arrays = [column_of(signals.time_s[rows])]
    for k in range(len(signals.joint_names)):
        for name, kind in _kinds(signals).items():
            values = getattr(signals, name)[rows, k].astype(number_kind(kind), copy=False)
            arrays.append(column_of(values))
    if signals.wrench is not None:
        arrays += [column_of(column) for column in signals.wrench[rows].T.astype(np.float32)]
    return pa.Table.from_arrays(arrays, schema=schema)


def _kinds(signals: Signals) -> dict[str, pa.DataType]:
    """The quantities of each joint that there are."""
    return _WIDE if signals.least_nm is None else {**_WIDE, **_RANGE}


def _load(path: Path) -> pa.Table:
    try:
        return pq.read_table(path, memory_map=False)
    except FileNotFoundError as error:
        raise CollauditError("no such file", where=str(path)) from error
    except (pa.ArrowException, OSError) as error:
        raise _unreadable(path, error) from error


def _open(path: Path) -> pq.ParquetFile:
    try:
        return pq.ParquetFile(path, memory_map=False, pre_buffer=False)
    except FileNotFoundError as error:
        raise CollauditError("no such file", where=str(path)) from error
    except (pa.ArrowException, OSError) as error:
        raise _unreadable(path, error) from error


def _unreadable(path: Path, error: Exception) -> CollauditError:
    return CollauditError(
        "cannot read the signals",
        where=str(path),
        found=(str(error).splitlines() or [""])[0][:200],
        expected="a Parquet file written by collaudit",
        hint="make the run again with collaudit detect",
    )


def _checked_meta(schema: pa.Schema, path: Path, log_sha256: str) -> dict[str, Any]:
    meta = _meta(schema, path)
    if meta["log_sha256"] != log_sha256:
        raise CollauditError(
            "the signals are of another log than audit.json beside them",
            where=str(path),
            found=f"log sha256 {meta['log_sha256']}",
            expected=f"log sha256 {log_sha256}",
            hint="make the run again with collaudit detect",
        )
    return meta


def _meta(schema: pa.Schema, path: Path) -> dict[str, Any]:
    try:
        meta: dict[str, Any] = json.loads((schema.metadata or {})[_META])
        found = meta["schema"]
    except (KeyError, ValueError, TypeError):
        found = None
    if found != SIGNALS_SCHEMA:
        raise CollauditError(
            "this is not a signals file of a version this collaudit knows",
            where=str(path),
            found=f"schema {found!r}",
            expected=f"schema {SIGNALS_SCHEMA!r}",
        )
    return meta


def _column(table: pa.Table, name: str, path: Path) -> np.ndarray[Any, Any]:
    if name not in table.column_names:
        raise CollauditError("a column is missing", where=str(path), expected=f"column {name!r}")
    values: np.ndarray[Any, Any] = table.column(name).to_numpy()
    return values


def _wide(table: pa.Table, name: str, joints: tuple[str, ...], path: Path) -> np.ndarray[Any, Any]:
    kind = np.int8 if name == "state" else np.float32 if name in _RANGE else np.float64
    out = np.empty((table.num_rows, len(joints)), dtype=kind)
    for k, joint in enumerate(joints):
        out[:, k] = _column(table, f"{name}:{joint}", path)
    return out


def _checked_states(state: np.ndarray[Any, Any], path: Path) -> np.ndarray[Any, Any]:
    known = max(State)
    if state.size and not (int(state.min()) >= 0 and int(state.max()) <= known):
        raise CollauditError("a state code is unknown", where=str(path), expected=f"0 to {int(known)}")
    return state
