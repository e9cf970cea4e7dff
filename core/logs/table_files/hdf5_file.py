"""HDF5 files as tables, such as data sets of teleoperation: groups of arrays, one row a sample."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from collaudit.core.errors import LogError
from collaudit.core.logs.storage.file_content import python_line, quoted
from collaudit.core.logs.storage.readers import arrow_of
from collaudit.core.logs.storage.reading_bounds import plausible_table
from collaudit.core.logs.table_files.named_columns import NamedColumns, columns_of, fields_of, read_as

#: An array below a group that is one recording of several, such as ``demo_3`` or ``episode_000012``.
_IN_EPISODE = re.compile(
    r"(?:(?P<above>.*?)\.)?(?P<group>(?:demo|episode|ep|traj|trajectory|rollout|run|trial|session|recording|experiment)"
    r"[_-]?(?P<number>\d+))\.(?P<array>.+)",
    re.IGNORECASE,
)
#: The column that numbers the recordings of one file.
_RUN = "episode"


def open_hdf5(path: Path, settings: object) -> NamedColumns:
    """Open an HDF5 file: the array ``q`` of a group ``obs`` is called ``obs.q``.

    Recordings in groups of their own (``demo_0``, ``demo_1`` …) follow one another, numbered by a column ``episode``.

    Raises:
        LogError: it cannot be read, holds no columns, or needs a package that is not installed.
    """
    arrays: dict[str, Any] = {}
    for name, values in hdf5_arrays(path, "an HDF5 file").items():
        arrays |= fields_of(name, values)
    columns, left_out = _one_after_the_other(arrays, path) or columns_of(arrays, path)
    return NamedColumns(path, "hdf5", "HDF5", columns, left_out=left_out)


def hdf5_arrays(path: Path, title: str, hint: str = "") -> dict[str, Any]:
    """The arrays of an HDF5 file that may be columns: at most two dimensions longer than 1, of numbers or texts.

    Args:
        path: the file.
        title: of its format with its article, for messages.
        hint: what can be done besides where the package is missing.

    Returns:
        Names, with dots between groups, to arrays.

    Raises:
        LogError: it cannot be read, claims more than its size allows, keeps numbers elsewhere, or h5py is missing.
    """
    try:
        import h5py
    except ImportError as error:
        raise LogError(
            f"is {title}, which needs the package h5py",
            where=str(path),
            hint=f"install it: pip install 'collaudit[hdf5]'{hint}",
        ) from error
    found: dict[str, Any] = {}

    def visit(name: str, item: Any) -> None:
        if "pandas_type" in item.attrs:
            new = quoted(path.with_suffix(".csv"))
            code = f'import pandas; pandas.read_hdf({quoted(path)}, "{name}").to_csv({new})'
            text = "holds a table of pandas, which only pandas reads"
            raise LogError(text, where=str(path), found=name, hint=f"with pandas and tables: {python_line(code)}")
        if not isinstance(item, h5py.Dataset) or name.startswith("#") or sum(n > 1 for n in item.shape) > 2:
            return
        words = h5py.check_string_dtype(item.dtype) is not None
        if not (words or item.dtype.kind in "fiubV") or item.attrs.get("MATLAB_class") == b"char":
            return
        if item.is_virtual or item.external:
            raise LogError("keeps its numbers in other files, which are not read", where=str(path), found=name)
        if not plausible_table(path.stat().st_size, item.nbytes + sum(array.nbytes for array in found.values())):
            raise LogError("claims more rows than its size allows", where=str(path), found=f"{name} {item.shape}")
        dotted = name.replace("/", ".")
        if dotted in found:
            raise LogError("two arrays have the same name", where=str(path), found=dotted)
        found[dotted] = np.asarray(item.asstr()[()]).astype(str) if words else item[()]

    with read_as(title, path), h5py.File(path, "r") as file:
        file.visititems(visit)
    return found


def _one_after_the_other(arrays: Mapping[str, Any], path: Path) -> tuple[dict[str, Any], tuple[str, ...]] | None:
    """Columns of all recordings, by the names that they have within each; None where there are no recordings.

    What only some of them have is missing in the others.

    Returns:
        The columns, and what is left out: recordings without rows, and arrays of no recording.

    Raises:
        LogError: no recording has rows.
    """
    recordings: dict[tuple[str, int, str], dict[str, Any]] = {}
    left_out: list[str] = []
    for name, values in arrays.items():
        found = _IN_EPISODE.fullmatch(name)
        if found is None:
            left_out.append(f"{name} {values.shape}")
            continue
        recording = found["above"] or "", int(found["number"]), found["group"]
        recordings.setdefault(recording, {})[found["array"]] = values
    if not recordings:
        return None
    tables: list[Any] = []
    for (above, _, group), held in sorted(recordings.items()):
        try:
            columns, other = columns_of(held, path)
        except LogError as error:
            left_out.append(f"{above}.{group} (no rows)".lstrip("."))
            failure = error
            continue
        left_out += [f"{group}.{array}" for array in other]
        rows = len(next(iter(columns.values())))
        tables.append(pa.table({**columns, _RUN: arrow_of(np.full(rows, len(tables)))}))
    if not tables:
        raise failure
    with read_as("runs of one table", path):
        joined = pa.concat_tables(tables, promote_options="permissive")
    return dict(zip(joined.column_names, joined.columns, strict=True)), tuple(left_out)
