"""``signals.parquet``: the sample-by-sample evidence of an audit.

One row a sample, ``time_s`` first, as float64, then for each joint ``QUANTITY:JOINT`` as float32, and the wrist sensor
(``wrench:fx`` …). The range of the residual where friction is an interval (``least_nm``, ``most_nm``) and the
wrench are absent where there are none. ``gamma_nm`` is the threshold in force, NaN of a joint without one: rule (6)
applied to ``residual_nm`` and it, where ``state`` says that a sample counts, gives every alarm again (docs/python.md).
Of a log whose motion repeats ``cycle`` numbers its cycles from 0 (-1 outside), ``cycle_place`` is the place on the path
from 0 to 1, ``cycle_nm`` the residual less that of the same place of other cycles, ``cycle_gamma_nm`` its threshold:
the same rule, on the same samples; NaN where there is no reference.
Numbers are multiples of steps (:mod:`joint_trace`), which the metadata state: a torque's is below a thousandth of gamma
and a sixteenth of the residual's own spread, and no residual is rounded across gamma. They are there to be looked at
and cross-checked; to differentiate or to audit again, take the log itself.
"""

from __future__ import annotations

import io
import json
import math
from pathlib import Path
from typing import IO, Any, cast

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from collaudit.core.data.signals import CycleSignals, Signals, State
from collaudit.core.errors import CollauditError
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.parallel import ordered_map
from collaudit.reports.plots.joint_trace import (
    FORCE_STEP_N,
    MOMENT_STEP_NM,
    POSITION_STEP,
    VELOCITY_STEP,
    JointTrace,
    in_steps,
    limits_nm,
    size,
    stored,
    torque_step_nm,
)

SIGNALS_SCHEMA = "collaudit/signals/1"
_META = b"collaudit"
_ROWS = 1 << 17
_WIDE = ("position_rad", "velocity_rad_s", "measured_nm", "model_nm", "residual_nm", "gamma_nm", "state")
_RANGE = ("least_nm", "most_nm")
_WRENCH = tuple(f"wrench:{axis}" for axis in ("fx", "fy", "fz", "mx", "my", "mz"))
Values = np.ndarray[Any, Any]


def write_signals(file: IO[bytes], signals: Signals, log_sha256: str) -> None:
    """Write the signals; the same signals give the same bytes with the same pyarrow.

    Args:
        file: to write into, opened by Python: Arrow opens no name that is not UTF-8.
        signals: n samples of j joints.
        log_sha256: hash of the log they are from, which ties the file to its ``audit.json``.
    """
    joints = range(len(signals.joint_names))
    steps = [torque_step_nm(signals.residual_nm[:, k], signals.gamma_nm[:, k]) for k in joints]
    if (its := signals.cycles) is not None:
        steps = [
            min(step, torque_step_nm(its.torque_nm[:, k], its.gamma_nm[:, k]) or step) for k, step in enumerate(steps)
        ]
    kinds = {name: pa.from_numpy_dtype(x.dtype) for name, x in _columns(signals, steps, slice(0)).items()}
    schema = pa.schema([*kinds.items()], metadata=_meta(signals, steps, log_sha256))
    states = [name for name in schema.names if name.startswith("state:") or name == "cycle"]
    floats = [name for name in schema.names if name not in states]
    with pq.ParquetWriter(
        file,
        schema,
        compression="zstd",
        compression_level=1,
        use_dictionary=states,
        use_byte_stream_split=floats,
        write_statistics=False,
        store_schema=True,
    ) as writer:

        def part(start: int) -> pa.Table:  # a table of all rows would take as much memory as the log
            columns = _columns(signals, steps, slice(start, start + _ROWS))
            return pa.Table.from_arrays([column_of(x) for x in columns.values()], schema=schema)

        for table in ordered_map(part, range(0, len(signals.time_s), _ROWS)):
            writer.write_table(table)


