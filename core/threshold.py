"""The level a residual has to exceed: gamma, raised by what is uncertain about friction."""

from __future__ import annotations

import numpy as np

from collaudit.core.residual import Residual
from collaudit.core.result import RuleFacts
from collaudit.core.series import FloatArray, UniformSeries


def threshold_nm(series: UniformSeries, residual: Residual, rule: RuleFacts) -> FloatArray:
    """(n, j) constant gamma of each joint plus the residual's own uncertainty, N·m; NaN without a gamma."""
    gamma = np.array([rule.gamma_nm.get(joint, np.nan) for joint in series.joint_names])
    return np.asarray(gamma[None, :] + residual.uncertainty_nm)
