"""NumPy archives (.npz) and single arrays (.npy) as tables; arrays as columns, which `.mat` files hold, too."""

from __future__ import annotations

import zipfile
from collections import Counter
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from collaudit.core.errors import LogError
from collaudit.core.logs.column_files.named_columns import NamedColumns
from collaudit.core.logs.storage.file_content import head_of
from collaudit.core.logs.storage.reading_bounds import plausible_table
from collaudit.core.logs.storage.table_reader import arrow_of

_ARCHIVE = b"PK"
#: Fewer values in a row than these are no signal but a setting.
_ROWS = 4


def open_numpy(path: Path, settings: object) -> NamedColumns:
    """Open an archive of arrays, or one array: records, or a matrix whose columns are numbered from 1.

    Of a matrix the rows are numbered where there are fewer of these. Pickled objects are never loaded.

    Raises:
        LogError: it cannot be read, decompresses into more than its size allows, or holds no columns.
    """
    kind, title = ("npz", "NumPy archive") if head_of(path, len(_ARCHIVE)) == _ARCHIVE else ("npy", "NumPy array")
    try:
        # mapped: a header may claim more than there is
        arrays = _archived(path) if kind == "npz" else fields_of("", np.load(path, mmap_mode="r", allow_pickle=False))
    except LogError:
        raise
    except Exception as error:  # NumPy, zipfile and zlib raise what the damage happens to cause
        raise LogError(f"cannot be read as a {title}: {str(error)[:200]}", where=str(path)) from error
    columns, left_out = columns_of(arrays, path)
    return NamedColumns(path, kind, title, columns, left_out=left_out, named="" not in arrays)


def _archived(path: Path) -> dict[str, Any]:
    with zipfile.ZipFile(path) as archive:
        claimed = sum(item.file_size for item in archive.infolist())
    if not plausible_table(path.stat().st_size, claimed):
        raise LogError("decompresses into more than its size allows", where=str(path), found=f"{claimed} bytes")
    arrays: dict[str, Any] = {}
    with np.load(path, allow_pickle=False) as loaded:
        for name in loaded.files:
            with suppress(ValueError):  # objects: loading them may run any code
                arrays |= fields_of(name, loaded[name])
    return arrays


def fields_of(name: str, array: Any) -> dict[str, Any]:
    """An array, or the arrays of its fields."""
    if array.dtype.names is None:
        return {name: array}
    return {f"{name}.{field}".lstrip("."): array[field] for field in array.dtype.names}


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
    kept = {name: np.squeeze(value) for name, value in arrays.items() if np.asarray(value).dtype.kind in "fiubUSM"}
    kept = _without_common(kept)
    rows = _rows({name: value for name, value in kept.items() if value.ndim in (1, 2)}, path)
    columns: dict[str, Any] = {}
    left_out = []
    for name, value in kept.items():
        if value.ndim == 1 and value.shape[0] == rows:
            columns[name] = _arrow(value)
        elif value.ndim == 2 and rows in value.shape:
            upright = value if value.shape[0] == rows else value.T
            numbers = range(1, upright.shape[1] + 1)
            taken = name[-1:].isdigit() or any(f"{name}{k}" in kept for k in numbers)
            between = "_" if taken else ""
            for k in numbers:
                columns[f"{name}{between}{k}"] = _arrow(upright[:, k - 1])
        elif value.dtype.kind in "fiub" and max(value.shape, default=0) * 2 >= rows:
            left_out.append(f"{name} {' x '.join(map(str, value.shape))}")
    return columns, tuple(left_out)


def _without_common(arrays: dict[str, Any]) -> dict[str, Any]:
    """Names without the name of the one struct that they are all fields of."""
    first = {name.partition(".")[0] for name in arrays if "." in name}
    if len(first) != 1 or not all("." in name for name in arrays):
        return arrays
    return _without_common({name.partition(".")[2]: value for name, value in arrays.items()})


def _arrow(values: Any) -> Any:
    """Values (n,) as an Arrow array of a type that Arrow has."""
    if values.dtype.kind in "fiub":
        wide = values.dtype.kind == "f" and values.dtype.itemsize > np.dtype(np.float64).itemsize
        return arrow_of(values.astype(np.float64 if wide else values.dtype.newbyteorder("=")))
    if values.dtype.kind == "M":
        return pa.array(values.astype("datetime64[ns]"))
    words = [str(value.decode(errors="replace") if isinstance(value, bytes) else value) for value in values.tolist()]
    return pa.array(words)


def _rows(arrays: Mapping[str, Any], path: Path) -> int:
    """How many rows the table has: the longer side of most arrays; there are fewer joints than samples."""
    lengths = Counter(max(value.shape) for value in arrays.values() if max(value.shape) >= _ROWS)
    best = lengths.most_common()
    if not best:
        held = ", ".join(f"{name} {value.shape}" for name, value in list(arrays.items())[:12]) or "no arrays of numbers"
        raise LogError("the file holds no arrays that are columns of a table", where=str(path), found=held)
    return max(int(size) for size, count in best if count == best[0][1])