def read_signals(path: Path, log_sha256: str) -> Signals:
    """Read signals back; arguments and errors as of :class:`StoredSignals`.

    Returns:
        The signals, in the steps in which they are stored.
    """
    file = StoredSignals(path, log_sha256)
    joints = file.joint_names
    wide = {name: file.of_joints(name).astype(np.float64) for name in _WIDE if name not in ("state", "gamma_nm")}
    least, most = (file.of_joints(name) if file.has(f"{name}:{joints[0]}") else None for name in _RANGE)
    return Signals(
        time_s=file.time_s,
        joint_names=joints,
        gamma_nm=file.of_joints("gamma_nm"),
        near_below_nm=np.array(file.near_below_nm, dtype=np.float64),  # null becomes NaN
        state=np.stack([file.states(joint) for joint in joints], axis=1),
        least_nm=least,
        most_nm=most,
        wrench=np.stack([file.read(name) for name in _WRENCH], axis=1).astype(np.float64) if file.wrenches else None,
        cycles=None
        if (own := file.cycle) is None
        else CycleSignals(*own, file.of_joints("cycle_nm").astype(np.float64), file.of_joints("cycle_gamma_nm")),
        **wide,
    )


def _meta(signals: Signals, steps: list[float], log_sha256: str) -> dict[bytes, bytes]:
    """What is stated about the columns."""
    meta = {
        "schema": SIGNALS_SCHEMA,
        "log_sha256": log_sha256,
        "joints": list(signals.joint_names),
        "torque_step_nm": steps,
        "near_below_nm": [float(x) if math.isfinite(x) else None for x in signals.near_below_nm],
        "position_step": POSITION_STEP,
        "velocity_step": VELOCITY_STEP,
        "states": {str(int(state)): state.code for state in State},
    }
    return {_META: json.dumps(meta, allow_nan=False).encode()}


def _columns(signals: Signals, steps: list[float], rows: slice) -> dict[str, Values]:
    """The columns of some samples, by name."""
    its = signals.cycles
    wide: dict[str, Values] = {name: getattr(signals, name) for name in _WIDE}
    if signals.least_nm is not None:
        wide |= {name: getattr(signals, name) for name in _RANGE}
    if its is not None:
        wide |= {"cycle_nm": its.torque_nm, "cycle_gamma_nm": its.gamma_nm}
    columns: dict[str, Values] = {"time_s": signals.time_s[rows]}
    for k, (joint, step) in enumerate(zip(signals.joint_names, steps, strict=True)):
        for name, values in wide.items():
            columns[f"{name}:{joint}"] = stored(name, values[rows, k], step, limits_nm(signals, k, rows, name))
    if its is not None:
        columns |= {"cycle": its.number[rows], "cycle_place": its.place[rows]}
    if signals.wrench is not None:
        finest = (FORCE_STEP_N,) * 3 + (MOMENT_STEP_NM,) * 3
        columns |= {n: in_steps(x, step) for n, x, step in zip(_WRENCH, signals.wrench[rows].T, finest, strict=True)}
    return columns


def column_of(values: Values) -> pa.Array:
    """An Arrow array over the memory of (n,) numbers; NaN stays NaN and is not null."""
    values = np.ascontiguousarray(values)
    return pa.Array.from_buffers(pa.from_numpy_dtype(values.dtype), len(values), [None, pa.py_buffer(values)])


#: What a trace takes as it stands.
_TRACED = ("position_rad", "velocity_rad_s", "measured_nm", "gamma_nm", "least_nm", "most_nm")


