"""``cycles.npz``: the residual of a log over the path of its program, for the store of nights."""

from __future__ import annotations

import io

import numpy as np

from collaudit.core.data.cycles_result import CycleReference
from collaudit.core.errors import CollauditError

CYCLES_NAME = "cycles.npz"
_ARRAYS = ("position_rad", "share", "speed", "median_nm", "spread_nm")


def reference_bytes(reference: CycleReference) -> bytes:
    """The file's content: arrays in 32 bits, version and joints as text."""
    arrays = {name: getattr(reference, name).astype(np.float32) for name in _ARRAYS}
    buffer = io.BytesIO()
    texts = {"version": np.array(reference.version), "joints": np.array(reference.joints)}
    np.savez_compressed(buffer, allow_pickle=False, cycles=np.array(reference.cycles), **texts, **arrays)
    return buffer.getvalue()


def read_reference(content: bytes, night: str, log: str) -> CycleReference:
    """What :func:`reference_bytes` wrote.

    Args:
        content: of the file.
        night, log: ISO date, and first digits of the log's hash.

    Raises:
        CollauditError: it cannot be read.
    """
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as file:
            arrays = {name: file[name].astype(np.float64) for name in _ARRAYS}
            joints = tuple(map(str, file["joints"]))
            return CycleReference(str(file["version"]), night, log, joints, cycles=int(file["cycles"]), **arrays)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise CollauditError("the cycles of an earlier night cannot be read", found=str(error)) from error
