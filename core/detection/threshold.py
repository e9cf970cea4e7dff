"""The level that a residual has to exceed: gamma; an automatic one is raised by what is known to be uncertain."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from collaudit.core.data.audit_result import RuleFacts
from collaudit.core.data.signals import State
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.parallel import each
from collaudit.core.residual.residual import Residual

#: What raises a threshold does so in steps of at most this share of it: a slow change then takes no room in a file.
_STEP = 1.0 / 256.0


def gamma_in_force(series: UniformSeries, residual: Residual, rule: RuleFacts) -> NDArray[np.float32]:
    """(n, j) threshold of each sample, N·m; NaN of a joint without one. Nothing lowers it.

    A stated one is constant, as stated. In 32 bits, as ``signals.parquet`` keeps it: whoever compares with it there
    compares with what was applied.

    Args:
        series: the judged joints.
        residual: what it may be wrong by raises a threshold.
        rule: thresholds; what comes on top where friction is an interval.
    """
    n, joints = residual.torque_nm.shape
    out = np.empty((n, joints), np.float32, order="F")

    def fill(j: int) -> None:
        joint = series.joint_names[j]
        gamma, extra = rule.gamma_nm.get(joint, np.nan), rule.at_rest_nm.get(joint, 0.0)
        raised = residual.uncertainty_nm[:, j]
        if extra > 0.0:
            raised = np.where(residual.state[:, j] == State.FRICTION_INTERVAL, raised + extra, raised)
        automatic = joint in rule.motion_nm or joint in residual.still
        out[:, j] = gamma + _whole_steps(raised, gamma) if automatic else gamma

    each(fill, range(joints))
    return out


def _whole_steps(raised_nm: FloatArray, gamma_nm: float) -> FloatArray:
    """(n,) rounded up to multiples of a power of two."""
    step = 2.0 ** np.floor(np.log2(_STEP * gamma_nm))
    return np.asarray(step * np.ceil(raised_nm / step))
