"""The combined statistic: the norm of all joints' residuals, each in units of its own noise, through a slow filter."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from collaudit.core.config.schema import DetectConfig
from collaudit.core.data.signals import State
from collaudit.core.errors import ConfigError
from collaudit.core.numeric.arrays import FloatArray, IntArray
from collaudit.core.numeric.stats import robust_sd
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.residual.balance import balance_from_acceleration
from collaudit.core.residual.detector import Detector
from collaudit.core.residual.detectors.direct import direct_kernel
from collaudit.core.residual.isolation import WholeArm
from collaudit.core.residual.residual import Residual, ResidualInputs, joint_residuals

#: Contacts of people and fixtures lie below, most errors of friction and ripple above.
_BANDWIDTH_HZ = 4.0
#: A joint without noise would outvote all others.
_LEAST_NOISE_NM = 1e-3
#: The joint is named by what it shows in this time from the onset.
_LOOK_S = 0.2


def combined_residual(prepared: Prepared, inputs: ResidualInputs, config: DetectConfig) -> Residual:
    """The norm in each column, in N·m of that column's joint: s · noise of the joint.

    Args:
        prepared: the log.
        inputs: friction laws, joints that contradict the model.
        config: friction interval and level.

    Raises:
        ConfigError: a causal residual is asked for.
    """
    if config.causal:
        raise ConfigError(
            "the detector 'combined' looks both ways in time",
            where="[detect] causal",
            found="true",
            expected="false, or another detector",
        )
    kernel = direct_kernel(_BANDWIDTH_HZ, causal=False)
    inputs = replace(inputs, covered={})  # its noise is that of this log, and covers nothing
    by_joint = joint_residuals(prepared, balance_from_acceleration(prepared, kernel), inputs, config)
    state, torque = by_joint.state, by_joint.torque_nm
    evidence = np.asarray((state <= State.FRICTION_INTERVAL) & np.isfinite(torque))
    noise = np.array([_noise(torque[state[:, j] == State.JUDGED, j]) for j in range(torque.shape[1])])
    beyond = np.sign(torque) * np.maximum(np.abs(torque) - by_joint.uncertainty_nm, 0.0)
    share = np.where(evidence, beyond, 0.0) / noise
    in_nm = np.where(np.isfinite(noise), noise, np.nan)  # no torque of a joint that is judged nowhere
    known = np.count_nonzero((state == State.JUDGED) | (share != 0.0), axis=1)
    norm = excess_norm(np.sum(share**2, axis=1), known)
    somewhere = np.any(evidence, axis=1, keepdims=True)
    shown = np.where(somewhere & (state > State.FRICTION_INTERVAL), np.int8(State.FRICTION_INTERVAL), state)
    series = prepared.judged_series
    return replace(
        by_joint,
        torque_nm=np.asfortranarray(np.where(somewhere, norm[:, None] * in_nm, np.nan)),
        state=np.asfortranarray(shown.astype(np.int8)),
        uncertainty_nm=np.zeros_like(torque),
        isolation=WholeArm(series.joint_names, noise, share, max(1, round(_LOOK_S / series.period_s))),
    )


def excess_norm(squares: FloatArray, joints: IntArray) -> FloatArray:
    """(n,) root of a sum of squares less what noise adds on the average of so many joints but one.

    A push on one joint keeps its size, whether that joint moves alone or all do.
    """
    return np.sqrt(np.maximum(squares - np.maximum(joints - 1, 0), 0.0))


def _noise(judged_nm: FloatArray) -> float:
    """Robust standard deviation of a residual; contacts, which are rare, do not move it."""
    known = judged_nm[np.isfinite(judged_nm)]
    return max(_LEAST_NOISE_NM, robust_sd(known - np.median(known)) if known.size else np.inf)


DETECTOR = Detector(
    name="combined",
    equation="r = sd sqrt(sum (r_i/sd_i)^2 - (k - 1)), r_i as of direct at 4 Hz with zero phase, sd the robust "
    "standard deviation of each over the log, k the number of joints that are judged",
    source="norm of the residuals in units of their noise, as of Mahalanobis with a diagonal covariance",
    residual=combined_residual,
    by_joint=False,
)
