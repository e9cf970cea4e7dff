"""Arrays as the program passes them on: their types, read-only copies, ranges of samples."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]
#: Nothing of a robot is as large in any unit; sums of such numbers are still finite.
LARGEST = 1e15


def frozen(array: FloatArray) -> FloatArray:
    """Return the array as float64 that cannot be written to, rows or columns contiguous; copies only when it must.

    Signals lie column by column in memory wherever they are long: nearly all that is done with them follows time.
    """
    out = np.asarray(array, dtype=np.float64)
    if not out.flags.c_contiguous and out.strides[0] != out.itemsize:
        out = np.ascontiguousarray(out)
    if out is array and out.flags.writeable:
        out = out.view()
    out.flags.writeable = False
    return out


@dataclass(frozen=True, slots=True, order=True)
class Span:
    """Half-open range of sample indices, ``start <= k < stop``."""

    start: int
    stop: int

    def __len__(self) -> int:
        return self.stop - self.start

    @property
    def slice(self) -> slice:
        """The span as a slice."""
        return slice(self.start, self.stop)


def blocks(count: int, size: int) -> Iterator[slice]:
    """Slices that cover so many samples, in order, each of ``size`` but the last."""
    return (slice(start, min(start + size, count)) for start in range(0, count, size))
