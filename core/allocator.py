"""Keeping freed memory in the process: the next array of the same size then costs nothing to obtain."""

from __future__ import annotations

import sys

#: Parameters of mallopt(3) of the GNU C library, and the values set.
_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3
_KEPT_BYTES = 1 << 30
#: The largest the library takes. Larger arrays still come from the system and go back to it at once.
_LARGEST_HEAP_ARRAY_BYTES = 32 << 20


def keep_freed_memory() -> bool:
    """Ask the C library not to return freed memory of arrays up to 32 MB to the system, up to 1 GB of it.

    Work joint by joint and block by block asks for the same sizes again and again. By default each such array's
    pages are given back and have to be zeroed and mapped anew: on an hour of log that was a third of the time of
    detection.

    Returns:
        Whether the C library took it; others than GNU's have no such setting, and nothing depends on it.
    """
    if not sys.platform.startswith("linux"):
        return False
    import ctypes

    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (OSError, AttributeError):
        return False
    taken = mallopt(_MMAP_THRESHOLD, _LARGEST_HEAP_ARRAY_BYTES), mallopt(_TRIM_THRESHOLD, _KEPT_BYTES)
    return all(taken)
