"""Element by element over long arrays in blocks that stay in the cache, where a pass costs a third of one in memory.

Where several threads work at the same time, blocks are longer: between two calls a thread asks for Python's lock, and
one that has to wait for it is woken late (50 us on a virtual machine, ten calls of a short block).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.parallel import threads

#: Samples of a block of one thread, of which eight arrays fit a core's second-level cache, and of one of several.
SAMPLES, _OF_SEVERAL = 16384, 65536


def samples_at_once() -> int:
    """Samples of a block."""
    return SAMPLES if threads() == 1 else _OF_SEVERAL


def blocks(count: int, size: int | None = None) -> Iterator[slice]:
    """Slices that cover so many samples, in order, each of ``size`` or of :func:`samples_at_once`."""
    step = samples_at_once() if size is None else size
    return (slice(start, min(start + step, count)) for start in range(0, count, step))


def exceeds(x: FloatArray, level: float | FloatArray, share: float = 1.0) -> BoolArray:
    """(n,) whether |x| > share · level, which is a number or (n,); NaN exceeds nothing and is exceeded by nothing."""
    out = np.empty(x.shape, dtype=np.bool_)
    step = samples_at_once()
    size = np.empty(min(step, x.size))
    for block in blocks(x.size, step):
        magnitude = np.abs(x[block], out=size[: block.stop - block.start])
        limit = level[block] if isinstance(level, np.ndarray) else level
        np.greater(magnitude, limit if share == 1.0 else share * limit, out=out[block])
    return out


def steps_exceed(x: FloatArray, level: float) -> BoolArray:
    """(n - 1,) whether a value of (n,) and the next one are further apart than a level; NaN is not."""
    out = np.empty(max(0, x.size - 1), dtype=np.bool_)
    count = samples_at_once()
    steps = np.empty(min(count, out.size))
    for block in blocks(out.size, count):
        step = np.subtract(x[1:][block], x[:-1][block], out=steps[: block.stop - block.start])
        np.greater(np.abs(step, out=step), level, out=out[block])
    return out
