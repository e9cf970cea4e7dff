"""Messages that follow each other outside chunks of an MCAP file: found many at a time.

Each record says only where the next one begins, so a walk takes one step a message. Recorders write the same few
topics in the same turn, though: the sizes just met foretell where the next records begin, and whether they do is
checked for many of them at once. Where the foretelling fails, the walk goes on step by step, and the longer so the
more often it failed.
"""

from __future__ import annotations

import struct

import numpy as np

from collaudit.core.logs.storage.message_places import gather
from collaudit.core.logs.storage.records import ByteArray
from collaudit.core.numeric.arrays import IntArray

MESSAGE = 5
#: Bytes from the start of a message record up to the end of its log time.
LEAST_HEAD = 23
_HEAD = np.dtype([("op", "u1"), ("length", "<u8")])
_LENGTH = struct.Struct("<Q").unpack_from
#: Steps between two attempts to foretell: after a success, and at most.
_FEW_STEPS, _MANY_STEPS = 64, 4096
_MAX_PERIOD = 24
#: Records foretold in the first attempt; after each one that comes true throughout, four times as many.
_FEW_AHEAD = 256


def message_run(window: bytes, at: int) -> tuple[IntArray, int]:
    """The messages that follow each other from one place.

    Args:
        window: a part of the file.
        at: where a record begins in it.

    Returns:
        (n,) offsets of the message records up to the first other record, or to one of which fewer than
        ``LEAST_HEAD`` bytes lie in the window; and the offset after the last, which may lie beyond the window.
    """
    view = np.frombuffer(window, dtype=np.uint8)
    parts: list[IntArray] = []
    steps, ahead = _FEW_STEPS, _FEW_AHEAD
    while True:
        walked, at = _walked(window, at, steps)
        parts.append(np.array(walked, dtype=np.int64))
        if len(walked) < steps or at > len(window):
            return np.concatenate(parts), at
        last = np.array([*walked[-2 * _MAX_PERIOD :], at], dtype=np.int64)
        sizes = _turn(last[1:] - last[:-1])
        while True:
            came, at = _foretold(view, at, sizes, ahead)
            parts.append(came)
            if came.shape[0] < ahead:
                break
            ahead *= 4
        steps = min(2 * steps, _MANY_STEPS) if came.shape[0] < steps and ahead == _FEW_AHEAD else _FEW_STEPS
        ahead = _FEW_AHEAD


def _walked(window: bytes, at: int, most: int) -> tuple[list[int], int]:
    """Offsets of up to ``most`` messages, one step each, and the offset after the last."""
    out: list[int] = []
    last = len(window) - LEAST_HEAD
    while at <= last and window[at] == MESSAGE and len(out) < most:
        out.append(at)
        at += 9 + _LENGTH(window, at + 1)[0]
    return out, at


def _turn(sizes: IntArray) -> IntArray:
    """The shortest turn of sizes that these ones repeat throughout; none where they repeat none."""
    for period in range(1, sizes.shape[0] // 2 + 1):
        if (sizes[period:] == sizes[:-period]).all():
            return sizes[-period:]
    return sizes[:0]


def _foretold(view: ByteArray, at: int, sizes: IntArray, most: int) -> tuple[IntArray, int]:
    """Up to ``most`` messages whose sizes go on as foretold, and the offset after them.

    Each is a message at the place where the one before it ends, just as a step would have found it.
    """
    room = view.shape[0] - LEAST_HEAD - at
    if not sizes.shape[0] or room < 0:
        return np.empty(0, dtype=np.int64), at
    turns = min(most // sizes.shape[0], room // int(sizes.sum()) + 1) + 1
    expected = np.tile(sizes, turns)[:most]
    ends = at + np.cumsum(expected)
    starts = ends - expected
    starts = starts[: np.searchsorted(starts, view.shape[0] - LEAST_HEAD, side="right")]
    heads = gather(view, starts, _HEAD.itemsize).view(_HEAD).ravel()
    true = (heads["op"] == MESSAGE) & (heads["length"] == (expected[: starts.shape[0]] - 9).astype(np.uint64))
    count = starts.shape[0] if true.all() else int(np.argmin(true))
    return starts[:count], int(ends[count - 1]) if count else at
