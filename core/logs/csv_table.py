"""Reading the numeric columns of a CSV, fast through Arrow, with errors that name line and column."""

from __future__ import annotations

import io
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from collaudit.core.errors import LogError
from collaudit.core.logs.csv_stream import BoundedStream, decompression_errors
from collaudit.core.logs.csv_text import (
    COMMENT,
    NULLS,
    Dialect,
    is_iso,
    is_number,
    open_bytes,
    rows_as_text,
)
from collaudit.core.logs.sniff import compression_of, head_of
from collaudit.core.series import FloatArray, IntArray

_BLOCK = 1 << 20


@dataclass(frozen=True, slots=True, eq=False)
class CsvColumns:
    """Columns of one file.

    Attributes:
        values: name of a group to (n, c) numbers.
        stamps: the time column as an Arrow array of int64, float64, decimal or timestamp; None without.
        texts: index of a column to n texts.
        damage: where a compressed file could not be read to its end, or None.
    """

    values: dict[str, FloatArray]
    stamps: Any
    texts: dict[int, tuple[str, ...]]
    damage: str | None


def read_columns(
    path: Path, dialect: Dialect, groups: Mapping[str, Sequence[int]], time: int | None, texts: Sequence[int] = ()
) -> CsvColumns:
    """Read columns as numbers, and some as text.

    Args:
        path: the file.
        dialect: how it is written.
        groups: name to indices of columns of numbers.
        time: index of the time column, or None.
        texts: indices of columns of text.

    Raises:
        LogError: naming line and column, for a ragged row or a cell that is not a number.
    """
    import pyarrow as pa

    columns = [index for group in groups.values() for index in group]
    wanted = sorted({*columns, *([time] if time is not None else []), *texts})
    types: dict[str, Any] = {f"c{index}": pa.float64() for index in columns}
    types |= {f"c{index}": pa.string() for index in texts}
    attempts = _time_types(dialect.first[time]) if time is not None and time < len(dialect.first) else [None]
    for kind in attempts:
        if time is not None and kind is not None:
            types[f"c{time}"] = kind
        try:
            table, damage = _arrow(path, dialect, wanted, types)
            break
        except pa.ArrowInvalid as error:
            failure = error
    else:
        raise _located(path, dialect, [k for k in wanted if k not in texts], columns, time, failure)
    stamps = table.column(f"c{time}") if time is not None else None
    words = {index: tuple(text or "" for text in table.column(f"c{index}").to_pylist()) for index in texts}
    return CsvColumns(_matrices(table, groups), stamps, words, damage)


def _matrices(table: Any, groups: Mapping[str, Sequence[int]]) -> dict[str, FloatArray]:
    """Columns side by side, filled batch by batch while a batch is in the cache."""
    out = {name: np.empty((table.num_rows, len(indices))) for name, indices in groups.items()}
    start = 0
    for batch in table.to_batches():
        stop = start + batch.num_rows
        for name, indices in groups.items():
            for number, index in enumerate(indices):
                out[name][start:stop, number] = batch.column(f"c{index}").to_numpy(zero_copy_only=False)
        start = stop
    return out


def _time_types(first: str) -> list[Any]:
    import pyarrow as pa

    text = first.strip()
    if is_iso(text):
        zoned = re.search(r"(Z|[+-]\d{2}:?\d{2})$", text) is not None
        return [pa.timestamp("ns", "UTC") if zoned else pa.timestamp("ns")]
    if re.fullmatch(r"[+-]?\d+", text):
        return [pa.int64(), pa.decimal128(37, 12), pa.float64()]
    if re.fullmatch(r"\d{7,}[.,]\d+", text):
        return [pa.decimal128(37, 12), pa.float64()]
    return [pa.float64()]


def _arrow(path: Path, dialect: Dialect, wanted: Sequence[int], types: dict[str, Any]) -> tuple[Any, str | None]:
    """The table, and where a compressed file could not be read to its end."""
    from pyarrow import csv as pacsv

    names = [f"c{index}" for index in range(len(dialect.names))]
    source, skip, delimiter = _source(path, dialect)
    try:
        with source:
            table = pacsv.read_csv(
                source,
                read_options=pacsv.ReadOptions(
                    column_names=names,
                    skip_rows=skip,
                    block_size=_BLOCK,
                    encoding=dialect.encoding.removesuffix("-sig"),
                ),
                parse_options=pacsv.ParseOptions(delimiter=delimiter, invalid_row_handler=_comment_or_error),
                convert_options=pacsv.ConvertOptions(
                    include_columns=[f"c{index}" for index in wanted],
                    column_types=types,
                    decimal_point=dialect.decimal,
                    null_values=list(NULLS),
                ),
            )
            stream = getattr(source, "raw", None)
            return table, stream.damage if isinstance(stream, BoundedStream) else None
    except decompression_errors() as error:
        raise LogError(f"cannot be read to its end: {error}", where=str(path)) from error


