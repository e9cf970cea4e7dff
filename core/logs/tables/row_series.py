"""Which rows of a table are samples: topics merged by time leave rows of other sensors between those of the joints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from collaudit.core.findings import Finding, fact
from collaudit.core.logs.signals.stamps import interpolate
from collaudit.core.numeric.arrays import BoolArray, FloatArray

#: A quantity stands on rows of its own where so few of its rows have positions: two topics have the same stamp now and
#: then. A quantity with missing values shares the rows that it has.
_SHARED = 0.05


def rows_with_joints(columns: Mapping[str, FloatArray]) -> BoolArray | None:
    """(n,) rows that hold a value of any joint; None where all have a position.

    Args:
        columns: quantity to (n, j), NaN where a cell is empty.
    """
    position = columns.get("position")
    if position is None or not position.size or not np.isnan(position[:, 0]).any():
        return None
    held: BoolArray = np.logical_or.reduce([np.isfinite(values).any(axis=1) for values in columns.values()])
    return None if held.all() else held


def joint_samples(
    time_s: FloatArray, columns: dict[str, FloatArray], where: str
) -> tuple[BoolArray | None, list[Finding]]:
    """Leave the rows that are samples in the columns of joints, and bring quantities on other rows to these.

    Between the first and the last row with a value of a joint, rows without any are no samples, as if they were not in
    the file. Before and behind they stay: time in which the joints were lost.

    Args:
        time_s: (n,) stamps.
        columns: quantity to (n, j), NaN where a cell is empty; changed in place to (m, j).
        where: the file, for findings.

    Returns:
        (n,) the m rows that are samples, None where all are; and what is to be said.
    """
    filled = {quantity: np.isfinite(values).any(axis=1) for quantity, values in columns.items()}
    shared = {quantity: np.count_nonzero(filled[quantity] & filled["position"]) for quantity in filled}
    apart = sorted(q for q in filled if filled[q].any() and shared[q] <= _SHARED * np.count_nonzero(filled[q]))
    held = np.logical_or.reduce([filled[quantity] for quantity in filled if quantity not in apart])
    if not held.any() or held.all():
        return None, []
    first, last = np.flatnonzero(held)[[0, -1]]
    empty = ~np.logical_or.reduce([*filled.values()])
    empty[first:last] = False
    samples = held | empty
    for quantity, values in columns.items():
        own = filled[quantity]
        at = interpolate(time_s[samples], time_s[own], values[own]) if quantity in apart else values[samples]
        columns[quantity] = np.asfortranarray(at)
    left_out = int(np.count_nonzero(~samples))
    text = f"{left_out} of {held.size} rows hold no sample of the joints, but other signals or nothing."
    if apart:
        text += f" Rows of its own has: {', '.join(apart)}; its values were brought to the stamps of the positions."
    return samples, [fact(text, where=where)] if left_out else []


def held_words(words: Sequence[str], samples: BoolArray) -> tuple[str, ...]:
    """Text of each row, of rows that are no samples the last before where they have none.

    Args:
        words: n texts; samples: (n,).
    """
    out, last = [], ""
    for word, sample in zip(words, samples.tolist(), strict=True):
        last = word if sample or word.strip() else last
        out.append(last)
    return tuple(out)
