"""The record of one audit, and how far friction and load of each joint are off the model in it."""

from __future__ import annotations

from dataclasses import dataclass
from math import floor, log10, sqrt

import numpy as np

from collaudit.core.data.audit_result import Audit, AuditResult
from collaudit.core.data.detection_result import Contact
from collaudit.core.data.friction_result import FrictionFit
from collaudit.core.data.signals import State
from collaudit.core.detection.rule import persistence_samples
from collaudit.core.friction.friction_model import FrictionModel, half_width
from collaudit.core.history.log_record import (
    ContactRecord,
    FindingRecord,
    JointRecord,
    LogRecord,
    NearMissRecord,
    NightFrom,
    ParameterRecord,
    Share,
)
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.recommend.arm_evidence import ArmEvidence, LogEvidence, log_evidence
from collaudit.core.recommend.outlying_peaks import unsuspicious
from collaudit.core.recommend.sustained_levels import LogPeaks, peaks_of_log

#: The tail of the peaks is the highest tenth at most; a log of a bad night may hold more of it than its part.
_KEPT_SHARE, _KEPT_LEAST = 0.25, 30


def record_of(audit: Audit, robot: str, night: str, night_from: NightFrom, judged_h: float) -> LogRecord:
    """What a store keeps of an audit.

    Args:
        audit: result and signals.
        robot: whose log it is.
        night, night_from: the night it counts to, and who says so.
        judged_h: hours judged, as the index counts them.
    """
    result = audit.result
    evidence = ArmEvidence((log_evidence(audit),), result.rule.watch)
    log = unsuspicious(evidence, result.rule.persistence_s).logs[0]
    return LogRecord(
        robot=robot,
        night=night,
        night_from=night_from,
        log=result.log.name,
        log_sha256=result.log.sha256,
        start=result.log.start,
        verdict=result.verdict,
        reasons=result.reasons,
        error=None,
        duration_s=result.log.duration_s,
        period_s=result.log.sample_period_s,
        judged_h=judged_h,
        detector=result.rule.detector,
        persistence_s=result.rule.persistence_s,
        config_sha256=result.provenance.config_sha256,
        friction_sha256=result.provenance.friction_sha256,
        model_sha256=result.provenance.model_sha256,
        collaudit=result.provenance.collaudit,
        joints=tuple(_joint(audit, log, joint) for joint in result.coverage.joints),
        friction=tuple(row for joint, fit in result.friction.items() for row in _parameters(joint, fit)),
        contacts=tuple(_contact(contact) for contact in result.contacts),
        near_misses=tuple(
            NearMissRecord(m.joint, m.onset_s, m.duration_s, m.peak_nm, m.ratio, m.kind) for m in result.near_misses
        ),
        findings=tuple(FindingRecord(f.code, f.severity, f.joint, f.text) for f in result.findings),
    )


def _contact(contact: Contact) -> ContactRecord:
    least = None if contact.least_force is None else contact.least_force.force_n
    return ContactRecord(contact.onset_s, contact.end_s, contact.joints, contact.link, contact.kind, least)


def _joint(audit: Audit, log: LogEvidence, joint: str) -> JointRecord:
    result = audit.result
    coverage, stats = result.coverage.joints[joint], result.residual.get(joint)
    sensitivity = None if result.sensitivity is None else result.sensitivity.joints.get(joint)
    asked = None if sensitivity is None else sensitivity.asked
    law, speed, bounds = _law(result.friction.get(joint))
    shares, level = _shares(audit, log, joint), _level(result, joint)
    friction, load, offset = (None, None, None) if shares is None else (shares.friction, shares.load, shares.offset)
    peaks, count = _kept(_peaks(log, joint, result))
    recommended = result.recommended.get(joint)
    gamma = result.rule.gamma_nm.get(joint)
    largest = None if recommended is None else recommended.largest_clean_nm
    return JointRecord(
        joint=joint,
        watched=coverage.watched,
        gamma_nm=gamma,
        n=result.rule.n,
        judged_s=coverage.judged_s,
        detectable_s=coverage.judged_s if asked is None else asked.noticed_s,
        observed_s=coverage.judged_s + coverage.standing_s + sum(coverage.not_judged_s.values()),
        clean_s=0.0 if stats is None else stats.clean_s,
        rms_nm=None if stats is None else stats.rms_nm,
        p99_nm=None if stats is None else stats.p99_nm,
        clean_mean_abs_nm=None if stats is None else stats.clean_mean_abs_nm,
        gamma_margin=gamma / largest if gamma and largest else None,
        temperature_c=None if stats is None else stats.temperature_c,
        friction_excess=None if friction is None or level is None else level - 1.0 + friction.value,
        friction_excess_se=None if friction is None else friction.se,
        load_excess=None if load is None else load.value,
        load_excess_se=None if load is None else load.se,
        offset_nm=None if offset is None else offset.value,
        offset_nm_se=None if offset is None else offset.se,
        freedom=None if friction is None else friction.freedom,
        law_nm=law,
        law_nm_low=bounds[0],
        law_nm_high=bounds[1],
        law_speed_rad_s=speed,
        friction_level=level,
        peaks_nm=tuple(peaks.level_nm.tolist()),
        peaks_minute=tuple(peaks.window.tolist()),
        peaks_count=count,
        minute_hours=tuple(peaks.window_hours.tolist()),
    )


