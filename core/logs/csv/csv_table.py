"""Reading the numeric columns of a CSV, fast through Arrow, with errors that name line and column."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from collaudit.core.errors import LogError
from collaudit.core.logs.csv.csv_fault import Fault, first_fault
from collaudit.core.logs.csv.csv_frame import read_plain, suits_pandas
from collaudit.core.logs.csv.csv_source import Mend, source_of
from collaudit.core.logs.csv.csv_stream import BoundedStream, LineStream, decompression_errors
from collaudit.core.logs.csv.csv_text import COMMENT, NULLS, Dialect, is_iso
from collaudit.core.numeric.arrays import FloatArray, IntArray

#: Bytes parsed at once: what fits a core's second-level cache beside its numbers.
_BLOCK = 3 << 18


@dataclass(frozen=True, slots=True, eq=False)
class CsvColumns:
    """Columns of one file.

    Attributes:
        values: name of a group to (n, c) numbers.
        stamps: the time column as an Arrow array of int64, float64, decimal or timestamp; None without.
        texts: index of a column to n texts.
        damage: where the file could not be read to its end, or None.
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
    try:
        table, damage = _attempts(path, dialect, wanted, types, time)
    except pa.ArrowInvalid as failure:
        fault = first_fault(path, dialect, [k for k in wanted if k not in texts], columns, time)
        try:
            table, damage = _mended(path, dialect, wanted, types, time, fault)
        except pa.ArrowInvalid:
            said = LogError("cannot be read as a table of numbers", where=str(path), found=str(failure)[:200])
            raise (said if fault is None else fault.error) from None
    stamps = table.column(f"c{time}") if time is not None else None
    words = {index: tuple(text or "" for text in table.column(f"c{index}").to_pylist()) for index in texts}
    return CsvColumns(_matrices(table, groups), stamps, words, damage)


def _attempts(
    path: Path,
    dialect: Dialect,
    wanted: Sequence[int],
    types: dict[str, Any],
    time: int | None,
    mend: Mend | None = None,
) -> tuple[Any, str | None]:
    """The table with the first type that its stamps fit.

    Raises:
        ArrowInvalid: they fit none, or another cell or row is not as it should be.
    """
    import pyarrow as pa

    kinds = _time_types(dialect.first[time]) if time is not None and time < len(dialect.first) else [None]
    owns = [types if kind is None else types | {f"c{time}": kind} for kind in kinds]
    failure: pa.ArrowInvalid | None = None
    for quotes in (False, True) if mend is None and _may_lack_quotes(dialect, wanted, types) else (True,):
        for own in owns:
            try:
                return _arrow(path, dialect, wanted, own, mend, quotes=quotes)
            except pa.ArrowInvalid as error:
                failure = error
                told = re.search(r"column #(\d+):", str(error))
                if told is not None and int(told[1]) != time:  # no other type of stamps would help
                    break
    assert failure is not None
    raise failure


def _may_lack_quotes(dialect: Dialect, wanted: Sequence[int], types: Mapping[str, Any]) -> bool:
    """Whether to try without looking for quotes, which takes a twentieth of the time.

    Every column must be read as a number: a quote anywhere is then no number, and asks for another reading.
    """
    import pyarrow as pa

    numbers = pa.string() not in types.values() and len(wanted) == len(dialect.names) and not suits_pandas(dialect)
    return numbers and not any('"' in cell for cell in dialect.first)


def _mended(
    path: Path, dialect: Dialect, wanted: Sequence[int], types: dict[str, Any], time: int | None, fault: Fault | None
) -> tuple[Any, str | None]:
    """The table without what is no row of it: comments with as many cells as it has columns, a last row cut short.

    Raises:
        ArrowInvalid: it cannot be read without them either.
        LogError: the fault is another one.
    """
    if fault is None:
        return _attempts(path, dialect, wanted, types, time, Mend())
    if fault.before is None:
        raise fault.error
    table, damage = _attempts(path, dialect, wanted, types, time, Mend(fault.line, fault.before))
    return table, damage or f"its last row, line {fault.line}, ends in the middle and was left out"


