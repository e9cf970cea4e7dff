"""Fits of equal logs with equal settings are made once a test run: a fit takes seconds, and many commands want one."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence, Set
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from msgspec import Struct

from collaudit.core import fitting
from collaudit.core.config.schema import Config
from collaudit.core.data.audit_result import FrictionFile, Provenance
from collaudit.core.logs.log_reading import Hashing
from collaudit.core.numeric.parallel import Progress
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.robot.robot_model import RobotModel
from collaudit.core.scoring.detection_score import TruthFile


def share_fits(monkeypatch: pytest.MonkeyPatch, once: Callable[..., Any]) -> None:
    """Let the commands of a test take a fit of the very same numbers that another test has asked for."""
    fit_logs = fitting.fit_logs

    def fitted(
        prepared: Sequence[Prepared],
        config: Config,
        provenance: Provenance,
        truth: Sequence[TruthFile | None] = (),
        progress: Progress | None = None,
    ) -> FrictionFile:
        def made(_: Path) -> FrictionFile:
            return fit_logs(prepared, config, provenance, truth, progress)

        found: FrictionFile = once(("fit", _digest([*prepared, config, provenance, truth])), made)
        return found

    monkeypatch.setattr(fitting, "fit_logs", fitted)


def _digest(value: object) -> str:
    """Of all numbers and words in a value, however deep."""
    out = hashlib.sha256()
    _add(value, out)
    return out.hexdigest()


def _add(value: Any, out: Any) -> None:
    if isinstance(value, np.ndarray):
        out.update(f"{value.dtype} {value.shape}".encode() + np.ascontiguousarray(value).tobytes())
    elif isinstance(value, RobotModel):
        _add([value.sha256, value.joint_names, value.gravity_base_m_s2, value.tool], out)
    elif isinstance(value, Hashing):
        _add(value.result(), out)
    elif is_dataclass(value) and not isinstance(value, type):
        for field in fields(value):
            _add(getattr(value, field.name), out)
    elif isinstance(value, Mapping):
        _add([part for pair in value.items() for part in pair], out)
    elif isinstance(value, Sequence | Set) and not isinstance(value, str | bytes):
        out.update(f"[{len(value)}".encode())
        for part in value:
            _add(part, out)
    elif isinstance(value, str | bytes | int | float | np.generic | Path | Struct | None):
        out.update(f"{type(value).__name__} {value!r};".encode())
    else:
        raise TypeError(f"{type(value)} is not known to be told by what it shows")
