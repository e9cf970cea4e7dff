"""Traces of KUKA controllers as tables: a header in text (``.dat``) beside values (``.r64``), one pair an axis.

The header is that of DIAdem (National Instruments, "DIAdem data file format: header"): lines ``number,value``, between
marks of each channel. A value is its offset (240) plus its factor (241) times the number in the file of values.
"""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path, PureWindowsPath
from typing import Any

import numpy as np

from collaudit.core.errors import LogError
from collaudit.core.logs.storage.file_content import AXIS, values_beside
from collaudit.core.logs.storage.readers import arrow_of
from collaudit.core.logs.tables.named_columns import NamedColumns

_CHANNEL = re.compile(r"#BEGINCHANNELHEADER\s+(.*?)#ENDCHANNELHEADER", re.DOTALL)
_LINE = re.compile(r"^\s*(\d+),(.*?)\s*$", re.MULTILINE)
#: Numbers of header lines.
_BYTE_ORDER, _NAME, _UNIT, _KIND, _FILE, _STORED, _TYPE, _COUNT, _PLACE, _OFFSET, _FACTOR = (
    "112", "200", "202", "210", "211", "213", "214", "220", "221", "240", "241"
)  # fmt: skip
_TYPES = {"REAL64": "<f8", "REAL32": "<f4", "INT32": "<i4", "INT16": "<i2", "WORD32": "<u4", "WORD16": "<u2"}


def open_kuka_trace(path: Path, settings: object) -> NamedColumns:
    """Open the header of a trace, and the values beside it.

    The channels of axis 2 are called ``joint_a2.NAME [UNIT]``; those of a trace of no axis as the header calls them.

    Raises:
        LogError: the header lacks something, or the file of values is missing or not as long as it says.
    """
    data = path.read_bytes()
    try:
        text = data.decode()
    except UnicodeDecodeError:
        text = data.decode("cp1252", "replace")
    channels = [dict(_LINE.findall(block)) for block in _CHANNEL.findall(text)]
    if dict(_LINE.findall(text)).get(_BYTE_ORDER, "High -> Low") != "High -> Low":
        raise LogError("stores its numbers in an order of bytes that is not read", where=str(path))
    try:
        columns = _columns(path, channels)
    except (KeyError, ValueError) as error:
        raise LogError(f"cannot be read as a KUKA trace: its header lacks {error}", where=str(path)) from error
    return NamedColumns(path, "kuka-trace", "KUKA trace", columns)


def _columns(path: Path, channels: list[dict[str, str]]) -> dict[str, Any]:
    axis = AXIS.fullmatch(path.stem)
    front = f"joint_a{axis[2]}." if axis is not None else ""
    widths = Counter(channel[_FILE] for channel in channels if _FILE in channel)
    columns: dict[str, Any] = {}
    for channel in channels:
        count, offset, factor = int(channel[_COUNT]), float(channel[_OFFSET]), float(channel[_FACTOR])
        if _FILE in channel:
            numbers = _stored(path, channel, count, widths[channel[_FILE]])
            name = f"{front}{channel[_NAME]} [{channel[_UNIT]}]"
        else:  # implicit: a value a row, evenly spaced
            numbers = np.arange(count)
            name = f"{channel[_NAME]} [{channel[_UNIT]}]"
        if name in columns:
            raise LogError("two channels have the same name", where=str(path), found=name)
        columns[name] = arrow_of(offset + factor * numbers)
    lengths = {name: len(column) for name, column in columns.items()}
    if len(set(lengths.values())) > 1:
        raise LogError("its channels are not equally long", where=str(path), found=str(lengths)[:200])
    return columns


def _stored(path: Path, channel: dict[str, str], count: int, width: int) -> Any:
    """The (count,) numbers of a channel; stored as ``BLOCK`` all channels of a sample lie side by side."""
    number, place = np.dtype(_TYPES[channel[_TYPE]]), int(channel[_PLACE]) - 1
    values = values_beside(path, channel[_FILE])
    if values is None:
        raise LogError(
            "its values are missing",
            where=str(path),
            expected=f"a file {PureWindowsPath(channel[_FILE]).name} beside it",
            hint="copy the .dat and the .r64 of a trace together",
        )
    held = values.stat().st_size
    if held != count * width * number.itemsize or not 0 <= place < count * width:
        raise LogError(
            "its values are not as many as its header says",
            where=str(values),
            found=f"{held} bytes",
            expected=f"{count * width * number.itemsize} bytes: {width} channels of {count} values",
            hint="copy the .dat and the .r64 of a trace together, when its recording has ended",
        )
    stored = np.fromfile(values, number)
    return stored[place::width] if channel[_STORED] == "BLOCK" else stored[place : place + count]
