"""Messages that a recorder compressed one by one (rosbag2's compression mode ``message``), unpacked batch by batch.

The method is told by the payload's first bytes, which no CDR message begins with; so that a storage file without its
metadata.yaml is read the same way.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from collaudit.core.logs.storage.decompression import bounded
from collaudit.core.logs.storage.file_reading import MAX_RATIO
from collaudit.core.logs.storage.records import Batch

_MAGICS = {b"\x28\xb5\x2f\xfd": "zstd", b"\x04\x22\x4d\x18": "lz4"}
#: So many bytes are unpacked at once.
_AT_ONCE = 1 << 27
#: A message that becomes larger than this, and more than ``MAX_RATIO`` times its bytes, is refused.
_FREE_BYTES = 1 << 20


def packing_of(batch: Batch) -> str | None:
    """How the messages of a batch are compressed, by the first one; None when they are not."""
    if not batch.start.shape[0] or batch.length[0] < 4:
        return None
    start = int(batch.start[0])
    return _MAGICS.get(batch.data[start : start + 4].tobytes())


def unpacked(batch: Batch, kind: str) -> Iterator[tuple[Batch, list[str]]]:
    """The messages of a batch, decompressed, in their order and in blocks of bounded size.

    Args:
        batch: compressed messages.
        kind: as :func:`packing_of` names it.

    Returns:
        Those of each block that could be unpacked, and why each of the others could not.
    """
    rows: list[int] = []
    parts: list[bytes] = []
    problems: list[str] = []
    held, count = 0, batch.start.shape[0]
    for index in range(count):
        packed = batch.payload(index)
        one = bounded(kind, packed, max(_FREE_BYTES, MAX_RATIO * len(packed)))
        if one.problem is None:
            rows.append(index)
            parts.append(one.data)
        else:
            problems.append(f"it is compressed as {kind} and cannot be unpacked: {one.problem}")
        held += len(one.data)
        if index == count - 1 or held >= _AT_ONCE:
            yield _joined(batch, rows, parts), problems
            rows, parts, problems, held = [], [], [], 0


def _joined(batch: Batch, rows: list[int], parts: list[bytes]) -> Batch:
    """Some messages of a batch, their payloads end to end in bytes of their own."""
    length = np.array([len(part) for part in parts], dtype=np.int64)
    data = np.frombuffer(b"".join(parts), dtype=np.uint8)
    return replace(batch, data=data, start=np.cumsum(length) - length, length=length, log_ns=batch.log_ns[rows])
