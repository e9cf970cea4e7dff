"""What motion, load and phases the evidence covers, and how much of a judged log lies beyond."""

from __future__ import annotations

import numpy as np

from collaudit.core.data.recommendation_result import RangeOfEvidence
from collaudit.core.data.signals import State
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.stats import quantile_of
from collaudit.core.recommend.arm_evidence import ArmEvidence, LogEvidence

#: The range leaves out this share of the evidence at each end: a moment at some speed is no evidence for it.
_TAIL = 1e-3
_STEP_S = 0.02
#: Slower is rest: noise of a velocity changes its sign.
_MOVING_RAD_S = 1e-3


def ranges_of_evidence(evidence: ArmEvidence) -> dict[str, RangeOfEvidence]:
    """The range of every joint that has clean time."""
    known = {joint: range_of_evidence(evidence, joint) for joint in evidence.joints}
    return {joint: found for joint, found in known.items() if found is not None}


def range_of_evidence(evidence: ArmEvidence, joint: str) -> RangeOfEvidence | None:
    """The range of one joint over all logs; None without clean time."""
    parts = [_of_log(log, joint) for log in evidence.logs if joint in log.watched]
    speed, turn, load = (np.concatenate([part[k] for part in parts]) if parts else np.empty(0) for k in range(3))
    if speed.size == 0:
        return None
    weights = [log.period_s for log in evidence.logs if joint in log.watched]
    seconds = sum(part[0].size * w for part, w in zip(parts, weights, strict=True))
    phases: dict[str, float] = {}
    for log, weight in zip([log for log in evidence.logs if joint in log.watched], weights, strict=True):
        for phase, samples in _phases(log, joint).items():
            phases[phase] = phases.get(phase, 0.0) + samples * weight / seconds
    standing = sum(part[4] * w for part, w in zip(parts, weights, strict=True)) / seconds
    heat = [log.temperature_c[joint] for log in evidence.logs if joint in log.watched and joint in log.temperature_c]
    reversals = (sum(part[3] for part in parts), seconds / 3600.0)
    return range_of_samples(speed, turn, load, reversals, standing, phases, np.array(heat).ravel())


def range_of_samples(
    speed: FloatArray,
    turn: FloatArray,
    load: FloatArray,
    reversals: tuple[int, float],
    standing: float,
    phases: dict[str, float],
    temperature_c: FloatArray | None = None,
) -> RangeOfEvidence:
    """The range that samples cover.

    Args:
        speed, turn, load: (n,) |velocity| in rad/s, |acceleration| in rad/s², modelled torque in N·m.
        reversals: changes of direction, and in how many hours.
        standing, phases: as of :class:`RangeOfEvidence`.
        temperature_c: (n,) °C, NaN where not known; None without.
    """
    known = np.empty(0) if temperature_c is None else temperature_c[np.isfinite(temperature_c)]
    return RangeOfEvidence(
        fastest_rad_s=quantile_of(speed, 1 - _TAIL),
        hardest_rad_s2=quantile_of(turn, 1 - _TAIL),
        least_nm=quantile_of(load, _TAIL),
        most_nm=quantile_of(load, 1 - _TAIL),
        reversals=reversals[0],
        standing=standing,
        phases=phases,
        temperature_c=(float(known.min()), float(known.max())) if known.size else None,
        reversals_per_h=reversals[0] / reversals[1] if reversals[1] > 0 else None,
    )


def reversals_at(velocity_rad_s: FloatArray) -> IntArray:
    """Samples at which (n,) velocities have changed their direction, rest left out."""
    moving = np.flatnonzero(np.abs(velocity_rad_s) > _MOVING_RAD_S)
    sign = np.sign(velocity_rad_s[moving])
    return np.asarray(moving[1:][sign[1:] != sign[:-1]], dtype=np.int64)


def reversals_of(velocity_rad_s: FloatArray) -> int:
    """Number of changes of direction of (n,) velocities, rest left out."""
    return int(reversals_at(velocity_rad_s).size)


def acceleration(velocity_rad_s: FloatArray, period_s: float) -> FloatArray:
    """(n,) |acceleration| over 40 ms; 0 where velocity is not known."""
    step = max(1, round(_STEP_S / period_s))
    out = np.zeros(velocity_rad_s.size)
    if velocity_rad_s.size > 2 * step:
        out[step:-step] = np.abs(velocity_rad_s[2 * step :] - velocity_rad_s[: -2 * step]) / (2 * step * period_s)
    return np.nan_to_num(out)


def _of_log(log: LogEvidence, joint: str) -> tuple[FloatArray, FloatArray, FloatArray, int, int]:
    """Speed, acceleration and load of the clean samples, changes of direction, and samples at rest."""
    k = log.signals.joint_names.index(joint)
    clean: BoolArray = log.clean[:, k]
    velocity = log.signals.velocity_rad_s[:, k]
    load = log.signals.model_nm[clean, k]
    reversals = reversals_of(velocity[clean])
    standing = int(np.count_nonzero(log.signals.state[clean, k] == State.FRICTION_INTERVAL))
    turn = acceleration(velocity, log.period_s)[clean]
    return np.abs(np.nan_to_num(velocity[clean])), turn, np.nan_to_num(load), reversals, standing


def _phases(log: LogEvidence, joint: str) -> dict[str, int]:
    k = log.signals.joint_names.index(joint)
    out: dict[str, int] = {}
    for span in log.phases:
        a, b = np.searchsorted(log.signals.time_s, [span.start_s, span.end_s])
        out[span.phase] = out.get(span.phase, 0) + int(np.count_nonzero(log.clean[a:b, k]))
    return {phase: samples for phase, samples in out.items() if samples}
