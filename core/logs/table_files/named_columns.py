"""A table of columns in memory, whatever file they came from; of arrays, as NumPy keeps them (.npz, .npy)."""

from __future__ import annotations

import zipfile
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from collaudit.core.errors import LogError
from collaudit.core.logs.storage.file_content import head_of
from collaudit.core.logs.storage.readers import TableColumns, arrow_of, numbers_of
from collaudit.core.logs.storage.reading_bounds import plausible_table
from collaudit.core.numeric.arrays import FloatArray

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
    with read_as(f"a {title}", path):  # mapped: a header may claim more than there is
        arrays = _archived(path) if kind == "npz" else fields_of("", np.load(path, mmap_mode="r", allow_pickle=False))
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


#: Cells that are compared to tell whether tables were written from one recording.
_FIRST_ROWS = 50


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
