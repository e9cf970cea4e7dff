"""Parquet, Feather and Arrow files, and JSON lines (one object a line is one row), as tables."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import IO, Any

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
from pyarrow import feather
from pyarrow import json as arrow_json

from collaudit.core.errors import LogError
from collaudit.core.logs.storage.file_content import head_of
from collaudit.core.logs.storage.reading_bounds import plausible_table
from collaudit.core.logs.table_files.named_columns import NamedColumns, read_as

_PARQUET = b"PAR1"
#: Bytes of a number, to tell how large columns become.
_NUMBER = 8
#: What the columns of collaudit's own ``signals.parquet`` hold.
_SIGNALS = {
    "time": "time_s",
    "position": "position_rad:{joint}",
    "velocity": "velocity_rad_s:{joint}",
    "effort": "measured_nm:{joint}",
}


def open_arrow(path: Path, settings: object) -> NamedColumns:
    """Open a Parquet or Feather file (version 2, which is an Arrow file).

    Raises:
        LogError: it cannot be read, or claims more rows than its size allows.
    """
    title, read = ("Parquet", _parquet) if head_of(path, len(_PARQUET)) == _PARQUET else ("Feather", _feather)
    with read_as(title, path), path.open("rb") as file:  # Arrow opens no name that is not UTF-8
        table = read(file, path.stat().st_size)
        table.validate(full=True)  # a file that lies about its offsets would be read beyond its end
    columns = columns_of_table(table, path)
    try:
        own = json.loads((table.schema.metadata or {}).get(b"collaudit", b"{}"))
    except (ValueError, RecursionError):  # another program's
        own = None
    signals = isinstance(own, dict) and "time_s" in columns and any(n.startswith("measured_nm:") for n in columns)
    return NamedColumns(path, title.lower(), title, columns, _SIGNALS if signals else None)


def columns_of_table(table: Any, path: Path) -> dict[str, Any]:
    """The columns of an Arrow table by name: fields of structs behind a dot, elements of lists by number.

    Raises:
        LogError: two columns have the same name.
    """
    while any(pa.types.is_struct(held) for held in table.schema.types):
        table = table.flatten()
    columns: dict[str, Any] = {}
    for name, column in zip(table.column_names, table.columns, strict=True):
        found = _of_lists(name, column) if _is_list(column.type) else {_index_name(name, column.type): column}
        if twice := found.keys() & columns.keys():
            raise LogError("two columns have the same name", where=str(path), found=", ".join(sorted(twice)))
        columns |= found
    return columns


def _feather(stream: IO[bytes], _size: int) -> Any:
    return feather.read_table(stream)


def _parquet(stream: IO[bytes], size: int) -> Any:
    with pq.ParquetFile(stream) as file:
        rows, columns = int(file.metadata.num_rows), int(file.metadata.num_columns)
        if not plausible_table(size, rows * columns * _NUMBER):
            raise LogError(
                "claims more rows than its size allows",
                where=stream.name,
                found=f"{rows} rows of {columns} columns",
                hint="if the log is genuine, write it with fewer columns, or as CSV",
            )
        return file.read()


def _index_name(name: str, kind: Any) -> str:
    """The time of a pandas index without a name of its own is called so."""
    times = pa.types.is_timestamp(kind) or pa.types.is_duration(kind)
    return "time" if times and name.startswith("__index_level_") else name


def _is_list(kind: Any) -> bool:
    return bool(pa.types.is_list(kind) or pa.types.is_large_list(kind) or pa.types.is_fixed_size_list(kind))


def _of_lists(name: str, column: Any) -> dict[str, Any]:
    """Columns ``name1``, ``name2`` … of lists that are all equally long; none where they are not."""
    widths = pc.unique(pc.list_value_length(column)).to_pylist()
    if len(widths) != 1:
        return {}
    return {f"{name}{k + 1}": pc.list_element(column, k) for k in range(widths[0] or 0)}


def open_json_lines(path: Path, settings: object) -> NamedColumns:
    """Open a file of JSON lines: objects in objects become ``header.stamp``, lists ``position1``, ``position2`` …

    A last line that was cut is left out.

    Raises:
        LogError: a line is no object, or a key holds values of different types.
    """
    data = path.read_bytes().removeprefix(b"\xef\xbb\xbf")
    whole, _, last = data.rpartition(b"\n")
    damage = None
    try:
        json.loads(last or b"{}")
    except ValueError:
        data, damage = whole + b"\n", "its last line ends in the middle and was left out"
    options = arrow_json.ReadOptions(use_threads=False, block_size=max(len(data), 1))  # types hold for the whole file
    with read_as("JSON lines", path):
        columns = columns_of_table(arrow_json.read_json(io.BytesIO(data), options), path)
    read = NamedColumns(path, "jsonl", "JSON lines", columns)
    read.damage = damage
    return read
