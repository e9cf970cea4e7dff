"""Messages that follow each other outside chunks of an MCAP file: found many at a time.

Each record says only where the next one begins, so a walk takes one step a message. Recorders write the same few
topics in the same turn, though: the sizes just met foretell where the next records begin, and whether they do is
checked for many of them at once. Where the foretelling fails, the walk goes on step by step.
"""

from __future__ import annotations

import struct

import numpy as np

from collaudit.core.logs.storage.message_places import gather
from collaudit.core.numeric.arrays import IntArray

MESSAGE = 5
#: Bytes from the start of a message record up to the end of its log time.
LEAST_HEAD = 23
_HEAD = np.dtype([("op", "u1"), ("length", "<u8")])
_LENGTH = struct.Struct("<Q").unpack_from
#: Steps by which the turn of topics is told, and the longest turn.
_FEW_STEPS, _MAX_PERIOD = 64, 24


def message_run(window: bytes, at: int) -> tuple[IntArray, int]:
    """The messages that follow each other from one place.

    Args:
        window: a part of the file.
        at: where a record begins in it.

    Returns:
        (n,) offsets of the message records up to the first other record, or to one of which fewer than
        ``LEAST_HEAD`` bytes lie in the window; and the offset after the last, which may lie beyond the window.
    """
    first, at = _walked(window, at, _FEW_STEPS)
    turn = _turn(np.diff([*first[-2 * _MAX_PERIOD :], at]))
    foretold, at = _foretold(window, at, turn)
    rest, at = _walked(window, at, len(window))
    return np.concatenate([np.array(first, dtype=np.int64), foretold, np.array(rest, dtype=np.int64)]), at


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


def _foretold(window: bytes, at: int, turn: IntArray) -> tuple[IntArray, int]:
    """The messages in a window whose sizes go on as foretold, and the offset after them.

    Each is a message at the place where the one before it ends, just as a step would have found it.
    """
    room = len(window) - LEAST_HEAD - at
    if not turn.shape[0] or room < 0:
        return np.empty(0, dtype=np.int64), at
    expected = np.tile(turn, room // int(turn.sum()) + 1)
    ends = at + np.cumsum(expected)
    starts = (ends - expected)[ends - expected <= at + room]
    heads = gather(np.frombuffer(window, dtype=np.uint8), starts, _HEAD.itemsize).view(_HEAD).ravel()
    true = (heads["op"] == MESSAGE) & (heads["length"] == (expected[: starts.shape[0]] - 9).astype(np.uint64))
    count = starts.shape[0] if true.all() else int(np.argmin(true))
    return starts[:count], int(ends[count - 1]) if count else at
