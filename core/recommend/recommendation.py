"""The contact-free residual of a joint, and the peaks of what it sustains."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import floor, log10

import numpy as np

from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.runs import run_bounds


@dataclass(frozen=True, slots=True, eq=False)
class CleanResidual:
    """Residual of one joint on one log, and the samples that count as contact-free evidence.

    Attributes:
        residual_nm: (n,).
        clean: (n,) samples on which the rule can fire, away from events.
        period_s: sample period, s.
        left_out_s: seconds in which the rule can fire, left out because they lie around events.
    """

    residual_nm: FloatArray
    clean: BoolArray
    period_s: float
    left_out_s: float = 0.0
    _level: list[FloatArray] = field(default_factory=list, init=False, repr=False)  # not taken over by replace()
    _runs: list[tuple[IntArray, IntArray]] = field(default_factory=list, init=False, repr=False)

    def windows_by_block(self, n: int, length: int) -> IntArray:
        """(b,) how many windows of n samples that all count begin in each block of so many samples."""
        starts, stops = self._clean_runs()
        last = stops - (n - 1)  # the sample after the last that begins one
        starts, last = starts[last > starts], last[last > starts]
        edges = length * np.arange(-(-(self.clean.size - n + 1) // length) + 1)
        count = np.append(0, np.cumsum(last - starts))
        run = np.searchsorted(starts, edges, side="right")  # so many begin before an edge; the last may go on behind it
        return np.asarray(np.diff(count[run] - np.maximum(np.append(0, last)[run] - edges, 0)))

    def _clean_runs(self) -> tuple[IntArray, IntArray]:
        if not self._runs:
            self._runs.append(run_bounds(self.clean & ~np.isnan(self.residual_nm)))
        return self._runs[0]

    def level_nm(self) -> FloatArray:
        """(n,) |residual|, -inf where a sample does not count; formed once for all persistences."""
        if not self._level:
            self._level.append(np.where(self.clean, np.abs(self.residual_nm), -np.inf))
        return self._level[0]


def round_up(level_nm: float) -> float:
    """Two significant digits, upwards; a level that has no more stays as it is."""
    if not level_nm > 0:
        return 0.0
    step = 10.0 ** (floor(log10(level_nm)) - 1)
    steps = level_nm / step
    return float(f"{(round(steps) if abs(steps - round(steps)) < 1e-9 else floor(steps) + 1) * step:.6g}")
