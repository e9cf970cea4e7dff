"""Drive gains from logs that differ by a known load, whatever the arm's own inertials are.

For joint j of log a:  effort_j = k_j (Y_j pi) + k_j tau_a,j + friction_a,j + noise, with the torque tau_a of the
log's known load. Y_j pi with any pi, and friction and offset of each log by itself, are projected out: no error of the
robot's inertials and no warm-up between the logs reaches k_j. What is left of tau_a,j is what the loads differ by.
Friction that grows with the load has the sign of the motion: sgn v |tau_a,j| is projected out, too.
"""

from __future__ import annotations

import numpy as np

from collaudit.core.identification.problem.problem_terms import FRICTION_COLUMNS, Terms
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.stats import STANDARD_ERRORS_95
from collaudit.core.torque_table.block_sums import BlockSums, Slope

#: A gain is told when its standard error is below this share of it; share of the load's torque that is left at least.
_SHOWN, _LEFT = 0.1, 0.03
#: A stated mass, and where it is, are right to this share (standard deviation).
_STATED = 0.005


def pair_gains(terms: Terms) -> tuple[FloatArray, FloatArray]:
    """Gains from known loads.

    Args:
        terms: samples and columns of all logs together.

    Returns:
        Gains (j,) and standard errors (j,) such that 1.96 of them span 95 %; NaN and inf where the loads do not tell
        one.
    """
    load_nm, log = terms.motion.load, terms.motion.log
    count = load_nm.shape[1]
    gain, sd = np.full(count, np.nan), np.full(count, np.inf)
    for j in range(count):
        use = terms.motion.moving[:, j]
        if len({float(np.abs(load_nm[log == k, j]).max(initial=0.0)) for k in np.unique(log[use])}) < 2:
            continue
        found = _slope(terms, j)
        if found is not None and found.half < _SHOWN * STANDARD_ERRORS_95 * abs(found.value):
            gain[j], sd[j] = found.value, np.hypot(found.half / STANDARD_ERRORS_95, _STATED * found.value)
    return gain, sd


def _slope(terms: Terms, j: int) -> Slope | None:
    motion, use = terms.motion, terms.motion.moving[:, j]
    load, log = motion.load[:, j], motion.log
    law, drift = terms.nuisance[j][:, :FRICTION_COLUMNS], terms.nuisance[j][:, FRICTION_COLUMNS:]
    others = [
        *(np.sign(motion.velocity[:, j]) * np.abs(load), motion.acceleration[:, j], motion.regressor[:, j], drift),
        *(law * (log == k)[:, None] for k in np.unique(log[use])),
    ]
    columns = np.column_stack([motion.effort[:, j], load, *others])[use]
    names = ("effort", "load", *map(str, range(columns.shape[1] - 2)))
    return BlockSums.of(motion.cluster[use], names, columns).slope(*names, least_own=_LEFT)
