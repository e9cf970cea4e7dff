"""Tables of columns in memory, by name: of Parquet, Feather and Arrow files, of JSON lines, and of any named arrays."""

from __future__ import annotations

import io
import json
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
from pyarrow import feather
from pyarrow import json as arrow_json

from collaudit.core.errors import LogError
from collaudit.core.logs.storage.bounded_reading import plausible_table
from collaudit.core.logs.storage.file_content import head_of
from collaudit.core.logs.storage.readers import TableColumns, arrow_of, numbers_of
from collaudit.core.numeric.arrays import FloatArray

#: Fewer values in a row than these are no signal but a setting.
_ROWS = 4
#: Cells that are compared to tell whether tables were written from one recording.
_FIRST_ROWS = 50
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


class NamedColumns:
    """Columns by name (see :class:`collaudit.core.logs.storage.readers.TableReader`).

    Args:
        path: the file, for messages.
        kind: what results call the format.
        title: of the format, in words.
        columns: name to an Arrow array of n values, all of one length.
        stated: keys of ``[log.csv]`` that the file itself states.
        left_out: arrays of the file that are no columns because of their length, each with its shape.
        named: whether the names are the file's, and no numbers.

    Raises:
        LogError: there are no columns, or no rows.
    """

    damage: str | None = None
    notes: tuple[str, ...] = ()

    def __init__(
        self,
        path: Path,
        kind: str,
        title: str,
        columns: Mapping[str, Any],
        stated: Mapping[str, str] | None = None,
        left_out: tuple[str, ...] = (),
        named: bool = True,
    ) -> None:
        if not columns or not len(next(iter(columns.values()))):
            raise LogError("the file holds no rows of data", where=str(path), found=f"{len(columns)} columns")
        self.path, self.format, self.layout = path, kind, f"{title}, {len(columns)} columns"
        self.names = tuple(columns)
        self.stated: Mapping[str, str] = stated or {}
        self.left_out, self.named = left_out, named
        self._columns = list(columns.values())

    def first_cells(self, column: int) -> tuple[str, ...]:
        """The first values of a column, as text."""
        return tuple("" if value is None else str(value) for value in self._columns[column][:_FIRST_ROWS].to_pylist())

    def read(self, groups: Mapping[str, Sequence[int]], time: int | None, texts: Sequence[int] = ()) -> TableColumns:
        """Columns as numbers, and some as text.

        Args:
            groups: name to indices of columns of numbers.
            time: index of the time column, or None.
            texts: indices of columns of text.

        Raises:
            LogError: naming the column, for one that holds no numbers.
        """
        values = {name: self._matrix(indices) for name, indices in groups.items()}
        words = {index: tuple("" if v is None else str(v) for v in self._columns[index].to_pylist()) for index in texts}
        return TableColumns(values, None if time is None else self._stamps(time), words)

    def _matrix(self, indices: Sequence[int]) -> FloatArray:
        return np.asfortranarray(np.column_stack([self._numbers(index) for index in indices]))

    def _numbers(self, index: int) -> FloatArray:
        column = _whole(self._columns[index])
        try:
            return numbers_of(column.cast(pa.int8()) if pa.types.is_boolean(column.type) else column)
        except (pa.ArrowInvalid, pa.ArrowNotImplementedError, pa.ArrowTypeError) as error:
            raise LogError(
                f"column {self.names[index]!r} does not hold numbers", where=str(self.path), found=str(column.type)
            ) from error

    def _stamps(self, index: int) -> Any:
        """The time column as a reader hands it on: timestamps in ns, ISO texts as timestamps."""
        column = _whole(self._columns[index])
        kind = column.type
        try:
            if pa.types.is_timestamp(kind) or pa.types.is_date(kind):
                return column.cast(pa.timestamp("ns", tz=getattr(kind, "tz", None)))
            if pa.types.is_duration(kind):
                return arrow_of(numbers_of(column.cast(pa.duration("ns")).cast(pa.int64())) / 1e9)
            if pa.types.is_string(kind) or pa.types.is_large_string(kind):
                return column.cast(pa.timestamp("ns"))
            return column if pa.types.is_integer(kind) or pa.types.is_decimal(kind) else column.cast(pa.float64())
        except (pa.ArrowInvalid, pa.ArrowNotImplementedError) as error:
            text = f"the time column {self.names[index]!r} holds neither numbers nor times"
            raise LogError(text, where=str(self.path), found=f"{kind} ({str(error)[:120]})") from error


def _whole(column: Any) -> Any:
    """An Arrow array in one piece."""
    return column.combine_chunks() if isinstance(column, pa.ChunkedArray) else column


@contextmanager
def read_as(title: str, path: Path) -> Iterator[None]:
    """Say of a file that cannot be read what it was read as: libraries raise what the damage happens to cause.

    Raises:
        LogError: as raised within, or for whatever else was.
    """
    try:
        yield
    except LogError:
        raise
    except Exception as error:
        raise LogError(f"cannot be read as {title}: {str(error)[:200]}", where=str(path)) from error


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
