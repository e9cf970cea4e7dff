"""JSON lines as tables: one object a line is one row."""

from __future__ import annotations

import io
import json
from pathlib import Path

import pyarrow as pa
from pyarrow import json as arrow_json

from collaudit.core.errors import LogError
from collaudit.core.logs.column_files.arrow_file import columns_of_table
from collaudit.core.logs.column_files.named_columns import NamedColumns


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
    try:
        columns = columns_of_table(arrow_json.read_json(io.BytesIO(data), options), path)
    except (pa.ArrowException, OverflowError, UnicodeDecodeError) as error:
        raise LogError(f"cannot be read as JSON lines: {str(error)[:200]}", where=str(path)) from error
    read = NamedColumns(path, "jsonl", "JSON lines", columns)
    read.damage = damage
    return read
