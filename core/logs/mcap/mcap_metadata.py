"""Metadata records of an MCAP file: what a recorder wrote down beside the messages."""

from __future__ import annotations

from pathlib import Path

from collaudit.core.logs.mcap.mcap_records import METADATA, METADATA_INDEX, parsed, record_places, summary_of
from collaudit.core.logs.storage.file_reading import RandomFile

_MOST_BYTES = 1 << 20


def metadata_values(path: Path) -> set[str]:
    """Values of all metadata records that the file's summary lists; none where it has no usable summary.

    Args:
        path: an MCAP file.
    """
    file = RandomFile(path)
    try:
        summary = summary_of(file)
        found: set[str] = set()
        for op, at, length in record_places(summary):
            index = parsed(op, summary[at + 9 : at + 9 + length]) if op == METADATA_INDEX else None
            record = b"" if index is None else file.read(index.offset, min(index.length, _MOST_BYTES))
            metadata = parsed(METADATA, record[9:]) if record[:1] == bytes([METADATA]) else None
            found |= set() if metadata is None else set(metadata.metadata.values())
        return found
    finally:
        file.close()
