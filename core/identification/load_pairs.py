"""Drive gains from logs that differ by a known load, whatever the arm's own inertials are.

For joint j of log a:  effort_j = k_j (Y_j pi) + k_j tau_a,j + friction_a,j + noise, with the torque tau_a of the
log's known load. Y_j pi with any pi, and friction and offset of each log by itself, are projected out: no error of the
robot's inertials and no warm-up between the logs reaches k_j. What is left of tau_a,j is what the loads differ by.
Friction that grows with the load has the sign of the motion: sgn v |tau_a,j| is projected out, too.
"""

from __future__ import annotations

import numpy as np

from collaudit.core.identification.motion_sums import MotionSums
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.stats import STANDARD_ERRORS_95
from collaudit.core.torque_table.block_sums import BlockSums, Slope

#: A gain is told when its standard error is below this share of it; share of the load's torque that is left at least.
_SHOWN, _LEFT = 0.1, 0.03
#: A stated mass, and where it is, are right to this share (standard deviation).
_STATED = 0.005


def pair_gains(sums: MotionSums) -> tuple[FloatArray, FloatArray]:
    """Gains from known loads.

    Args:
        sums: of all logs together.

    Returns:
        Gains (j,) and standard errors (j,) such that 1.96 of them span 95 %; NaN and inf where the loads do not tell
        one.
    """
    joints, load = sums.count.shape[1], sums.parts["load"]
    gain, sd = np.full(joints, np.nan), np.full(joints, np.inf)
    for j in range(joints):
        if np.unique(sums.log[sums.count[:, j] > 0]).size < 2 or not sums.raw[:, j, load, load].any():
            continue
        found = _slope(sums, j)
        if found is not None and found.half < _SHOWN * STANDARD_ERRORS_95 * abs(found.value):
            gain[j], sd[j] = found.value, np.hypot(found.half / STANDARD_ERRORS_95, _STATED * found.value)
    return gain, sd


def _slope(sums: MotionSums, j: int) -> Slope | None:
    """Of the effort on the load, beside what any arm needs and a law of friction for each log."""
    whole = sums.of(j, "effort", "load", "spin", "base", "axes", "angle", "drift", "law")
    first, logs = whole.names.index("law 0"), np.unique(sums.log)
    laws = len(whole.names) - first
    wider = np.zeros((len(whole.count), len(whole.names), first + laws * logs.size))
    wider[:, range(first), range(first)] = 1.0
    for number, k in enumerate(logs):
        its = np.arange(laws)
        wider[np.ix_(sums.log == k, first + its, first + laws * number + its)] = np.eye(laws)
    names = (*whole.names[:first], *(f"law {k}" for k in range(laws * logs.size)))
    every = BlockSums(names, np.swapaxes(wider, 1, 2) @ whole.products @ wider, whole.count)
    return every.slope(*names[1:], least_own=_LEFT)
