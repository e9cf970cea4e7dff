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
#: Samples at a time: what is passed on stays in the cache.
_BLOCK = 16384


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
    light = robot.weightless()
    out = MomentumTerms(np.empty_like(v), np.empty_like(v))
    for start in range(0, v.shape[0], _BLOCK):
        block = slice(start, start + _BLOCK)
        at, speed = q[block], v[block]
        still, step = np.zeros_like(speed), _STEP_S * speed
        change = light.inverse_dynamics(at + step, still, speed) - light.inverse_dynamics(at - step, still, speed)
        out.momentum[block] = light.inverse_dynamics(at, still, speed)
        out.rest_nm[block] = change / (2.0 * _STEP_S) - robot.inverse_dynamics(at, speed, still)
    return out
