"""How long a push must last to alarm, by its height: by how much a kernel makes rule (6) inexact."""

from __future__ import annotations

import math

import numpy as np

from collaudit.core.data.detection_result import ShortestPush
from collaudit.core.numeric.arrays import BoolArray, IntArray, Span
from collaudit.core.numeric.kernel import Kernel
from collaudit.core.numeric.runs import run_bounds

#: Heights of the pushes, in thresholds.
RATIOS = (1.3, 2.0, 4.0)


def shortest_pushes(kernel: Kernel, n: int, period_s: float) -> tuple[ShortestPush, ...]:
    """Shortest rectangular push of each height whose smoothed torque lies above gamma for ``n`` samples in a row.

    Args:
        kernel: of the detector; the torque of the motion passes the filters of the signals besides.
        n: persistence, samples.
        period_s: sample period, s.
    """
    around = max(16, math.ceil(4.0 * kernel.settle_s / period_s))
    longest = n + around

    def alarms(length: IntArray) -> BoolArray:
        """(k, ratios) whether pushes of these lengths (k,), in samples, alarm."""
        pushes = np.zeros((2 * around + longest, length.size))
        pushes[around:-around] = np.arange(longest)[:, None] < length
        smoothed = kernel.apply(pushes, [Span(0, len(pushes))], period_s)
        found = [[_longest_run(column > 1.0 / ratio) >= n for ratio in RATIOS] for column in smoothed.T]
        return np.array(found)

    # A longer push alarms where a shorter one does: lengths in steps first, then those of one step.
    step = math.isqrt(longest)
    coarse = np.append(np.arange(step, longest, step), longest)
    lasting = {k: int(coarse[column.argmax()]) for k, column in enumerate(alarms(coarse).T) if column.any()}
    if not lasting:
        return ()
    fine = np.unique(np.concatenate([np.arange(length - step, length) + 1 for length in lasting.values()]))
    found = alarms(fine[fine > 0]).T
    return tuple(ShortestPush(RATIOS[k], float(fine[fine > 0][found[k].argmax()]) * period_s) for k in lasting)


def _longest_run(mask: BoolArray) -> int:
    starts, stops = run_bounds(mask)
    return int((stops - starts).max(initial=0))
