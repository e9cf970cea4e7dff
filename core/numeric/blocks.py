"""Element by element over long arrays in blocks that stay in the cache, where a pass costs a third of one in memory."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from collaudit.core.numeric.arrays import BoolArray, FloatArray

#: Samples: eight arrays of them fit a core's second-level cache.
SAMPLES = 16384


def blocks(count: int, size: int = SAMPLES) -> Iterator[slice]:
    """Slices that cover so many samples, in order."""
    return (slice(start, min(start + size, count)) for start in range(0, count, size))


def exceeds(x: FloatArray, level: float | FloatArray, share: float = 1.0) -> BoolArray:
    """(n,) whether |x| > share · level, which is a number or (n,); NaN exceeds nothing and is exceeded by nothing."""
    out = np.empty(x.shape, dtype=np.bool_)
    size = np.empty(min(SAMPLES, x.size))
    for block in blocks(x.size):
        magnitude = np.abs(x[block], out=size[: block.stop - block.start])
        limit = level[block] if isinstance(level, np.ndarray) else level
        np.greater(magnitude, limit if share == 1.0 else share * limit, out=out[block])
    return out


def steps_exceed(x: FloatArray, level: float) -> BoolArray:
    """(n - 1,) whether a value of (n,) and the next one are further apart than a level; NaN is not."""
    out = np.empty(max(0, x.size - 1), dtype=np.bool_)
    steps = np.empty(min(SAMPLES, out.size))
    for block in blocks(out.size):
        step = np.subtract(x[1:][block], x[:-1][block], out=steps[: block.stop - block.start])
        np.greater(np.abs(step, out=step), level, out=out[block])
    return out
