"""The record of one audit, as a store keeps it."""

from __future__ import annotations

from math import sqrt

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
)
from collaudit.core.history.residual_shares import ResidualShares, residual_shares
from collaudit.core.recommend.arm_evidence import ArmEvidence, LogEvidence, log_evidence
from collaudit.core.recommend.outlying_peaks import unsuspicious
from collaudit.core.recommend.sustained_levels import LogPeaks, peaks_of_log, round_up

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
    return ContactRecord(
        contact.onset_s,
        contact.end_s,
        contact.joints,
        contact.link,
        contact.kind,
        least,
        peaks_nm=tuple(contact.peak_nm.get(joint, 0.0) for joint in contact.joints),
        place_m=None if contact.scene is None else contact.scene.points_m[-1],
        state=contact.state,
    )


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
    level = np.array([round_up(x, 4) for x in peaks.level_nm[kept].tolist()])
    return LogPeaks(level, peaks.time_s[kept], peaks.window[kept], peaks.window_hours), count


def _parameters(joint: str, fit: FrictionFit) -> list[ParameterRecord]:
    rows = []
    for name, value in fit.parameters.items():
        low, high = (fit.ci95.get(name) if fit.ci95 else None) or (None, None)
        rows.append(ParameterRecord(joint, fit.model or "", name, value, low, high, fit.identifiable))
    return rows
