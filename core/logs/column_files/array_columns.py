"""Named arrays as the columns of one table: what `.npz` and `.mat` files hold."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from collaudit.core.errors import LogError

#: Fewer values in a row than these are no signal but a setting.
_ROWS = 4


def columns_of(arrays: Mapping[str, Any], path: Path) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Columns of one length; a matrix of n rows and j columns becomes ``name1`` … ``namej``.

    Args:
        arrays: name to array. Those that have not as many rows as most others are settings, and left out; a matrix
            may lie on its side.
        path: the file, for messages.

    Returns:
        The columns, and the arrays of numbers that are left out because of their length, each with its shape.

    Raises:
        LogError: no array has rows.
    """
    import pyarrow as pa

    kept = {name: np.squeeze(value) for name, value in arrays.items() if np.asarray(value).dtype.kind in "fiubUSM"}
    kept = _without_common(kept)
    rows = _rows({name: value for name, value in kept.items() if value.ndim in (1, 2)}, path)
    columns: dict[str, Any] = {}
    left_out = []
    for name, value in kept.items():
        if value.ndim == 1 and value.shape[0] == rows:
            columns[name] = pa.array(_plain(value))
        elif value.ndim == 2 and rows in value.shape:
            upright = value if value.shape[0] == rows else value.T
            between = "_" if name[-1:].isdigit() else ""
            for k in range(upright.shape[1]):
                columns[f"{name}{between}{k + 1}"] = pa.array(_plain(np.ascontiguousarray(upright[:, k])))
        elif value.dtype.kind in "fiub" and max(value.shape, default=0) * 2 >= rows:
            left_out.append(f"{name} {' x '.join(map(str, value.shape))}")
    return columns, tuple(left_out)


def _without_common(arrays: dict[str, Any]) -> dict[str, Any]:
    """Names without the name of the one struct that they are all fields of."""
    first = {name.partition(".")[0] for name in arrays if "." in name}
    if len(first) != 1 or not all("." in name for name in arrays):
        return arrays
    return _without_common({name.partition(".")[2]: value for name, value in arrays.items()})


def _plain(values: Any) -> Any:
    """Values in the byte order of this machine and of a type that Arrow has."""
    if values.dtype.kind in "fiub":
        wide = values.dtype.kind == "f" and values.dtype.itemsize > np.dtype(np.float64).itemsize
        return values.astype(np.float64 if wide else values.dtype.newbyteorder("="))
    if values.dtype.kind == "M":
        return values.astype("datetime64[ns]")
    return [str(value.decode(errors="replace") if isinstance(value, bytes) else value) for value in values.tolist()]


def _rows(arrays: Mapping[str, Any], path: Path) -> int:
    """How many rows the table has: the longer side of most arrays; there are fewer joints than samples."""
    lengths = Counter(max(value.shape) for value in arrays.values() if max(value.shape) >= _ROWS)
    best = lengths.most_common()
    if not best:
        held = ", ".join(f"{name} {value.shape}" for name, value in list(arrays.items())[:12]) or "no arrays of numbers"
        raise LogError("the file holds no arrays that are columns of a table", where=str(path), found=held)
    return max(int(size) for size, count in best if count == best[0][1])
