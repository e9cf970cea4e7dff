"""Messages that follow each other outside chunks of an MCAP file: each says only where the next one begins."""

from __future__ import annotations

import struct

import numpy as np

from collaudit.core.numeric.arrays import IntArray

MESSAGE = 5
#: Bytes from the start of a message record up to the end of its log time.
LEAST_HEAD = 23
_LENGTH = struct.Struct("<Q").unpack_from


def message_run(window: bytes, at: int) -> tuple[IntArray, int]:
    """The messages that follow each other from one place.

    Args:
        window: a part of the file.
        at: where a record begins in it.

    Returns:
        (n,) offsets of the message records up to the first other record, or to one of which fewer than
        ``LEAST_HEAD`` bytes lie in the window; and the offset after the last, which may lie beyond the window.
    """
    out: list[int] = []
    last = len(window) - LEAST_HEAD
    while at <= last and window[at] == MESSAGE:
        out.append(at)
        at += 9 + _LENGTH(window, at + 1)[0]
    return np.array(out, dtype=np.int64), at
