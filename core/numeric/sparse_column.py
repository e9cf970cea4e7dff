"""Values that a signal has at some of its samples only, as arrays of those alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray


@dataclass(frozen=True, slots=True, eq=False)
class SparseColumn:
    """A signal that is 0 at most of its samples.

    Attributes:
        rows: (k,) samples at which it has a value, rising.
        values: (k,).
    """

    rows: IntArray
    values: FloatArray

    @classmethod
    def at_marked(cls, mask: BoolArray, values: FloatArray | float) -> SparseColumn:
        """The values (k,), or one value, at the marked samples (n,)."""
        rows = np.flatnonzero(mask)
        return cls(rows, np.asarray(np.broadcast_to(values, rows.shape)))

    @classmethod
    def of(cls, dense: FloatArray) -> SparseColumn:
        """What of a signal (n,) is not 0."""
        rows = np.flatnonzero(dense)
        return cls(rows, dense[rows])

    def at(self, samples: IntArray) -> FloatArray:
        """Values at any samples, of any shape."""
        if self.rows.size == 0:
            return np.zeros(samples.shape)
        if np.array_equal(samples, self.rows):
            return self.values
        place = np.minimum(np.searchsorted(self.rows, samples), self.rows.size - 1)
        return np.asarray(np.where(self.rows[place] == samples, self.values[place], 0.0))
