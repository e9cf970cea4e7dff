"""Audits made of given residuals: what recommendations rest on, without a log or an arm."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from samples import failed

from collaudit.core.data.audit_result import Audit
from collaudit.core.data.signals import Signals, State


def audit_of(
    residual_nm: np.ndarray,
    *,
    velocity_rad_s: np.ndarray | None = None,
    gamma_nm: float | Sequence[float] = 4.0,
    period_s: float = 0.002,
    name: str = "made.mcap",
    n: int = 13,
) -> Audit:
    """An audit of (n, j) residuals, all of them judged, without events; joints are joint1, joint2, ….

    Args:
        residual_nm: (n, j).
        velocity_rad_s: (n, j); zeros when absent.
        gamma_nm: the rule's thresholds, one or one a joint.
        period_s, name, n: of log and rule.
    """
    joints = tuple(f"joint{k + 1}" for k in range(residual_nm.shape[1]))
    speed = np.zeros_like(residual_nm) if velocity_rad_s is None else velocity_rad_s
    zeros = np.zeros_like(residual_nm)
    gamma = np.broadcast_to(np.asarray(gamma_nm, dtype=float), (len(joints),)).copy()
    state = np.full(residual_nm.shape, State.JUDGED, dtype=np.int8)
    time_s = np.arange(residual_nm.shape[0]) * period_s
    in_force = np.broadcast_to(gamma.astype(np.float32), state.shape)
    signals = Signals(time_s, joints, zeros, speed, residual_nm, zeros, residual_nm, state, in_force, 0.2 * gamma)
    result = failed(5000).result
    rule = replace(
        result.rule,
        gamma_nm=dict(zip(joints, gamma.tolist(), strict=True)),
        near_miss_nm=dict(zip(joints, (0.8 * gamma).tolist(), strict=True)),
        n=n,
        persistence_s=n * period_s,
        persistence_requested_ms=None,
        watch=joints,
    )
    digest = hashlib.sha256(name.encode()).hexdigest()
    log = replace(
        result.log,
        name=name,
        sample_period_s=period_s,
        joints=joints,
        duration_s=float(time_s[-1]),
        sha256=digest,
    )
    result = replace(result, log=log, rule=rule, collisions=(), near_misses=(), contacts=(), phases=(), recommended={})
    return Audit(result, signals)


def coloured(seed: int, seconds: float, joints: int = 1, memory: float = 0.9, period_s: float = 0.002) -> np.ndarray:
    """(n, j) Gaussian noise of standard deviation 1 that forgets by ``memory`` from sample to sample."""
    from scipy.signal import lfilter

    rng = np.random.default_rng(seed)
    noise = rng.standard_normal((round(seconds / period_s), joints))
    return np.asarray(lfilter([np.sqrt(1 - memory**2)], [1, -memory], noise, axis=0))