def _matrices(table: Any, groups: Mapping[str, Sequence[int]]) -> dict[str, FloatArray]:
    """Columns one after the other in memory: side by side (C order) takes three times as long.

    Arrow strings the pieces of all columns of a group together in one go, two groups at a time. Array by array, the
    4,000 calls of NumPy take as long again.
    """
    with ThreadPoolExecutor(2) as pool:
        return dict(zip(groups, pool.map(partial(_matrix, table), groups.values()), strict=True))


def _matrix(table: Any, indices: Sequence[int]) -> FloatArray:
    import pyarrow as pa

    pieces = [piece for index in indices for piece in table.column(f"c{index}").chunks]
    values = _numbers(pa.concat_arrays(pieces)) if pieces else np.empty(0)
    return values.reshape((table.num_rows, len(indices)), order="F")


def _numbers(column: Any) -> FloatArray:
    """An Arrow array as float64, NaN where missing; its own ``to_numpy`` imports pandas (0.2 s)."""
    import pyarrow as pa

    column = column.cast(pa.float64(), safe=False)  # a column of time may be asked for as numbers too
    whole = column.fill_null(float("nan")) if column.null_count else column
    values = np.frombuffer(whole.buffers()[1], dtype=np.float64, count=len(whole) + whole.offset)
    return np.asarray(values[whole.offset :])


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


def _arrow(
    path: Path,
    dialect: Dialect,
    wanted: Sequence[int],
    types: dict[str, Any],
    mend: Mend | None,
    *,
    quotes: bool = True,
) -> tuple[Any, str | None]:
    """The table, mended where asked for, and where a compressed file could not be read to its end.

    Args:
        quotes: whether cells may stand in quotes.
    """
    from pyarrow import csv as pacsv

    if mend is None and suits_pandas(dialect):
        table = read_plain(path, dialect, wanted, types)
        if table is not None:
            return table, None
    names = [f"c{index}" for index in range(len(dialect.names))]
    try:
        source, skip, delimiter, encoding = source_of(path, dialect, mend)
        with source:
            table = pacsv.read_csv(
                source,
                read_options=pacsv.ReadOptions(
                    column_names=names,
                    skip_rows=skip,
                    block_size=_BLOCK,
                    encoding=encoding,
                ),
                parse_options=pacsv.ParseOptions(
                    delimiter=delimiter, quote_char='"' if quotes else False, invalid_row_handler=_remark_or_error
                ),
                convert_options=pacsv.ConvertOptions(
                    include_columns=[f"c{index}" for index in wanted],
                    column_types=types,
                    decimal_point=dialect.decimal,
                    null_values=list(NULLS),
                ),
            )
            stream = getattr(source, "raw", None)
            return table, stream.damage if isinstance(stream, (BoundedStream, LineStream)) else None
    except decompression_errors() as error:
        raise LogError(f"cannot be read to its end: {error}", where=str(path)) from error


def _remark_or_error(row: Any) -> str:
    text = str(row.text).strip()
    return "skip" if not text or text.startswith(COMMENT) else "error"


def stamps_ns(stamps: Any, unit: str) -> tuple[FloatArray, int | None, str]:
    """Seconds from the first stamp that is a number, its absolute time in ns, None without, and the unit used.

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
    if len(stamps) == 0:
        return np.empty(0), None, "s"
    numbers = _numbers(stamps.cast(pa.float64(), safe=False).combine_chunks())
    known = np.flatnonzero(np.isfinite(numbers))
    size = float(np.abs(numbers[known]).max()) if known.size else 0.0
    used = unit if unit not in ("auto", "iso") else guess_time_unit(size)
    scale = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}[used]
    if not known.size:
        return np.full(numbers.shape, np.nan), None, used
    first = stamps[int(known[0])].as_py()
    start = round(float(first) * 1e9 / scale) if scale != 1e9 else int(first)
    if pa.types.is_integer(kind) and stamps.null_count == 0:
        return _since_first(np.asarray(stamps.to_numpy(), dtype=np.int64), int(1e9 / scale)), start, used
    if pa.types.is_decimal(kind) and stamps.null_count == 0:
        shifted = pc.subtract(stamps, stamps[0])
        return np.asarray(shifted.cast(pa.float64(), safe=False).to_numpy(), dtype=np.float64) / scale, start, used
    return (numbers - numbers[known[0]]) / scale, start, used


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
