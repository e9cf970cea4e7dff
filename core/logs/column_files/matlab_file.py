"""MATLAB files as tables: version 5 by SciPy, version 7.3 (HDF5) by h5py."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from collaudit.core.config.schema import CsvConfig
from collaudit.core.errors import LogError
from collaudit.core.logs.column_files.array_columns import columns_of
from collaudit.core.logs.column_files.matlab_elements import check_elements
from collaudit.core.logs.column_files.named_columns import NamedColumns
from collaudit.core.logs.storage.file_head import head_of

_HDF5 = b"MATLAB 7.3"
_HINT = (
    "tables, timetables and time series are objects that only MATLAB reads: write them as CSV there "
    "(writetable(T, 'log.csv')), or as plain arrays (S = table2struct(T, 'ToScalar', true); save('log.mat', '-struct', "
    "'S'))"
)


def open_mat(path: Path, settings: CsvConfig) -> NamedColumns:
    """Open a MATLAB file; the fields of a struct ``log`` become ``log.field``.

    Raises:
        LogError: it cannot be read, holds no columns, or needs a package that is not installed.
    """
    modern = head_of(path, len(_HDF5)) == _HDF5
    arrays = dict(_from_hdf5(path) if modern else _from_version_5(path))
    try:
        columns, left_out = columns_of(arrays, path)
    except LogError as error:
        raise LogError(error.message, where=str(path), found=error.found, hint=_HINT) from error
    version = "7.3" if modern else "5"
    return NamedColumns(path, f"mat-{version}", f"MATLAB {version}, {len(columns)} columns", columns, left_out=left_out)


def _from_version_5(path: Path) -> Iterator[tuple[str, Any]]:
    from scipy.io import loadmat

    check_elements(path)
    try:
        held = loadmat(path, squeeze_me=True, struct_as_record=False)
    except Exception as error:  # SciPy raises what the damage happens to cause
        raise LogError(f"cannot be read as a MATLAB file: {str(error)[:200]}", where=str(path)) from error
    for name, value in held.items():
        if not name.startswith("__"):
            yield from _fields(name, value)


def _fields(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    names = getattr(value, "_fieldnames", None)
    if names is not None:
        for field in names:
            yield from _fields(f"{name}.{field}", getattr(value, field))
    elif isinstance(value, np.ndarray) and value.dtype.names is None:
        yield name, value


def _from_hdf5(path: Path) -> list[tuple[str, Any]]:
    try:
        import h5py
    except ImportError as error:
        raise LogError(
            "is a MATLAB 7.3 file, which needs the package h5py",
            where=str(path),
            hint="install it: pip install 'collaudit[mat73]'; or save the file in MATLAB with save(…, '-v7')",
        ) from error
    found: list[tuple[str, Any]] = []

    def visit(name: str, item: Any) -> None:
        numbers = isinstance(item, h5py.Dataset) and item.dtype.kind in "fiub" and not name.startswith("#")
        if numbers and item.attrs.get("MATLAB_class", b"double") != b"char":
            found.append((name.replace("/", "."), item[()]))

    try:
        with h5py.File(path) as file:
            file.visititems(visit)
    except Exception as error:  # h5py raises what the damage happens to cause
        raise LogError(f"cannot be read as a MATLAB 7.3 file: {str(error)[:200]}", where=str(path)) from error
    return found
