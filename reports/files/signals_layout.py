"""The layout of ``signals.parquet``: its columns as arrays, its version, and what is said of a file that breaks it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from collaudit.core.data.signals import State
from collaudit.core.errors import CollauditError

SIGNALS_SCHEMA = "collaudit/signals/1"
Values = np.ndarray[Any, Any]

META = b"collaudit"
WIDE = {
    "position_rad": pa.float32(),
    "velocity_rad_s": pa.float32(),
    "measured_nm": pa.float32(),
    "model_nm": pa.float32(),
    "residual_nm": pa.float32(),
    "state": pa.int8(),
}
RANGE = {"least_nm": pa.float32(), "most_nm": pa.float32()}
#: The NumPy type of an Arrow type of numbers.
_KINDS = {pa.from_numpy_dtype(kind): np.dtype(kind) for kind in (np.int8, np.int32, np.int64, np.float32, np.float64)}
WRENCH = tuple(f"wrench:{axis}" for axis in ("fx", "fy", "fz", "mx", "my", "mz"))


class SignalsColumns:
    """The columns of a file, each read when it is asked for."""

    def __init__(self, path: Path, log_sha256: str) -> None:
        """Open the file; nothing but its metadata is read yet.

        Args:
            path: the file.
            log_sha256: hash of the log that ``audit.json`` names.

        Raises:
            CollauditError: no such file, not Parquet, another kind or version, or of another log.
        """
        self._path, self._file = path, _opened(path)
        self.meta = _checked_meta(self._file.schema_arrow, path, log_sha256)
        self.names = frozenset(self._file.schema_arrow.names)
        self.rows = self._file.metadata.num_rows

    def read(self, name: str) -> np.ndarray[Any, Any]:
        """One column by itself, so that little else is in memory meanwhile.

        Raises:
            CollauditError: it is missing, or cannot be read.
        """
        if name not in self.names:
            raise CollauditError("a column is missing", where=str(self._path), expected=f"column {name!r}")
        try:
            return values_of(self._file.read(columns=[name], use_threads=False).column(0))
        except (pa.ArrowException, OSError, KeyError) as error:
            raise _unreadable(self._path, error) from error

    def states(self, joint: str) -> np.ndarray[Any, Any]:
        """The state of each sample of one joint.

        Raises:
            CollauditError: as :meth:`read`, or a code is unknown to this version.
        """
        state, known = self.read(f"state:{joint}"), max(State)
        if state.size and not (int(state.min()) >= 0 and int(state.max()) <= known):
            raise CollauditError("a state code is unknown", where=str(self._path), expected=f"0 to {int(known)}")
        return state


def _opened(path: Path) -> pq.ParquetFile:
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
    try:
        meta: dict[str, Any] = json.loads((schema.metadata or {})[META])
        found = meta["schema"]
    except (KeyError, ValueError, TypeError, RecursionError):
        found = None
    if found != SIGNALS_SCHEMA:
        raise CollauditError(
            "this is not a signals file of a version this collaudit knows",
            where=str(path),
            found=f"schema {found!r}",
            expected=f"schema {SIGNALS_SCHEMA!r}",
        )
    if meta["log_sha256"] != log_sha256:
        raise CollauditError(
            "the signals are of another log than audit.json beside them",
            where=str(path),
            found=f"log sha256 {meta['log_sha256']}",
            expected=f"log sha256 {log_sha256}",
            hint="make the run again with collaudit detect",
        )
    return meta


def column_of(values: Values) -> pa.Array:
    """An Arrow array over the memory of (n,) numbers; NaN stays NaN and is not null."""
    values = np.ascontiguousarray(values)
    return pa.Array.from_buffers(pa.from_numpy_dtype(values.dtype), len(values), [None, pa.py_buffer(values)])


def values_of(column: pa.ChunkedArray) -> Values:
    """(n,) numbers of an Arrow column, in memory of their own.

    Raises:
        KeyError: it holds no numbers.
    """
    kind = _KINDS[column.type]
    if column.null_count:
        return np.asarray(column.to_numpy(), dtype=kind)
    parts = [
        np.frombuffer(chunk.buffers()[1], dtype=kind, count=len(chunk), offset=chunk.offset * kind.itemsize)
        for chunk in column.chunks
        if len(chunk)
    ]
    return np.concatenate(parts) if parts else np.empty(0, dtype=kind)
