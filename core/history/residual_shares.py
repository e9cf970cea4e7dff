"""How far friction and load of a joint are off the model in one log, by what is left of its residual."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from collaudit.core.history.log_record import Share
from collaudit.core.numeric.arrays import FloatArray

#: One error a block: a stroke of an arm lasts about as long.
_BLOCK_S = 1.0
_FEWEST_BLOCKS = 12
#: Below this share of its size a column cannot be told from the others.
_APART = 1e-3


@dataclass(frozen=True, slots=True)
class ResidualShares:
    """Friction and load in excess of the model, as shares, and a constant torque, N·m."""

    friction: Share
    load: Share | None
    offset: Share


def residual_shares(
    time_s: FloatArray, residual_nm: FloatArray, friction_nm: FloatArray, rigid_nm: FloatArray
) -> ResidualShares | None:
    """Excess of friction and load over the model; None where the motion does not tell friction from the others.

    residual = s·f(v) + l·τ_rigid + c + error, by least squares over clean samples in motion; f is the friction law, odd
    in the direction of motion, τ_rigid the rigid-body torque. Errors last longer than a sample: standard errors are
    those of blocks of time taken together (Liang and Zeger, Biometrika 73, 1986), with blocks less parameters as
    degrees of freedom.

    Args:
        time_s: (n,) of the samples that count; gaps are allowed.
        residual_nm, friction_nm, rigid_nm: (n,) residual, the law's friction, rigid-body torque.
    """
    known = np.isfinite(residual_nm) & np.isfinite(friction_nm) & np.isfinite(rigid_nm)
    time_s, y = time_s[known], residual_nm[known]
    columns = [friction_nm[known], np.ones(y.size), rigid_nm[known]]
    if np.unique(np.floor(time_s / _BLOCK_S)).size < _FEWEST_BLOCKS or not np.any(columns[0]):
        return None
    scale = [max(float(np.sqrt(np.mean(c**2))), 1e-12) for c in columns]
    design = np.column_stack([c / s for c, s in zip(columns, scale, strict=True)])
    if _apart(design[:, :2]) < _APART:
        return None  # it moves one way only: friction looks like a constant torque
    count = 3 if scale[2] >= 1e-6 and _apart(design) > 10.0 * _APART else 2
    design = design[:, :count]
    value, se, freedom = _clustered(design, y, np.floor(time_s / _BLOCK_S))
    shares = [Share(float(v / s), float(e / s), freedom) for v, e, s in zip(value, se, scale, strict=False)]
    return ResidualShares(shares[0], shares[2] if count == 3 else None, shares[1])


def _apart(design: FloatArray) -> float:
    """How far columns of size 1 can be told from one another, as a share of that size."""
    return float(np.linalg.svd(design, compute_uv=False)[-1] / np.sqrt(len(design)))


def _clustered(design: FloatArray, y: FloatArray, owner: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    inverse = np.linalg.inv(design.T @ design)
    value = inverse @ (design.T @ y)
    scores = design * (y - design @ value)[:, None]
    starts = np.flatnonzero(np.diff(owner, prepend=owner[0] - 1.0))
    sums = np.add.reduceat(scores, starts, axis=0)
    blocks, parameters = len(sums), design.shape[1]
    variance = inverse @ (sums.T @ sums) @ inverse * blocks / (blocks - parameters)
    return value, np.sqrt(np.diag(variance)), float(blocks - parameters)
