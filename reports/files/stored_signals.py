"""The signals of a run, read from ``signals.parquet`` joint by joint when they are drawn."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, cast

import numpy as np

from collaudit.core.numeric.arrays import FloatArray
from collaudit.reports.files.signals_layout import WIDE, WRENCH, SignalsColumns
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
