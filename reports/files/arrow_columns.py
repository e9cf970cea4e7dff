"""NumPy arrays as Arrow columns and back. ``pyarrow.array`` and type conversions import pandas, a third of a second."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyarrow as pa

Values = np.ndarray[Any, Any]


def column_of(values: Values) -> pa.Array:
    """An Arrow array over the memory of (n,) numbers; NaN stays NaN and is not null."""
    values = np.ascontiguousarray(values)
    return pa.Array.from_buffers(pa.from_numpy_dtype(values.dtype), len(values), [None, pa.py_buffer(values)])


def number_kind(kind: pa.DataType) -> np.dtype[Any]:
    """The NumPy type of an Arrow type of numbers.

    Raises:
        KeyError: it is none.
    """
    return _KINDS[kind]


_KINDS = {pa.from_numpy_dtype(kind): np.dtype(kind) for kind in (np.int8, np.int32, np.int64, np.float32, np.float64)}
