"""NumPy arrays as Arrow columns and back. Arrow's own conversions both ways import pandas, a third of a second."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyarrow as pa

Values = np.ndarray[Any, Any]


def column_of(values: Values) -> pa.Array:
    """An Arrow array over the memory of (n,) numbers; NaN stays NaN and is not null."""
    values = np.ascontiguousarray(values)
    return pa.Array.from_buffers(pa.from_numpy_dtype(values.dtype), len(values), [None, pa.py_buffer(values)])


def values_of(column: pa.ChunkedArray) -> Values:
    """(n,) numbers of an Arrow column, in memory of their own.

    Raises:
        KeyError: it holds no numbers.
    """
    kind = number_kind(column.type)
    if column.null_count:
        return np.asarray(column.to_numpy(), dtype=kind)
    parts = [
        np.frombuffer(chunk.buffers()[1], dtype=kind, count=len(chunk), offset=chunk.offset * kind.itemsize)
        for chunk in column.chunks
        if len(chunk)
    ]
    return np.concatenate(parts) if parts else np.empty(0, dtype=kind)


def number_kind(kind: pa.DataType) -> np.dtype[Any]:
    """The NumPy type of an Arrow type of numbers.

    Raises:
        KeyError: it is none.
    """
    return _KINDS[kind]


_KINDS = {pa.from_numpy_dtype(kind): np.dtype(kind) for kind in (np.int8, np.int32, np.int64, np.float32, np.float64)}
