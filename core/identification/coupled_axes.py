"""Friction and drive inertia of axes that turn with several joints, from what the model leaves on these joints.

On joint j with weight w the motor of a coupled axis leaves w (F_c sgn s + F_v s + I ds/dt), s the axis' speed; beside
it stand each joint's own friction and offset as ``problem_terms.py`` has them, so that what its own speed explains is
its own. One weighted least squares over all joints of all axes (iterated Huber weights), covariance by stretches of
one second as in ``solution_errors.py``. Friction dissipates: what would be negative is held at zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from collaudit.core.config.schema import Config
from collaudit.core.data.identification_result import CoupledFriction, Coupling
from collaudit.core.errors import NotJudgedError
from collaudit.core.findings import Finding, fact
from collaudit.core.identification.problem.identification_samples import Motion, collect
from collaudit.core.identification.problem.problem_terms import FRICTION_COLUMNS, friction_columns
from collaudit.core.identification.problem.solution_errors import RANK, clustered_covariance
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.stats import HUBER_BOUND, NORMAL_QUANTILE_975, robust_sd
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.torque_table.block_sums import generalised_inverse

_KEYS = ("coulomb_nm", "viscous_nm_s_per_rad", "inertia_kg_m2")
_ROUNDS = 8
_LEAST_OWN_SHARE = 1e-3  # of a column's power that the other columns must leave


@dataclass(frozen=True, slots=True, eq=False)
class _System:
    """All equations in one: rows of every coupled joint one after the other.

    Attributes:
        columns: (m, 3 c + others): the shared ones of each axis first.
        target: (m,) torque that the model leaves, N·m.
        joint: (m,) joint of each row.
        cluster: (m,) stretch of one second of each row.
    """

    columns: FloatArray
    target: FloatArray
    joint: IntArray
    cluster: IntArray


def fit_coupled(
    prepared: Sequence[Prepared], config: Config, with_inertia: bool
) -> tuple[dict[str, CoupledFriction], list[Finding]]:
    """Fit every coupled axis of an arm; empty without one, or where nothing can be told, which is said.

    Args:
        prepared: logs of the arm, calibrated so far.
        config: how many samples are used.
        with_inertia: whether the drive's inertia on the axis is to be identified, as other inertias are.
    """
    couplings = prepared[0].series.couplings
    if not couplings:
        return {}, []
    if any(p.rigid_nm is None or p.series.effort is None or p.series.effort_unit != "Nm" for p in prepared):
        return {}, [_undetermined(c, "model torque and effort in N·m are needed") for c in couplings]
    try:
        motion = collect(prepared, config.fit.max_samples, config.fit.blocks, inertials=False)
    except NotJudgedError as error:
        return {}, [_undetermined(c, error.message) for c in couplings]
    weights = motion.coupled
    rigid = prepared[0].robot.inverse_dynamics(motion.position, motion.velocity, motion.acceleration)
    if not motion.moving[:, (motion.coupled != 0).any(axis=0)].any():
        return {}, [_undetermined(c, "its joints do not move") for c in couplings]
    system = _system(motion, motion.effort - motion.contact - rigid, weights)
    determined = _determined(system, len(couplings), with_inertia)
    fits: dict[str, CoupledFriction] = {}
    findings = []
    values, spread = _solved(system, determined)
    for c, coupling in enumerate(couplings):
        if not determined[3 * c : 3 * c + 2].all():
            findings.append(_undetermined(coupling, "its motion cannot be separated from that of the joints"))
            continue
        s = np.abs(motion.velocity @ weights[c])[motion.moving[:, weights[c] != 0].any(axis=1)]
        fit = _result(coupling, values[3 * c : 3 * c + 3], spread[3 * c : 3 * c + 3], s, with_inertia)
        fits[coupling.joint] = fit
        findings.append(_said(coupling, fit))
    return fits, findings


def _system(motion: Motion, rest: FloatArray, weights: FloatArray) -> _System:
    touched = np.flatnonzero((weights != 0).any(axis=0) & motion.moving.any(axis=0))
    count, own = weights.shape[0], FRICTION_COLUMNS
    blocks, target, joint, cluster = [], [], [], []
    for k, j in enumerate(touched):
        rows = np.flatnonzero(motion.moving[:, j])
        part = np.zeros((rows.size, 3 * count + own * touched.size))
        for c in np.flatnonzero(weights[:, j]):
            s, ds = motion.velocity[rows] @ weights[c], motion.acceleration[rows] @ weights[c]
            part[:, 3 * c : 3 * c + 3] = weights[c, j] * np.column_stack([np.sign(s), s, ds])
        at = 3 * count + own * k
        part[:, at : at + own] = friction_columns(motion.velocity[rows, j], motion.acceleration[rows, j])
        blocks.append(part)
        target.append(rest[rows, j])
        joint.append(np.full(rows.size, k))
        cluster.append(motion.cluster[rows])
    return _System(*(np.concatenate(x) for x in (blocks, target, joint, cluster)))


def _determined(system: _System, count: int, with_inertia: bool) -> BoolArray:
    """(columns,) which columns are used: shared ones that the others do not explain, and all others."""
    use = np.ones(system.columns.shape[1], dtype=np.bool_)
    if not with_inertia:
        use[2 : 3 * count : 3] = False
    for k in range(3 * count):
        if use[k]:
            others = use.copy()
            others[k] = False
            column, rest = system.columns[:, k], system.columns[:, others]
            left = column - rest @ np.linalg.lstsq(rest, column, rcond=1e-9)[0]
            use[k] = bool(left @ left > _LEAST_OWN_SHARE * (column @ column)) and bool(column @ column > 0)
    return use


def _solved(system: _System, use: BoolArray) -> tuple[FloatArray, FloatArray]:
    """Coefficients and half widths of their 95 % intervals, (columns,); zero where a column is not used."""
    use = use.copy()
    shared = np.arange(use.size) < use.size - 7 * (int(system.joint.max()) + 1)
    while True:
        x, half = _least_squares(system, use)
        negative = shared & use & (x < 0)
        if not negative.any():
            return x, half
        use &= ~negative


def _least_squares(system: _System, use: BoolArray) -> tuple[FloatArray, FloatArray]:
    columns, pick = system.columns[:, use], np.flatnonzero(use)
    weight = np.ones(system.target.size)
    sigma = np.ones_like(weight)
    x: FloatArray = np.zeros(pick.size)
    for _ in range(_ROUNDS):
        root = np.sqrt(weight) / sigma
        x = np.asarray(np.linalg.lstsq(columns * root[:, None], system.target * root, rcond=1e-9)[0])
        rest = system.target - columns @ x
        for k in range(int(system.joint.max()) + 1):
            sigma[system.joint == k] = max(robust_sd(rest[system.joint == k]), 1e-4)
        weight = np.minimum(1.0, HUBER_BOUND / np.maximum(np.abs(rest) / sigma, 1e-9))
    slope = (np.abs(rest) <= HUBER_BOUND * sigma) / sigma**2
    inverse = generalised_inverse((columns * slope[:, None]).T @ columns, RANK)
    felt = columns @ inverse
    influence = _summed(felt * (weight * rest / sigma**2)[:, None], system.cluster)
    share = _summed(felt**2 * slope[:, None], system.cluster)
    full = clustered_covariance(influence, share)
    out, half = np.zeros(use.size), np.zeros(use.size)
    out[pick] = x
    half[pick] = NORMAL_QUANTILE_975 * np.sqrt(np.maximum(np.diag(full), 0.0))
    return out, half


def _summed(values: FloatArray, cluster: IntArray) -> FloatArray:
    """(clusters, k) sums of (m, k) values."""
    order = np.argsort(cluster, kind="stable")
    starts = np.flatnonzero(np.diff(cluster[order], prepend=-1))
    return np.asarray(np.add.reduceat(values[order], starts, axis=0))


def _result(coupling: Coupling, x: FloatArray, half: FloatArray, s: FloatArray, with_inertia: bool) -> CoupledFriction:
    low, high = (float(v) for v in np.quantile(s, [0.01, 1.0]))
    keys = _KEYS if with_inertia else _KEYS[:2]
    return CoupledFriction(
        weights=coupling.weights,
        coulomb_nm=float(x[0]),
        viscous_nm_s_per_rad=float(x[1]),
        inertia_kg_m2=float(x[2]) if with_inertia else None,
        ci95={key: (float(v - h), float(v + h)) for key, v, h in zip(keys, x, half, strict=False)},
        speed_range_rad_s=(low, high),
        samples=int(s.size),
    )


def _undetermined(coupling: Coupling, why: str) -> Finding:
    text = (
        f"The friction of the coupled axis {coupling.words} could not be determined: {why}. It stays in the "
        "friction of the "
        "single joints."
    )
    return Finding("fit-doubtful", "warning", text, joint=coupling.joint)


def _said(coupling: Coupling, fit: CoupledFriction) -> Finding:
    (low, high), (slow, fast) = fit.ci95["coulomb_nm"], fit.ci95["viscous_nm_s_per_rad"]
    text = (
        f"The axis {coupling.words} has friction of its own: {fit.coulomb_nm:.3g} N·m (95 %: {low:.3g} to {high:.3g}) "
        f"and {fit.viscous_nm_s_per_rad:.3g} N·m·s/rad ({slow:.3g} to {fast:.3g}). It is subtracted from the effort."
    )
    return fact(text, joint=coupling.joint)
