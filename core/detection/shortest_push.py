"""How long a push must last to alarm, by its height: by how much a kernel makes rule (6) inexact."""

from __future__ import annotations

import math

import numpy as np

from collaudit.core.data.detection_result import ShortestPush
from collaudit.core.numeric.arrays import Span
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
    length = np.arange(1, longest + 1)
    pushes = np.zeros((2 * around + longest, length.size))
    pushes[around:-around] = np.arange(longest)[:, None] < length
    smoothed = kernel.apply(pushes, [Span(0, len(pushes))], period_s)
    out = []
    for ratio in RATIOS:
        alarms = [k for k in range(length.size) if _longest_run(smoothed[:, k] > 1.0 / ratio) >= n]
        if alarms:
            out.append(ShortestPush(ratio, float(length[alarms[0]]) * period_s))
    return tuple(out)


def _longest_run(mask: np.ndarray) -> int:
    starts, stops = run_bounds(mask)
    return int((stops - starts).max(initial=0))
