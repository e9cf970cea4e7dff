"""Path data of SVG in tenths of a pixel, written as steps: a third shorter than absolute positions, and exact."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from collaudit.core.numeric.arrays import FloatArray


def polyline(x: FloatArray, y: FloatArray) -> str:
    """A line through points.

    Args:
        x, y: (n,) pixels, n ≥ 1; rounded to tenths before steps are formed, so that no error adds up.
    """
    u, v = _tenths(x), _tenths(y)
    steps = np.stack([np.diff(u), np.diff(v)], axis=1).ravel().tolist()
    return "M" + _joined((int(u[0]), int(v[0]))) + ("l" + _joined(steps) if steps else "")


def strokes(x: FloatArray, y: FloatArray, end: FloatArray) -> str:
    """Vertical strokes at each ``x`` from ``y`` to ``end``, pixels (n,)."""
    u, v, w = _tenths(x), _tenths(y), _tenths(end)
    if u.size == 0:
        return ""
    across = np.diff(u, prepend=0).tolist()
    down = (v - np.concatenate(([0], w[:-1]))).tolist()
    moves = zip(across, down, (w - v).tolist(), strict=True)
    return "".join(f"m{_joined((a, b))}v{_number(c)}" for a, b, c in moves)


def _tenths(pixels: FloatArray) -> np.ndarray:
    return np.rint(10.0 * np.asarray(pixels, dtype=np.float64)).astype(np.int64)


def _joined(tenths: Sequence[int]) -> str:
    """Numbers with a blank between them where no sign divides them."""
    parts = [_number(value) for value in tenths]
    return parts[0] + "".join(part if part[0] == "-" else " " + part for part in parts[1:])


def _number(tenths: int) -> str:
    """Tenths as a decimal number, without a zero before the point."""
    whole, part = divmod(abs(tenths), 10)
    text = (str(whole) if whole or not part else "") + (f".{part}" if part else "")
    return f"-{text}" if tenths < 0 else text