class StoredSignals:
    """The signals of a run, each column read when it is asked for."""

    def __init__(self, source: Path | IO[bytes], log_sha256: str) -> None:
        """Open the file; nothing but its metadata and time is read yet.

        Args:
            source: the file, or its content.
            log_sha256: hash of the log that ``audit.json`` names.

        Raises:
            CollauditError: no such file, not Parquet, another kind or version, or of another log.
        """
        self._where = str(source)
        try:
            opened = source.open("rb") if isinstance(source, Path) else source
            self._file = pq.ParquetFile(pa.PythonFile(opened, "r"), memory_map=False, pre_buffer=False)
        except FileNotFoundError as error:
            raise CollauditError("no such file", where=self._where) from error
        except (pa.ArrowException, OSError) as error:
            raise _unreadable(self._where, str(error)) from error
        self._meta = _checked_meta(self._file.schema_arrow, self._where, log_sha256)
        self.time_s = self.read("time_s").astype(np.float64)

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Joints there are signals of."""
        return tuple(self._meta["joints"])

    @property
    def end_s(self) -> float | None:
        """Time of the last sample; None without samples."""
        return float(self.time_s[-1]) if len(self.time_s) else None

    @property
    def wrenches(self) -> bool:
        """Whether there is a wrist sensor."""
        return all(map(self.has, _WRENCH))

    def has(self, name: str) -> bool:
        """Whether there is such a column."""
        return name in self._file.schema_arrow.names

    @property
    def near_below_nm(self) -> list[float | None]:
        """How far below each joint's threshold in force a near miss begins; None where there is none."""
        return list(self._meta["near_below_nm"])

    def read(self, name: str) -> Values:
        """One column by itself, so that little else is in memory meanwhile.

        Raises:
            CollauditError: it is missing, holds no numbers, or cannot be read.
        """
        if not self.has(name):
            raise CollauditError("a column is missing", where=self._where, expected=f"column {name!r}")
        try:
            column = self._file.read(columns=[name], use_threads=False).column(0)
            return np.from_dlpack(column.combine_chunks())  # to_numpy would import pandas
        except (pa.ArrowException, OSError) as error:
            raise _unreadable(self._where, str(error)) from error

    def states(self, joint: str) -> Values:
        """The state of each sample of one joint.

        Raises:
            CollauditError: as :meth:`read`, or a code is unknown to this version.
        """
        state, known = self.read(f"state:{joint}"), max(State)
        if not ((state >= 0) & (state <= known)).all():
            raise CollauditError("a state code is unknown", where=self._where, expected=f"0 to {int(known)}")
        return state

    def of_joints(self, name: str) -> Values:
        """(n, j) one quantity of every joint."""
        return np.stack([self.read(f"{name}:{joint}") for joint in self.joint_names], axis=1)

    @property
    def cycle(self) -> tuple[Values, Values] | None:
        """Number of the cycle and place on its path of each sample; None where nothing repeats."""
        return (self.read("cycle"), self.read("cycle_place")) if self.has("cycle") else None

    def trace(self, column: int) -> JointTrace:
        """One joint's signals."""
        joint = self.joint_names[column]
        read = {name: self.read(f"{name}:{joint}") for name in _TRACED if name in _WIDE or self.has(f"{name}:{joint}")}
        return JointTrace(
            joint=joint,
            time_s=self.time_s,
            state=self.states(joint),
            residual_nm=self.read(f"residual_nm:{joint}").astype(np.float64),
            cycle=self.cycle,
            **{name: cast(Any, read.get(name)) for name in _TRACED},
        )

    def force_n(self) -> tuple[FloatArray, FloatArray] | None:
        """Time and size of the force at the wrist sensor (n,); None without one."""
        if not self.wrenches:
            return None
        return self.time_s, size(np.stack([self.read(name) for name in _WRENCH[:3]], axis=1))


def in_memory(signals: Signals) -> StoredSignals:
    """Signals as they stand in the file of a run, without one."""
    content = io.BytesIO()
    write_signals(content, signals, "")
    return StoredSignals(content, "")


def _unreadable(where: str, found: str) -> CollauditError:
    return CollauditError(
        "cannot read the signals",
        where=where,
        found=(found.splitlines() or [""])[0][:200],
        expected="a Parquet file written by collaudit",
        hint="make the run again with collaudit detect",
    )


def _checked_meta(schema: pa.Schema, where: str, log_sha256: str) -> dict[str, Any]:
    try:
        meta: dict[str, Any] = json.loads((schema.metadata or {})[_META])
        found = meta["schema"]
    except (KeyError, ValueError, TypeError, RecursionError):
        found = None
    if found != SIGNALS_SCHEMA:
        raise CollauditError(
            "this is not a signals file of a version this collaudit knows",
            where=where,
            found=f"schema {found!r}",
            expected=f"schema {SIGNALS_SCHEMA!r}",
        )
    if meta["log_sha256"] != log_sha256:
        raise CollauditError(
            "the signals are of another log than audit.json beside them",
            where=where,
            found=f"log sha256 {meta['log_sha256']}",
            expected=f"log sha256 {log_sha256}",
            hint="make the run again with collaudit detect",
        )
    return meta
