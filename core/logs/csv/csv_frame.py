"""Tables of numbers between runs of blanks, as ``numpy.savetxt`` writes them: Arrow cuts at single characters only.

What is not plain (text among the numbers, rows of another length, comments between rows) is left to the reader that
goes line by line and can say where: pandas is lenient with it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from collaudit.core.logs.csv.csv_stream import BoundedStream
from collaudit.core.logs.csv.csv_text import NULLS, Dialect, open_bytes


def suits_pandas(dialect: Dialect) -> bool:
    """Whether to try it. Elsewhere Arrow is as fast, and strict; importing pandas alone takes a fifth of a second."""
    same = len(dialect.first) == len(dialect.names)
    return dialect.delimiter == " " and dialect.decimal == "." and dialect.encoding.startswith("utf-8") and same


def read_plain(path: Path, dialect: Dialect, wanted: Sequence[int], types: Mapping[str, Any]) -> Any | None:
    """The wanted columns of a table whose cells are all numbers or missing.

    Args:
        path: the file.
        dialect: one that :func:`suits_pandas`.
        wanted: indices of columns.
        types: the Arrow type of each column ``c0``, ``c1`` …

    Returns:
        An Arrow table with columns ``c{index}``; None when the file is not that plain.
    """
    import pandas as pd
    import pyarrow as pa

    if any(types[f"c{index}"] not in (pa.float64(), pa.int64()) for index in wanted):
        return None
    with open_bytes(path) as stream:
        raw = getattr(stream, "raw", None)
        packed = raw if isinstance(raw, BoundedStream) else None
        try:
            frame = pd.read_csv(
                path if packed is None else stream,
                sep=r"\s+",
                header=None,
                names=list(range(len(dialect.names))),
                skiprows=dialect.skip,
                na_values=list(NULLS),
                keep_default_na=False,
                encoding=dialect.encoding,
            )
        except (ValueError, OverflowError):  # its ParserError is one
            return None
        if packed is not None and packed.damage is not None:
            return None
    return _checked(frame, wanted, types)


def _checked(frame: Any, wanted: Sequence[int], types: Mapping[str, Any]) -> Any | None:
    """The wanted columns as an Arrow table, None unless every column of the file is one of numbers."""
    import pyarrow as pa

    if not len(frame) or not {dtype.kind for dtype in frame.dtypes} <= {"f", "i"}:
        return None
    if frame[frame.columns[-1]].isna().any():  # a short row is filled up with missing values
        return None
    columns = {}
    for index in wanted:
        values, kind = frame[index].to_numpy(), types[f"c{index}"]
        if values[0] != values[0] or (kind == pa.int64() and values.dtype.kind != "i"):
            return None
        columns[f"c{index}"] = pa.array(values, type=kind)
    return pa.table(columns)