def _comment_or_error(row: Any) -> str:
    return "skip" if str(row.text).lstrip().startswith(COMMENT) else "error"


def _source(path: Path, dialect: Dialect) -> tuple[Any, int, str]:
    """A byte source for Arrow, the rows it must skip, and the delimiter; white space becomes commas."""
    import pyarrow as pa

    if dialect.delimiter == " ":
        rows = (",".join(cells) for _, cells in rows_as_text(path, dialect))
        return io.BytesIO("\n".join(rows).encode()), 0, ","
    if compression_of(head_of(path, 8)) is None:
        return pa.OSFile(str(path)), dialect.skip, dialect.delimiter
    return open_bytes(path), dialect.skip, dialect.delimiter


def _located(
    path: Path, dialect: Dialect, wanted: Sequence[int], columns: Sequence[int], time: int | None, error: Exception
) -> LogError:
    """Find the first cell that is not what it should be, and name its line and column."""
    width = len(dialect.names)
    numeric = set(columns)
    for line, cells in rows_as_text(path, dialect):
        where = f"{path}, line {line}"
        if len(cells) != width:
            return LogError(
                "the row has another number of cells than the columns",
                where=where,
                found=f"{len(cells)} cells",
                expected=f"{width}",
            )
        for index in wanted:
            cell = cells[index].strip()
            if cell in NULLS and index in numeric:
                continue
            fine = is_number(cell, dialect.decimal) or (index == time and is_iso(cell))
            if not fine:
                name = dialect.names[index] if dialect.header else f"number {index + 1}"
                return LogError(f"the cell in column {name!r} is not a number", where=where, found=repr(cell[:60]))
    return LogError("cannot be read as a table of numbers", where=str(path), found=str(error)[:200])


def stamps_ns(stamps: Any, unit: str) -> tuple[FloatArray, int | None, str]:
    """Seconds from the first stamp, the absolute start in ns when it is one, and the unit used.

    Args:
        stamps: the time column as Arrow read it.
        unit: ``auto``, ``s``, ``ms``, ``us``, ``ns`` or ``iso``.
    """
    import pyarrow as pa
    import pyarrow.compute as pc

    kind = stamps.type
    if pa.types.is_timestamp(kind):
        ns = stamps.cast(pa.int64()).to_numpy(zero_copy_only=False)
        return _since_first(np.asarray(ns), 1), _first(ns), "iso"
    numbers = np.asarray(stamps.cast(pa.float64(), safe=False).to_numpy(), dtype=np.float64)
    size = float(np.nanmax(np.abs(numbers))) if numbers.size and np.isfinite(numbers).any() else 0.0
    used = unit if unit not in ("auto", "iso") else guess_time_unit(size)
    scale = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}[used]
    first = stamps[0].as_py() if len(stamps) else None
    start = None
    if first is not None:
        start_ns = round(float(first) * 1e9 / scale) if scale != 1e9 else int(first)
        start = start_ns
    if pa.types.is_integer(kind) and stamps.null_count == 0:
        return _since_first(np.asarray(stamps.to_numpy(), dtype=np.int64), int(1e9 / scale)), start, used
    if pa.types.is_decimal(kind) and stamps.null_count == 0:
        shifted = pc.subtract(stamps, stamps[0])
        return np.asarray(shifted.cast(pa.float64(), safe=False).to_numpy(), dtype=np.float64) / scale, start, used
    return (numbers - numbers[0]) / scale if numbers.size else numbers, start, used


def _since_first(values: IntArray, ns_per_unit: int) -> FloatArray:
    if values.shape[0] == 0:
        return values.astype(np.float64)
    out: FloatArray = (values - values[0]).astype(np.float64) * ns_per_unit / 1e9
    return out


def _first(values: Any) -> int | None:
    return int(values[0]) if len(values) else None


def guess_time_unit(size: float) -> str:
    """The unit of stamps as large as ``size``, taken as seconds since the epoch or as a short time in seconds."""
    for unit, floor in (("ns", 1e17), ("us", 1e14), ("ms", 1e11)):
        if size >= floor:
            return unit
    return "s"