def _shares(audit: Audit, log: LogEvidence, joint: str) -> ResidualShares | None:
    """Excess of friction and load; None for friction of the log itself, whose residual has none left in it."""
    law = None if audit.result.provenance.friction_sha256 is None else _model(audit.result.friction.get(joint))
    if law is None or joint not in log.watched:
        return None
    signals, k = audit.signals, audit.signals.joint_names.index(joint)
    used = log.clean[:, k] & (signals.state[:, k] == State.JUDGED)
    velocity = signals.velocity_rad_s[used, k]
    friction = law.torque(velocity)
    return residual_shares(
        signals.time_s[used], signals.residual_nm[used, k], friction, signals.model_nm[used, k] - friction
    )


def _level(result: AuditResult, joint: str) -> float | None:
    """The level of friction that the residual followed: the residual shows only what friction exceeds that by."""
    facts = None if result.detection is None else result.detection.friction_level.get(joint)
    return None if facts is None else facts.mean


def _model(fit: FrictionFit | None) -> FrictionModel | None:
    return None if fit is None else FrictionModel.of(fit)


def _law(fit: FrictionFit | None) -> tuple[float | None, float | None, tuple[float | None, float | None]]:
    """Friction at the middle of the speeds measured, that speed, and the interval of the curve there."""
    law = _model(fit)
    if law is None or law.speed_range[0] <= 0:
        return None, None, (None, None)
    middle = sqrt(law.speed_range[0] * law.speed_range[1])
    speed = float(f"{middle:.1g}") if middle > 0 else 0.0
    speed = speed if law.speed_range[0] <= speed <= law.speed_range[1] else middle
    level = float(np.mean(np.abs(law.torque(np.array([speed, -speed])))))
    half = None if law.spread is None else float(half_width(law, np.array([speed]))[0])
    return level, speed, (None, None) if half is None else (level - half, level + half)


def _peaks(log: LogEvidence, joint: str, result: AuditResult) -> LogPeaks:
    if joint not in log.watched:
        empty = np.empty(0)
        return LogPeaks(empty, empty, np.empty(0, np.int64), empty)
    return peaks_of_log(log.of_joint(joint), persistence_samples(result.rule.persistence_s, log.period_s))


def _kept(peaks: LogPeaks) -> tuple[LogPeaks, int]:
    """The largest of a log's peaks, falling, in 4 digits rounded up; and how many there were."""
    count = peaks.level_nm.size
    kept = np.argsort(-peaks.level_nm, kind="stable")[: max(_KEPT_LEAST, int(_KEPT_SHARE * count))]
    level = np.array([_digits_up(x) for x in peaks.level_nm[kept].tolist()])
    return LogPeaks(level, peaks.time_s[kept], peaks.window[kept], peaks.window_hours), count


def _digits_up(value: float) -> float:
    if not value > 0:
        return 0.0
    step = 10.0 ** (floor(log10(value)) - 3)
    return float(f"{-floor(-value / step * (1 - 1e-12)) * step:.6g}")


def _parameters(joint: str, fit: FrictionFit) -> list[ParameterRecord]:
    rows = []
    for name, value in fit.parameters.items():
        low, high = (fit.ci95.get(name) if fit.ci95 else None) or (None, None)
        rows.append(ParameterRecord(joint, fit.model or "", name, value, low, high, fit.identifiable))
    return rows


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
