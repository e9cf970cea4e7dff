"""Momentum form of the dynamics, batched: everything a causal engine needs, and no acceleration.

p = M(q) v is inverse dynamics without gravity and velocity. C(q, v)^T v follows from dM/dt = C + C^T:
C^T v = (dM/dt) v - C v, and (dM/dt) v is the derivative of M(q) w along q at constant w = v, taken as a forward
difference, for which the momentum itself is one end. Over a step of 1e-7 s its error is about 1e-7 of the term from
the step, and 1e-8 N·m from rounding.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from collaudit.core.robot.robot import RobotModel
from collaudit.core.series import FloatArray

_STEP_S = 1e-7
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
        still = np.zeros_like(speed)
        momentum = light.inverse_dynamics(at, still, speed)
        change = light.inverse_dynamics(at + _STEP_S * speed, still, speed) - momentum
        out.momentum[block] = momentum
        out.rest_nm[block] = change / _STEP_S - robot.inverse_dynamics(at, speed, still)
    return out
