"""The layout of ``signals.parquet``: its columns, its version, and what is said of a file that breaks it."""

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
WRENCH = tuple(f"wrench:{axis}" for axis in ("fx", "fy", "fz", "mx", "my", "mz"))


def open_file(path: Path) -> pq.ParquetFile:
    """The file, nothing of it read yet.

    Raises:
        CollauditError: no such file, or not Parquet.
    """
    try:
        return pq.ParquetFile(path, memory_map=False, pre_buffer=False)
    except FileNotFoundError as error:
        raise CollauditError("no such file", where=str(path)) from error
    except (pa.ArrowException, OSError) as error:
        raise unreadable(path, error) from error


def unreadable(path: Path, error: Exception) -> CollauditError:
    """The error for a file that is damaged or no Parquet."""
    return CollauditError(
        "cannot read the signals",
        where=str(path),
        found=(str(error).splitlines() or [""])[0][:200],
        expected="a Parquet file written by collaudit",
        hint="make the run again with collaudit detect",
    )


def checked_meta(schema: pa.Schema, path: Path, log_sha256: str) -> dict[str, Any]:
    """The metadata of collaudit in a file.

    Raises:
        CollauditError: there are none, of another version, or of another log.
    """
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
    return meta


def checked_states(state: np.ndarray[Any, Any], path: Path) -> np.ndarray[Any, Any]:
    """The state codes as they are.

    Raises:
        CollauditError: one is unknown to this version.
    """
    known = max(State)
    if state.size and not (int(state.min()) >= 0 and int(state.max()) <= known):
        raise CollauditError("a state code is unknown", where=str(path), expected=f"0 to {int(known)}")
    return state
