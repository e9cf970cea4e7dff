"""The outline of marked cells of a grid as a path: half the length of rectangles, and without seams between them."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from collaudit.core.numeric.arrays import BoolArray

#: A corner of the grid: column and row of the line that it lies on.
_Corner = tuple[int, int]


def region_outline(marked: BoolArray, x: Sequence[float], y: Sequence[float]) -> str:
    """Closed outlines of a region, holes included, in whole pixels; to be filled by the even-odd rule.

    Args:
        marked: (rows, columns) cells of the region.
        x: (columns + 1,) borders of the columns, pixels.
        y: (rows + 1,) borders of the rows, pixels.

    Returns:
        Path data; empty where nothing is marked.
    """
    px, py = (np.rint(np.asarray(at, dtype=np.float64)).astype(int).tolist() for at in (x, y))
    ahead = _borders(marked)
    path, at = [], (0, 0)
    while ahead:
        corners = _loop(ahead)
        start = (px[corners[0][0]], py[corners[0][1]])
        steps = [(px[b[0]] - px[a[0]], py[b[1]] - py[a[1]]) for a, b in pairwise(corners)]
        steps = [step for step in steps if step != (0, 0)]
        if steps:
            path.append(f"m{start[0] - at[0]} {start[1] - at[1]}" + "".join(_step(*step) for step in steps) + "z")
            at = start
    return "".join(path)


def _step(across: int, down: int) -> str:
    return f"h{across}" if down == 0 else f"v{down}"


def _borders(marked: BoolArray) -> dict[_Corner, list[_Corner]]:
    """From every corner the corners ahead of it, with marked cells always on the same side."""
    cells = np.pad(marked.astype(np.int8), 1)
    ahead: dict[_Corner, list[_Corner]] = {}
    down, across = np.diff(cells, axis=0), np.diff(cells, axis=1)
    for row, column in np.argwhere(down).tolist():
        ends = [(column - 1, row), (column, row)]
        _add(ahead, ends if down[row, column] > 0 else ends[::-1])
    for row, column in np.argwhere(across).tolist():
        ends = [(column, row - 1), (column, row)]
        _add(ahead, ends[::-1] if across[row, column] > 0 else ends)
    return ahead


def _add(ahead: dict[_Corner, list[_Corner]], ends: Sequence[_Corner]) -> None:
    ahead.setdefault(ends[0], []).append(ends[1])


def _loop(ahead: dict[_Corner, list[_Corner]]) -> list[_Corner]:
    """Take one closed outline out of what is ahead: its corners, those on a straight line left out."""
    here = first = next(iter(ahead))
    corners = [first]
    while True:
        there = ahead[here].pop()
        if not ahead[here]:
            del ahead[here]
        if len(corners) > 1 and _straight(corners[-2], corners[-1], there):
            corners[-1] = there
        else:
            corners.append(there)
        if there == first:
            return corners
        here = there


def _straight(a: _Corner, b: _Corner, c: _Corner) -> bool:
    return (a[0] == b[0] == c[0]) or (a[1] == b[1] == c[1])
