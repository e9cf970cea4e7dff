"""NumPy archives (.npz) and single arrays (.npy) as tables."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from collaudit.core.config.schema import CsvConfig
from collaudit.core.errors import LogError
from collaudit.core.logs.column_files.array_columns import columns_of
from collaudit.core.logs.column_files.named_columns import NamedColumns
from collaudit.core.logs.storage.file_reading import plausible_table


def open_npz(path: Path, settings: CsvConfig) -> NamedColumns:
    """Open an archive of arrays; pickled objects in it are never loaded.

    Raises:
        LogError: it cannot be read, or decompresses into more than its size allows.
    """
    arrays: dict[str, Any] = {}
    try:
        with zipfile.ZipFile(path) as archive:
            claimed = sum(item.file_size for item in archive.infolist())
        if not plausible_table(path.stat().st_size, claimed):
            raise LogError("decompresses into more than its size allows", where=str(path), found=f"{claimed} bytes")
        with np.load(path, allow_pickle=False) as loaded:
            for name in loaded.files:
                try:
                    value = loaded[name]
                except ValueError:  # objects: loading them may run any code
                    continue
                fields = value.dtype.names
                arrays |= {name: value} if fields is None else {f"{name}.{field}": value[field] for field in fields}
    except LogError:
        raise
    except Exception as error:  # NumPy, zipfile and zlib raise what the damage happens to cause
        raise LogError(f"cannot be read as a NumPy archive: {str(error)[:200]}", where=str(path)) from error
    columns, left_out = columns_of(arrays, path)
    return NamedColumns(path, "npz", f"NumPy archive, {len(columns)} columns", columns, left_out=left_out)


def open_npy(path: Path, settings: CsvConfig) -> NamedColumns:
    """Open one array: a matrix whose columns (or rows, where there are fewer of these) are numbered from 1, or records.

    Raises:
        LogError: it cannot be read, or is no matrix of numbers.
    """
    try:
        array = np.load(path, mmap_mode="r", allow_pickle=False)  # mapped: a header may claim more than there is
    except Exception as error:  # NumPy raises what the damage happens to cause
        raise LogError(f"cannot be read as a NumPy array: {str(error)[:200]}", where=str(path)) from error
    fields = array.dtype.names
    columns, _ = columns_of({"": array} if fields is None else {name: array[name] for name in fields}, path)
    return NamedColumns(path, "npy", f"NumPy array, {len(columns)} columns", columns, named=fields is not None)
