"""The time column of a table as seconds."""

from __future__ import annotations

from typing import Any

import numpy as np

from collaudit.core.logs.storage.table_reader import numbers_of
from collaudit.core.numeric.arrays import FloatArray, IntArray

#: Later stamps are no times since the epoch, but garbage.
_MOST_NS = 9e18


def seconds_of(stamps: Any, unit: str) -> tuple[FloatArray, int | None, str]:
    """Seconds from the first stamp that is a number, its absolute time in ns, None without, and the unit used.

    Args:
        stamps: the time column as Arrow read it.
        unit: ``auto``, ``s``, ``ms``, ``us``, ``ns`` or ``iso``.
    """
    import pyarrow as pa
    import pyarrow.compute as pc

    kind = stamps.type
    if pa.types.is_timestamp(kind):
        ns = stamps.cast(pa.int64()).to_numpy(zero_copy_only=False)
        return _since_first(np.asarray(ns), 1), _first(ns), "iso"
    if len(stamps) == 0:
        return np.empty(0), None, "s"
    whole = stamps.combine_chunks() if isinstance(stamps, pa.ChunkedArray) else stamps
    numbers = numbers_of(whole)
    known = np.flatnonzero(np.isfinite(numbers))
    size = float(np.abs(numbers[known]).max()) if known.size else 0.0
    used = unit if unit not in ("auto", "iso") else guess_time_unit(size)
    scale = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}[used]
    if not known.size:
        return np.full(numbers.shape, np.nan), None, used
    first = stamps[int(known[0])].as_py()
    exact = abs(float(first)) * 1e9 / scale < _MOST_NS
    start = None if not exact else round(float(first) * 1e9 / scale) if scale != 1e9 else int(first)
    if pa.types.is_integer(kind) and stamps.null_count == 0:
        return _since_first(np.asarray(stamps.to_numpy(), dtype=np.int64), int(1e9 / scale)), start, used
    if pa.types.is_decimal(kind) and stamps.null_count == 0:
        shifted = pc.subtract(stamps, stamps[0])
        return np.asarray(shifted.cast(pa.float64(), safe=False).to_numpy(), dtype=np.float64) / scale, start, used
    return (numbers - numbers[known[0]]) / scale, start, used


def _since_first(values: IntArray, ns_per_unit: int) -> FloatArray:
    if values.shape[0] == 0:
        return values.astype(np.float64)
    out: FloatArray = (values - values[0]).astype(np.float64) * ns_per_unit / 1e9
    return out


def _first(values: Any) -> int | None:
    return int(values[0]) if len(values) else None


def guess_time_unit(size: float) -> str:
    """The unit of stamps as large as ``size``, taken as seconds since the epoch or as a short time in seconds."""
    for unit, floor in (("ns", 1e17), ("us", 1e14), ("ms", 1e11)):
        if size >= floor:
            return unit
    return "s"
