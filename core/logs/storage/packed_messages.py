"""Messages that a recorder compressed one by one (rosbag2's compression mode ``message``), unpacked batch by batch.

The method is told by the payload's first bytes, which no CDR message begins with; so that a storage file without its
metadata.yaml is read the same way. Frame header: RFC 8878, 3.1.1.1.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from collaudit.core.logs.storage.decompression import bounded
from collaudit.core.logs.storage.file_reading import MAX_RATIO
from collaudit.core.logs.storage.records import Batch, ByteArray
from collaudit.core.numeric.arrays import IntArray

_MAGICS = {b"\x28\xb5\x2f\xfd": "zstd", b"\x04\x22\x4d\x18": "lz4"}
#: Longest frame header.
_HEAD = 18
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
    """The messages of a batch, decompressed, in their order.

    Args:
        batch: compressed messages.
        kind: as :func:`packing_of` names it.
    """
    limit = np.maximum(_FREE_BYTES, MAX_RATIO * batch.length)
    sizes = _zstd_sizes(batch) if kind == "zstd" else np.full(batch.start.shape[0], -1)
    known = bool((sizes >= 0).all() and (sizes <= limit).all())
    many = _many() if known else None
    for part in _blocks(sizes if known else limit):
        rows = _rows(batch, part)
        data = many(rows, sizes[part]) if many is not None else None
        yield _one_by_one(rows, kind) if data is None else UnpackedMessages(_placed(rows, data, sizes[part]))


def _blocks(sizes: IntArray) -> Iterator[slice]:
    """Rows in blocks of bounded size."""
    block = np.cumsum(sizes) // _AT_ONCE
    edges = (np.flatnonzero(np.diff(block)) + 1).tolist()
    for first, stop in pairwise([0, *edges, sizes.shape[0]]):
        yield slice(first, stop)


def _many() -> Callable[[Batch, IntArray], bytes | None] | None:
    """What unpacks many frames in one call; None where the zstandard package lacks it."""
    import zstandard

    if not hasattr(zstandard.ZstdDecompressor, "multi_decompress_to_buffer"):
        return None

    def many(batch: Batch, sizes: IntArray) -> bytes | None:
        places = np.stack([batch.start, batch.length], axis=1).astype(np.uint64).tobytes()
        try:
            frames = zstandard.BufferWithSegments(batch.data.data, places)
            out: Any = zstandard.ZstdDecompressor().multi_decompress_to_buffer(
                frames, decompressed_sizes=sizes.astype(np.uint64).tobytes()
            )
        except (zstandard.ZstdError, ValueError, MemoryError):
            return None
        data = b"".join(out)
        return data if len(data) == int(sizes.sum()) else None

    return many


def _one_by_one(batch: Batch, kind: str) -> UnpackedMessages:
    good: list[int] = []
    parts: list[bytes] = []
    problem = ""
    for index in range(batch.start.shape[0]):
        packed = batch.payload(index)
        found = bounded(kind, packed, max(_FREE_BYTES, MAX_RATIO * len(packed)))
        if found.problem is None:
            good.append(index)
            parts.append(found.data)
        else:
            problem = problem or f"it is compressed as {kind} and cannot be unpacked: {found.problem}"
    rows = np.array(good, dtype=np.int64)
    sizes = np.fromiter(map(len, parts), dtype=np.int64, count=len(parts))
    failed = batch.start.shape[0] - len(good)
    return UnpackedMessages(_placed(_rows(batch, rows), b"".join(parts), sizes), failed, problem)


def _rows(batch: Batch, rows: slice | IntArray) -> Batch:
    publish = None if batch.publish_ns is None else batch.publish_ns[rows]
    return replace(
        batch, start=batch.start[rows], length=batch.length[rows], log_ns=batch.log_ns[rows], publish_ns=publish
    )


def _placed(batch: Batch, data: bytes, sizes: IntArray) -> Batch:
    """A batch with the payloads end to end in other bytes."""
    return replace(batch, data=np.frombuffer(data, dtype=np.uint8), start=np.cumsum(sizes) - sizes, length=sizes)


def _zstd_sizes(batch: Batch) -> IntArray:
    """(n,) bytes each frame says it holds, -1 where it does not say or is none."""
    places = np.minimum(batch.start[:, None] + np.arange(_HEAD), batch.data.shape[0] - 1)
    head: ByteArray = batch.data[places]
    told = head[:, 4]
    single = (told >> 5) & 1
    at = 6 - single.astype(np.int64) + np.array([0, 1, 2, 4])[told & 3]
    wide = np.array([0, 2, 4, 8])[told >> 6]
    wide = np.where(wide == 0, single, wide)
    value = np.zeros(told.shape[0], dtype=np.uint64)
    for byte in range(8):
        digit = np.take_along_axis(head, np.minimum(at + byte, _HEAD - 1)[:, None], axis=1)[:, 0]
        value |= np.where(byte < wide, digit, 0).astype(np.uint64) << np.uint64(8 * byte)
    value += np.where(wide == 2, 256, 0).astype(np.uint64)
    true = (head[:, :4] == np.frombuffer(b"\x28\xb5\x2f\xfd", np.uint8)).all(axis=1)
    true &= (wide > 0) & (at + wide <= batch.length) & (value < 1 << 62)
    return np.where(true, value.astype(np.int64), -1)
