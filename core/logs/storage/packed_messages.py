"""Messages that a recorder compressed one by one (rosbag2's compression mode ``message``), unpacked batch by batch.

The method is told by the payload's first bytes, which no CDR message begins with; so that a storage file without its
metadata.yaml is read the same way.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.logs.storage.decompression import Unpacked, bounded
from collaudit.core.logs.storage.file_reading import MAX_RATIO
from collaudit.core.logs.storage.records import Batch

_MAGICS = {b"\x28\xb5\x2f\xfd": "zstd", b"\x04\x22\x4d\x18": "lz4"}
#: So many bytes are unpacked at once.
_AT_ONCE = 1 << 27
#: A message that becomes larger than this, and more than ``MAX_RATIO`` times its bytes, is refused.
_FREE_BYTES = 1 << 20


@dataclass(frozen=True, slots=True, eq=False)
class UnpackedMessages:
    """Some messages of a batch, and how many beside them could not be unpacked.

    Attributes:
        batch: those that could.
        failed: number of the others.
        problem: why the first of them could not, or "".
    """

    batch: Batch
    failed: int = 0
    problem: str = ""


def packing_of(batch: Batch) -> str | None:
    """How the messages of a batch are compressed, by the first one; None when they are not."""
    if not batch.start.shape[0] or batch.length[0] < 4:
        return None
    start = int(batch.start[0])
    return _MAGICS.get(batch.data[start : start + 4].tobytes())


def unpacked(batch: Batch, kind: str) -> Iterator[UnpackedMessages]:
    """The messages of a batch, decompressed, in their order and in blocks of bounded size.

    Args:
        batch: compressed messages.
        kind: as :func:`packing_of` names it.
    """
    first = 0
    while first < batch.start.shape[0]:
        found = _block(batch, first, kind)
        yield _put_together(batch, first, found, kind)
        first += len(found)


def _block(batch: Batch, first: int, kind: str) -> list[Unpacked]:
    out: list[Unpacked] = []
    held = 0
    while held < _AT_ONCE and first + len(out) < batch.start.shape[0]:
        packed = batch.payload(first + len(out))
        out.append(bounded(kind, packed, max(_FREE_BYTES, MAX_RATIO * len(packed))))
        held += len(out[-1].data)
    return out


def _put_together(batch: Batch, first: int, found: list[Unpacked], kind: str) -> UnpackedMessages:
    """The payloads end to end in bytes of their own."""
    rows = first + np.flatnonzero([one.problem is None for one in found])
    parts = [one.data for one in found if one.problem is None]
    problems = [one.problem for one in found if one.problem is not None]
    length = np.array([len(part) for part in parts], dtype=np.int64)
    data, start = np.frombuffer(b"".join(parts), dtype=np.uint8), np.cumsum(length) - length
    good = replace(batch, data=data, start=start, length=length, log_ns=batch.log_ns[rows])
    problem = f"it is compressed as {kind} and cannot be unpacked: {problems[0]}" if problems else ""
    return UnpackedMessages(good, len(problems), problem)
