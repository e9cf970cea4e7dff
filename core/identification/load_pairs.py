"""Drive gains from logs that differ by a known load, whatever the arm's own inertials are.

For joint j of log a:  effort_j = k_j (Y_j pi) + k_j tau_a,j + friction_a,j + noise, with the torque tau_a of the
log's known load. Y_j pi with any pi, and friction and offset of each log by itself, are projected out: no error of the
robot's inertials and no warm-up between the logs reaches k_j. What is left of tau_a,j is what the loads differ by.
Friction that grows with the load has the sign of the motion: sgn v |tau_a,j| is projected out, too.
"""

from __future__ import annotations

import numpy as np
from scipy.special import stdtrit as student_quantile

from collaudit.core.identification.problem.problem_terms import FRICTION_COLUMNS, Terms
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.stats import HUBER_BOUND, STANDARD_ERRORS_95, robust_sd

#: A gain is told when its standard error is below this share of it; share of the load's torque that is left at least.
_SHOWN, _LEFT = 0.1, 1e-3
_ROUNDS, _MOST = 5, 0.9
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
        found = _gain(terms, load_nm[:, j], log, j, use)
        if found is not None and found[1] < _SHOWN * abs(found[0]):
            gain[j], sd[j] = found
    return gain, sd


def _gain(terms: Terms, load: FloatArray, log: IntArray, j: int, use: BoolArray) -> tuple[float, float] | None:
    motion = terms.motion
    sliding = np.sign(motion.velocity[:, j]) * np.abs(load)
    own = motion.regressor[:, j][:, np.any(motion.regressor[:, j] != 0.0, axis=0)]
    law, drift = terms.nuisance[j][:, :FRICTION_COLUMNS], terms.nuisance[j][:, FRICTION_COLUMNS:]
    laws = [law * (log == k)[:, None] for k in np.unique(log[use])]
    others = np.column_stack([own, sliding, motion.acceleration[:, j], drift, *laws])[use]
    others = _scaled(others)
    weight = np.ones(int(use.sum()))
    effort, torque, cluster = motion.effort[use, j], load[use], motion.cluster[use]
    slope = 0.0
    for _ in range(_ROUNDS):
        root = np.sqrt(weight)
        basis = _basis(others * root[:, None])
        free = torque * root - basis @ (basis.T @ (torque * root))
        power = float(free @ free)
        if power < _LEFT * float(torque @ torque):
            return None
        left = effort * root - basis @ (basis.T @ (effort * root))
        slope = float(free @ left) / power
        rest = (left - slope * free) / np.maximum(root, 1e-9)
        weight = np.minimum(1.0, HUBER_BOUND * max(robust_sd(rest), 1e-9) / np.maximum(np.abs(rest), 1e-9))
    _, place = np.unique(cluster, return_inverse=True)
    share = np.bincount(place, free * free) / power
    score = np.bincount(place, free * (left - slope * free)) / power / (1.0 - np.minimum(share, _MOST))
    # Student's t of so few clusters, against the normal one's
    wider = float(student_quantile(max(1.0, 1.0 / float(np.sum(share**2)) - 1.0), 0.975)) / STANDARD_ERRORS_95
    sd = float(np.sqrt(np.sum(score**2))) * wider
    return slope, float(np.hypot(sd, _STATED * slope))


def _scaled(columns: FloatArray) -> FloatArray:
    """The columns that are not zero, each of length one."""
    size = np.linalg.norm(columns, axis=0)
    return np.asarray(columns[:, size > 0] / size[size > 0])


def _basis(columns: FloatArray) -> FloatArray:
    """Orthonormal basis of what the columns span; columns alike count once."""
    values, vectors = np.linalg.eigh(columns.T @ columns)
    keep = values > 1e-9 * values[-1]
    return np.asarray(columns @ (vectors[:, keep] / np.sqrt(values[keep])))
