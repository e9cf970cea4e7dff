"""Tables between blanks, as ``numpy.savetxt`` writes them: Arrow cuts at single characters only, pandas at any run.

What is not plain (text, comments between rows, rows of another length) is left to the reader that goes line by line and
can say where.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from collaudit.core.logs.csv_stream import BoundedStream
from collaudit.core.logs.csv_text import NULLS, Dialect, open_bytes


def read_blanks(path: Path, dialect: Dialect, wanted: Sequence[int], types: Mapping[str, Any]) -> Any | None:
    """The wanted columns of a table whose cells are all numbers or missing.

    Args:
        path: the file.
        dialect: with a blank as its delimiter.
        wanted: indices of columns.
        types: the Arrow type of each column ``c0``, ``c1`` …

    Returns:
        An Arrow table with columns ``c{index}``; None when the file is not that plain.
    """
    import pandas as pd
    import pyarrow as pa

    kinds = (pa.float64(), pa.int64())
    if dialect.decimal != "." or any(types[f"c{index}"] not in kinds for index in wanted):
        return None
    count = len(dialect.names)
    if len(dialect.first) != count:  # pandas would take what is over as row labels
        return None
    with open_bytes(path) as stream:
        try:
            frame = pd.read_csv(
                stream,
                sep=r"\s+",
                header=None,
                names=list(range(count)),
                skiprows=dialect.skip,
                na_values=list(NULLS),
                keep_default_na=False,
                encoding=dialect.encoding,
            )
        except (ValueError, OverflowError):  # its ParserError is one
            return None
        raw = getattr(stream, "raw", None)
        if isinstance(raw, BoundedStream) and raw.damage is not None:
            return None
    kinds_met = {frame[index].dtype.kind for index in range(count)}
    # A short row is filled up with missing values: none in the last column, none short.
    if not kinds_met <= {"f", "i"} or not len(frame) or bool(frame[count - 1].isna().any()):
        return None
    if any(types[f"c{index}"] == pa.int64() and frame[index].dtype.kind != "i" for index in wanted):
        return None
    columns = {f"c{i}": pa.array(frame[i].to_numpy(), type=types[f"c{i}"], from_pandas=True) for i in wanted}
    return pa.table(columns)
