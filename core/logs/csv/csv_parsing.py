"""Parsing a CSV once, through Arrow, for whose single delimiters runs of blanks between cells are rewritten."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pyarrow as pa
from pyarrow import csv as arrow_csv
from pyarrow import enable_signal_handlers

from collaudit.core.errors import LogError
from collaudit.core.logs.csv.csv_text import COMMENT, NULLS, Dialect, damage_of, open_bytes, rows_as_text
from collaudit.core.logs.storage.decompression import DECOMPRESSION_ERRORS
from collaudit.core.logs.storage.file_head import compression_at

#: Bytes parsed at once: what fits a core's second-level cache beside its numbers.
_BLOCK = 3 << 18


def parse(path: Path, dialect: Dialect, wanted: Sequence[int], types: Mapping[str, Any]) -> tuple[Any, str | None]:
    """Parse a table as it lies in the file, with the types given.

    Args:
        path: the file.
        dialect: how it is written.
        wanted: indices of columns.
        types: the Arrow type of each column ``c{index}``.

    Returns:
        An Arrow table with columns ``c{index}``, and where a compressed file could not be read to its end.

    Raises:
        ArrowInvalid: a row or a cell is not as it should be.
        LogError: a compressed file cannot be read at all.
    """
    if dialect.delimiter == " " or dialect.encoding == "utf-16":
        return parse_rewritten(path, dialect, wanted, types)
    if compression_at(path) is not None:
        with open_bytes(path) as stream:
            try:
                return _read(stream, dialect, wanted, types), damage_of(stream)
            except DECOMPRESSION_ERRORS as error:
                raise LogError(f"cannot be read to its end: {error}", where=str(path)) from error
    with pa.OSFile(str(path)) as source:
        return _read(source, dialect, wanted, types), None


def parse_rewritten(
    path: Path, dialect: Dialect, wanted: Sequence[int], types: Mapping[str, Any], stop: int | None = None
) -> tuple[Any, str | None]:
    """Parse the rows of a table written anew: between commas, in UTF-8, without comments between them.

    Args:
        path, dialect, wanted, types: as of :func:`parse`, which also tells what is returned and raised.
        stop: number from 1 of the line that is left out with all that follows; None for none.
    """
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    try:
        with open_bytes(path) as raw:
            for line, cells in rows_as_text(path, raw, dialect):
                if stop is not None and line >= stop:
                    break
                if dialect.delimiter == " ":  # whose quotes, if any, stand in the cells
                    out.write(",".join(cells) + "\n")
                else:
                    writer.writerow(cells)
            damage = damage_of(raw)
    except DECOMPRESSION_ERRORS as error:
        raise LogError(f"cannot be read to its end: {error}", where=str(path)) from error
    rewritten = io.BytesIO(out.getvalue().encode("utf-8", "replace"))
    return _read(rewritten, replace(dialect, skip=0, delimiter=",", encoding="utf-8"), wanted, types), damage


def _read(source: Any, dialect: Dialect, wanted: Sequence[int], types: Mapping[str, Any]) -> Any:
    """Let Arrow read a table in this thread, with comments between the rows left out.

    Arrow's own threads go on after an error and can abort the process; its handler of Ctrl-C is a thread, too.
    """
    enable_signal_handlers(False)
    return arrow_csv.read_csv(
        source,
        read_options=arrow_csv.ReadOptions(
            column_names=[f"c{index}" for index in range(len(dialect.names))],
            skip_rows=dialect.skip,
            block_size=_BLOCK,
            encoding=dialect.encoding.removesuffix("-sig"),
            use_threads=False,
        ),
        parse_options=arrow_csv.ParseOptions(delimiter=dialect.delimiter, invalid_row_handler=_comment_or_error),
        convert_options=arrow_csv.ConvertOptions(
            include_columns=[f"c{index}" for index in wanted],
            column_types=dict(types),
            decimal_point=dialect.decimal,
            null_values=list(NULLS),
        ),
    )


def _comment_or_error(row: Any) -> str:
    text = str(row.text).strip()
    return "skip" if not text or text.startswith(COMMENT) else "error"
