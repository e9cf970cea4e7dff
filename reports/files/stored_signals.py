"""The signals of a run, read from ``signals.parquet`` joint by joint when they are drawn."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, cast

import numpy as np
import pyarrow as pa

from collaudit.core.errors import CollauditError
from collaudit.core.numeric.arrays import FloatArray
from collaudit.reports.files.arrow_columns import values_of
from collaudit.reports.files.signals_layout import (
    RANGE,
    WIDE,
    WRENCH,
    checked_meta,
    checked_states,
    open_file,
    unreadable,
)
from collaudit.reports.plots.joint_trace import JointTrace, size

#: What a trace takes as it stands.
_TRACED = ("position_rad", "velocity_rad_s", "measured_nm", "least_nm", "most_nm")


class StoredSignals:
    """The signals of a run, read joint by joint when they are asked for."""

    def __init__(self, path: Path, log_sha256: str) -> None:
        """``path``: of the file; ``log_sha256``: hash of the log that ``audit.json`` names.

        Raises:
            CollauditError: as :func:`read_signals`.
        """
        self._path = path
        self._file = open_file(path)
        self._meta = checked_meta(self._file.schema_arrow, path, log_sha256)
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
        wanted = [name for name in (*WIDE, *RANGE) if f"{name}:{joint}" in known and name != "model_nm"]
        read = self._read([f"{name}:{joint}" for name in wanted])
        of = {name: read.get(f"{name}:{joint}") for name in (*WIDE, *RANGE)}
        for name in WIDE:
            if of[name] is None and name != "model_nm":
                raise CollauditError("a column is missing", where=str(self._path), expected=f"column {name}:{joint!r}")
        gamma = self._meta["gamma_nm"][column]
        return JointTrace(
            joint=joint,
            time_s=self._time_s,
            state=checked_states(cast(Any, of["state"]), self._path),
            gamma_nm=math.nan if gamma is None else gamma,
            residual_nm=cast(Any, of["residual_nm"]).astype(np.float64),
            **{name: cast(Any, of[name]) for name in _TRACED},
        )

    def force_n(self) -> tuple[FloatArray, FloatArray] | None:
        """Time and size of the force at the wrist sensor (n,); None without one."""
        if not set(WRENCH) <= set(self._file.schema_arrow.names):
            return None
        read = self._read(list(WRENCH[:3]))
        return self._time_s, size(np.stack([read[name] for name in WRENCH[:3]], axis=1))

    def _column(self, name: str) -> np.ndarray[Any, Any]:
        """One column by itself, so that little else is in memory meanwhile."""
        return values_of(self._file.read(columns=[name], use_threads=False).column(0))

    def _read(self, columns: list[str]) -> dict[str, np.ndarray[Any, Any]]:
        try:
            return {name: self._column(name) for name in columns}
        except (pa.ArrowException, OSError, KeyError) as error:
            raise unreadable(self._path, error) from error
