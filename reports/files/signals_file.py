"""``signals.parquet``: the sample-by-sample evidence of an audit.

One row a sample, ``time_s`` first, as float64, then for each joint ``QUANTITY:JOINT`` as float32, and the wrist sensor
(``wrench:fx`` …). The range of the residual where friction is an interval (``least_nm``, ``most_nm``) and the wrench
are absent where there are none. Numbers are multiples of steps (:mod:`signal_steps`), which the metadata state: a
torque's is below a thousandth of gamma and a sixteenth of the residual's own spread, and no residual is rounded across
gamma. They are there to be looked at and cross-checked; to differentiate or to audit again, take the log itself.
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
from collaudit.core.numeric.arrays import FloatArray
from collaudit.reports.files.signals_layout import (
    META,
    RANGE,
    SIGNALS_SCHEMA,
    WIDE,
    WRENCH,
    SignalsColumns,
    column_of,
)
from collaudit.reports.plots.joint_trace import JointTrace, size
from collaudit.reports.values.signal_steps import (
    FORCE_STEP_N,
    MOMENT_STEP_NM,
    POSITION_STEP,
    VELOCITY_STEP,
    in_steps,
    stored,
    torque_step_nm,
)

_ROWS = 1 << 17


def write_signals(path: Path, signals: Signals, log_sha256: str) -> None:
    """Write the signals; the same signals give the same bytes with the same pyarrow.

    Args:
        path: the file to make.
        signals: n samples of j joints.
        log_sha256: hash of the log they are from, which ties the file to its ``audit.json``.
    """
    steps = [torque_step_nm(signals.residual_nm[:, k], float(g)) for k, g in enumerate(signals.gamma_nm)]
    schema = _schema(signals, steps, log_sha256)
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
        count = len(signals.time_s)
        parts = [slice(start, min(start + _ROWS, count)) for start in range(0, count, _ROWS)]
        room = np.empty((len(floats) - 1, min(_ROWS, count)), dtype=np.float32)  # all but time
        for rows in parts:  # one after the other: the log may still be judged beside, and a table takes 35 MB
            writer.write_table(_rows(signals, steps, schema, rows, room))


def read_signals(path: Path, log_sha256: str) -> Signals:
    """Read signals back.

    Args:
        path: the file.
        log_sha256: hash of the log that ``audit.json`` names.

    Returns:
        The signals, in the steps in which they are stored.

    Raises:
        CollauditError: no such file, not Parquet, another kind or version, or of another log.
    """
    file = SignalsColumns(path, log_sha256)
    joints = tuple(file.meta["joints"])
    state = np.stack([file.states(joint) for joint in joints], axis=1)
    wide = {name: _wide(file, name, joints, np.float64) for name in WIDE if name != "state"}
    least, most = (
        _wide(file, name, joints, np.float32) if f"{name}:{joints[0]}" in file.names else None for name in RANGE
    )
    wrench = [file.read(name) for name in WRENCH if name in file.names]
    return Signals(
        time_s=file.read("time_s").astype(np.float64),
        joint_names=joints,
        gamma_nm=np.array([math.nan if g is None else g for g in file.meta["gamma_nm"]], dtype=np.float64),
        state=state,
        least_nm=least,
        most_nm=most,
        wrench=np.stack(wrench, axis=1).astype(np.float64) if len(wrench) == len(WRENCH) else None,
        **wide,
    )


def _schema(signals: Signals, steps: list[float], log_sha256: str) -> pa.Schema:
    columns = [pa.field("time_s", pa.float64())]
    for joint in signals.joint_names:
        columns += [pa.field(f"{name}:{joint}", kind) for name, kind in _kinds(signals).items()]
    columns += [pa.field(name, pa.float32()) for name in WRENCH if signals.wrench is not None]
    meta = {
        "schema": SIGNALS_SCHEMA,
        "log_sha256": log_sha256,
        "joints": list(signals.joint_names),
        "gamma_nm": [float(g) if math.isfinite(g) else None for g in signals.gamma_nm],
        "torque_step_nm": steps,
        "position_step": POSITION_STEP,
        "velocity_step": VELOCITY_STEP,
        "states": {str(int(state)): state.code for state in State},
    }
    return pa.schema(columns, metadata={META: json.dumps(meta, allow_nan=False).encode()})


def _rows(
    signals: Signals, steps: list[float], schema: pa.Schema, rows: slice, room: np.ndarray[Any, np.dtype[np.float32]]
) -> pa.Table:
    """A part of the table, whose 32-bit columns lie in ``room`` (columns, rows).

    That is used again and again: many small arrays, where large ones were freed, would leave no place for large ones.
    """
    arrays, idle = [column_of(signals.time_s[rows])], iter(room[:, : rows.stop - rows.start])

    def placed(values: np.ndarray[Any, Any]) -> pa.Array:
        if values.dtype != np.float32:
            return column_of(values)
        place = next(idle)
        place[...] = values
        return column_of(place)

    for k, step in enumerate(steps):
        for name in _kinds(signals):
            arrays.append(placed(stored(name, getattr(signals, name)[rows, k], step, signals.gamma_nm[k])))
    if signals.wrench is not None:
        finest = (FORCE_STEP_N,) * 3 + (MOMENT_STEP_NM,) * 3
        arrays += [placed(in_steps(x, step)) for x, step in zip(signals.wrench[rows].T, finest, strict=True)]
    return pa.Table.from_arrays(arrays, schema=schema)


def _kinds(signals: Signals) -> dict[str, pa.DataType]:
    """The quantities of each joint that there are."""
    return WIDE if signals.least_nm is None else {**WIDE, **RANGE}


def _wide(file: SignalsColumns, name: str, joints: tuple[str, ...], kind: type) -> np.ndarray[Any, Any]:
    """(n, j) one quantity of every joint."""
    out = np.empty((file.rows, len(joints)), dtype=kind)
    for k, joint in enumerate(joints):
        out[:, k] = file.read(f"{name}:{joint}")
    return out


#: What a trace takes as it stands.
_TRACED = ("position_rad", "velocity_rad_s", "measured_nm", "least_nm", "most_nm")


class StoredSignals:
    """The signals of a run, read joint by joint when they are asked for."""

    def __init__(self, path: Path, log_sha256: str) -> None:
        """``path``: of the file; ``log_sha256``: hash of the log that ``audit.json`` names.

        Raises:
            CollauditError: as :func:`read_signals`.
        """
        self._file = SignalsColumns(path, log_sha256)
        self._time_s = self._file.read("time_s").astype(np.float64)

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Joints there are signals of."""
        return tuple(self._file.meta["joints"])

    @property
    def end_s(self) -> float | None:
        """Time of the last sample; None without samples."""
        return float(self._time_s[-1]) if len(self._time_s) else None

    def trace(self, column: int) -> JointTrace:
        """One joint's signals."""
        joint = self.joint_names[column]
        traced = (name for name in _TRACED if name in WIDE or f"{name}:{joint}" in self._file.names)
        read = {name: self._file.read(f"{name}:{joint}") for name in traced}
        gamma = self._file.meta["gamma_nm"][column]
        return JointTrace(
            joint=joint,
            time_s=self._time_s,
            state=self._file.states(joint),
            gamma_nm=math.nan if gamma is None else gamma,
            residual_nm=self._file.read(f"residual_nm:{joint}").astype(np.float64),
            **{name: cast(Any, read.get(name)) for name in _TRACED},
        )

    def force_n(self) -> tuple[FloatArray, FloatArray] | None:
        """Time and size of the force at the wrist sensor (n,); None without one."""
        if not set(WRENCH) <= self._file.names:
            return None
        return self._time_s, size(np.stack([self._file.read(name) for name in WRENCH[:3]], axis=1))
