"""Messages at places in a byte buffer: the places in order, the bytes as rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from collaudit.core.logs.storage.records import Batch, ByteArray
from collaudit.core.numeric.arrays import IntArray


@dataclass(frozen=True, slots=True, eq=False)
class Located:
    """Messages of a buffer in the order they lie in it.

    Attributes:
        start, length: (n,) payload offsets and sizes.
        channel: (n,) channel numbers.
        log_ns: (n,) times of recording.
        others: records that define schemas and channels, as the format has them.
        rest: bytes that are no whole record.
    """

    start: IntArray
    length: IntArray
    channel: IntArray
    log_ns: IntArray
    others: Sequence[Any] = ()
    rest: int = 0

    def by_channel(self, data: ByteArray) -> list[Batch]:
        """The messages of each channel, in the order of their numbers."""
        out = []
        for number in np.unique(self.channel).tolist():
            mine = np.flatnonzero(self.channel == number)
            out.append(Batch(number, data, self.start[mine], self.length[mine], self.log_ns[mine]))
        return out


def follow_each_other(start: IntArray, stop: IntArray, size: int) -> bool:
    """Whether records at such places, in order, take all of ``size`` bytes."""
    edges, stops = np.append(0, stop), np.append(start, size)
    return bool((edges == stops).all())


def ascending(offsets: IntArray) -> IntArray:
    """Offsets in order, each once."""
    if not (offsets[1:] > offsets[:-1]).all():
        offsets = np.sort(offsets, kind="stable")  # a few sorted runs, one a channel, are merged
        if (offsets[1:] == offsets[:-1]).any():
            offsets = np.unique(offsets)
    return offsets


def gather(data: ByteArray, start: IntArray, width: int) -> ByteArray:
    """Copy ``width`` bytes from each offset into the rows of a matrix.

    Args:
        data: (b,) bytes.
        start: (n,) offsets, each with ``0 <= start`` and ``start + width <= b``.
        width: bytes per row, at least 1.

    Returns:
        (n, width) bytes.
    """
    count = start.shape[0]
    if count == 0 or width == 0:
        return np.empty((count, width), dtype=np.uint8)
    windows = np.ndarray(
        shape=(data.shape[0] - width + 1,), dtype=np.dtype(f"V{width}"), buffer=data.data, strides=(1,)
    )
    return windows[start].view(np.uint8).reshape(count, width)
