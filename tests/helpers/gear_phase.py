"""Logs of one arm from simulated logs: the simulator draws the place of each gear's ripple anew for every log.

An arm keeps its ripple in place unless a joint is opened or counts from another zero. Where a log does not have the
ripple of the friction file at its place, `detect` raises the threshold by the ripple's amplitude instead.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from collaudit.core.data.audit_result import Audit, FrictionFile
from collaudit.core.data.signals import State
from collaudit.core.friction.gear_ripple import ripple_torque
from collaudit.core.numeric.arrays import Span
from collaudit.core.numeric.filters import BOTH_WAYS, double_pole


def waves(audit: Audit, friction: FrictionFile, j: int, bandwidth_hz: float) -> np.ndarray | None:
    """(n, 2) ripple of the file as the offline `direct` residual of the joint has it, in place and a quarter ahead."""
    signals = audit.signals
    known = friction.corrections.get(signals.joint_names[j])
    if known is None or not known.ripple:
        return None
    ahead = tuple(
        replace(w, same_nm=(w.same_nm[1], -w.same_nm[0]), against_nm=(w.against_nm[1], -w.against_nm[0]))
        for w in known.ripple
    )
    kernel = double_pole(2.0 * np.pi * bandwidth_hz / BOTH_WAYS, False)
    q, dq = np.nan_to_num(signals.position_rad[:, j]), np.nan_to_num(signals.velocity_rad_s[:, j])
    both = np.column_stack([ripple_torque(w, q, dq) for w in (known.ripple, ahead)])
    return np.asarray(kernel.apply(both, (Span(0, q.size),), audit.result.log.sample_period_s))


def in_place(audit: Audit, friction: FrictionFile, bandwidth_hz: float = 20.0) -> tuple[Audit, np.ndarray]:
    """The audit as if the arm had its ripple where the file has it, and what `detect` raised each threshold by, N·m."""
    signals, raised = audit.signals, np.zeros(len(audit.signals.joint_names))
    residual = signals.residual_nm.copy()
    for j, joint in enumerate(signals.joint_names):
        both = waves(audit, friction, j, bandwidth_hz)
        if both is None:
            continue
        rows = (signals.state[:, j] == State.JUDGED) & np.isfinite(residual[:, j])
        found = np.linalg.lstsq(both[rows], residual[rows, j], rcond=None)[0]
        ripple = both @ found
        residual[:, j] -= ripple
        between = (signals.state[:, j] == State.FRICTION_INTERVAL) & np.isfinite(ripple)
        if signals.least_nm is not None and signals.most_nm is not None:
            least, most = signals.least_nm[between, j] - ripple[between], signals.most_nm[between, j] - ripple[between]
            residual[between, j] = np.maximum(least, 0.0) + np.minimum(most, 0.0)
        # What was taken off leaves in place and quarter on a circle about (-1, 0); what was not, about (0, 0).
        taken_off = abs(np.hypot(found[0] + 1.0, found[1]) - 1.0) < abs(np.hypot(*found) - 1.0)
        known = friction.corrections[joint].ripple
        amplitude = sum(float(np.hypot(*w.same_nm) + np.hypot(*w.against_nm)) for w in known)
        raised[j] = 2.0 * float(np.sqrt(sum(w.sd_nm**2 for w in known))) if taken_off else amplitude
    return replace(audit, signals=replace(signals, residual_nm=residual)), raised
