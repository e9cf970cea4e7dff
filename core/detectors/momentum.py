"""Momentum form of the dynamics, batched: everything a causal engine needs, and no acceleration.

p = M(q) v is inverse dynamics without gravity and velocity. C(q, v)^T v follows from dM/dt = C + C^T:
C^T v = (dM/dt) v - C v, and (dM/dt) v is the derivative of M(q) w along q at constant w = v, taken as a central
difference over a step of time so small that its error stays below 1e-6 of the term.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from collaudit.core.robot.robot import RobotModel
from collaudit.core.series import FloatArray

_STEP_S = 1e-4


@dataclass(frozen=True, slots=True, eq=False)
class MomentumTerms:
    """Attributes: momentum: (n, j) p = M(q) v, N·m·s. rest_nm: (n, j) C(q, v)^T v - G(q), N·m."""

    momentum: FloatArray
    rest_nm: FloatArray


def momentum_terms(robot: RobotModel, q: FloatArray, v: FloatArray) -> MomentumTerms:
    """Momentum and its velocity and gravity terms at (n, j) positions and velocities (NaN gives NaN).

    Raises:
        NotJudgedError: the model has no inertials.
    """
    still = np.zeros_like(v)
    p = _mass_times(robot, q, v)
    change = (_mass_times(robot, q + _STEP_S * v, v) - _mass_times(robot, q - _STEP_S * v, v)) / (2.0 * _STEP_S)
    return MomentumTerms(p, change - robot.inverse_dynamics(q, v, still))


def _mass_times(robot: RobotModel, q: FloatArray, w: FloatArray) -> FloatArray:
    """M(q) w: inverse dynamics at rest less gravity."""
    still = np.zeros_like(w)
    out: FloatArray = robot.inverse_dynamics(q, still, w) - robot.inverse_dynamics(q, still, still)
    return out
