"""Computations over long, narrow arrays: by blocks of samples in threads, in the joints of a log."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.parallel import ordered_map
from collaudit.core.numeric.tables import table
from collaudit.core.robot.vectors import Scalar

#: Samples at a time: long enough that calling NumPy costs little, short enough that results stay in the cache.
_BLOCK = 16384


@dataclass(frozen=True, slots=True, eq=False)
class Batched:
    """A computation for many samples at once.

    Attributes:
        inputs, outputs: how many numbers of a sample go in and come out.
        compute: from (inputs, m) to as many arrays (m,), or numbers, as there are outputs.
    """

    inputs: int
    outputs: int
    compute: Callable[[FloatArray], Sequence[Scalar]]


@dataclass(frozen=True, slots=True, eq=False)
class Signal:
    """Inputs: (n, c) values, as (r, n) rows scale · (matrix · values + offset), as far as there are any."""

    values: FloatArray
    matrix: FloatArray | None = None
    offset: FloatArray | None = None
    scale: float = 1.0

    def rows(self, block: slice) -> FloatArray:
        """(r, m) rows of a block of samples."""
        rows = self.values[block].T
        if self.matrix is not None:
            rows = np.matmul(self.matrix, rows)
        if self.offset is not None:
            rows = rows + self.offset[:, None]
        return np.asarray(rows if self.scale == 1.0 else rows * self.scale)


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """So many of the outputs that are one array; by the transpose of ``back`` (rows, c) they become c."""

    rows: int
    back: FloatArray | None = None


def evaluate(program: Batched, signals: Sequence[Signal], parts: Sequence[Part] = ()) -> list[FloatArray]:
    """Compute over all samples; one with any input that is not finite is NaN altogether.

    Args:
        program: its inputs are the rows of the signals, one after the other.
        signals: of n samples each.
        parts: what its outputs are, one after the other; one array of them all without.

    Returns:
        (n, c) arrays, one a part.
    """
    count = signals[0].values.shape[0]
    parts = parts or (Part(program.outputs),)
    out = [table(count, p.rows if p.back is None else p.back.shape[1]) for p in parts]

    def one(block: slice) -> None:
        rows = np.concatenate([signal.rows(block) for signal in signals])
        with np.errstate(invalid="ignore"):  # the sine of what is not finite is not a number, and that is right
            results = np.array(np.broadcast_arrays(*program.compute(rows), rows[0])[:-1])
        known, first = np.isfinite(rows).all(axis=0), 0
        for part, array in zip(parts, out, strict=True):
            values = results[first : first + part.rows].T
            array[block] = values if part.back is None else np.matmul(values, part.back)
            if not known.all():
                array[block][~known] = np.nan
            first += part.rows

    for _ in ordered_map(one, [slice(start, start + _BLOCK) for start in range(0, count, _BLOCK)]):
        pass
    return out
