"""Metadata records of an MCAP file: what a recorder wrote down beside the messages."""

from __future__ import annotations

import struct
from pathlib import Path

from collaudit.core.logs.mcap.mcap_scan import HEAD, MAGIC
from collaudit.core.logs.storage.file_reading import RandomFile

_METADATA, _METADATA_INDEX = 0x0C, 0x0D
_TAIL = 8 + 20 + 9
_MOST_BYTES = 1 << 20
_MOST_SUMMARY = 256 << 20


def metadata_values(path: Path) -> set[str]:
    """Values of all metadata records that the file's summary lists; none where it has no usable summary.

    Args:
        path: an MCAP file.
    """
    from collaudit.core.logs.mcap.mcap_scan import chunk_records

    file = RandomFile(path)
    try:
        tail = file.read(max(file.size - _TAIL, 0), _TAIL)
        if len(tail) < _TAIL or tail[-8:] != MAGIC:
            return set()
        start, _, _ = struct.unpack_from("<QQI", tail, HEAD.size)
        size = file.size - _TAIL - start
        if start < len(MAGIC) or not 0 < size <= _MOST_SUMMARY:
            return set()
        data = file.read(start, size)
        found: set[str] = set()
        for op, at, length in chunk_records(data):
            if op == _METADATA_INDEX and length >= 16:
                place, size = struct.unpack_from("<QQ", data, at + 9)
                found |= _values(file.read(place, min(size, _MOST_BYTES)))
        return found
    finally:
        file.close()


def _values(record: bytes) -> set[str]:
    """Values of the map in one metadata record: name, then a byte count and pairs of strings."""
    if len(record) < 9 or record[0] != _METADATA:
        return set()
    try:
        _, at = _text(record, 9)
        (size,) = struct.unpack_from("<I", record, at)
        at, end, found = at + 4, at + 4 + size, set()
        while at < min(end, len(record)):
            _, at = _text(record, at)
            value, at = _text(record, at)
            found.add(value)
        return found
    except (struct.error, UnicodeDecodeError):
        return set()


def _text(data: bytes, at: int) -> tuple[str, int]:
    (size,) = struct.unpack_from("<I", data, at)
    return data[at + 4 : at + 4 + size].decode("utf-8"), at + 4 + size
