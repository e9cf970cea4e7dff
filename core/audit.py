"""Composition of the stages: logs to friction, logs to an audit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from collaudit.core.config.schema import Config
from collaudit.core.data.audit_result import (
    AUDIT_SCHEMA,
    FRICTION_SCHEMA,
    Audit,
    AuditResult,
    FrictionFile,
    LogFacts,
    Provenance,
    RecommendedRule,
    ResidualStats,
)
from collaudit.core.data.identification_result import Identification
from collaudit.core.data.signals import Signals, State
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.detection.detector_run import DetectionInputs, run_detector
from collaudit.core.detection.rule_settings import make_rule
from collaudit.core.detection_facts import detection_facts, detection_findings
from collaudit.core.findings import Finding
from collaudit.core.friction.friction_variation import friction_variation, friction_variation_findings, merged
from collaudit.core.friction.joint_fits import fit_joints, friction_findings, friction_laws, scatter_findings
from collaudit.core.friction.temperature_laws import laws_at_temperature
from collaudit.core.identification.channel_audit import audit_channels
from collaudit.core.identification.identification import identify, wanted
from collaudit.core.identification.identification_findings import identified_findings
from collaudit.core.numeric.arrays import BoolArray
from collaudit.core.prepare.calibration import before_fit, with_identified, with_known
from collaudit.core.prepare.phases import phase_spans
from collaudit.core.prepare.prepared import Prepared, judged_series, prepare
from collaudit.core.recommend.recommendation import CleanResidual, little_data_findings, recommend_rule
from collaudit.core.verdict.coverage import coverage_findings, measure_coverage
from collaudit.core.verdict.verdict import decide

__all__ = ["Audit", "Prepared", "audit_log", "fit_logs", "prepare", "recommend_rules"]

_AROUND_EVENT_S = 0.5


def fit_logs(prepared: Sequence[Prepared], config: Config, provenance: Provenance) -> FrictionFile:
    """Fit the friction of every judged joint from the constant-velocity sections of one or several logs."""
    audited = [audit_channels(p, config) for p in prepared]
    channels = {p.series.source.name: facts for p, (facts, _) in zip(prepared, audited, strict=True)}
    known = [before_fit(p, wanted(config), channels, config) for p in prepared]
    identified = identify(known, config)
    seen = [with_identified(p, identified) for p in known]
    fits = fit_joints(seen, config)
    trends = merged([friction_variation(p, fits) for p in seen])
    findings = [f for p, (_, said) in zip(prepared, audited, strict=True) for f in (*p.findings, *said)]
    findings += identified_findings(identified) + friction_findings(fits) + friction_variation_findings(trends, fits)
    return FrictionFile(
        schema=FRICTION_SCHEMA,
        joints=fits,
        findings=tuple(findings),
        provenance=replace(
            provenance,
            logs={p.series.source.name: p.series.source.sha256 for p in prepared},
            model_sha256=prepared[0].robot.sha256,
        ),
        identified=identified,
        channels=channels,
        trends=trends,
    )


def audit_log(
    prepared: Prepared,
    config: Config,
    friction: FrictionFile | None,
    provenance: Provenance,
    truth: Path | None = None,
) -> Audit:
    """Judge one log: residual, events, recommendation, coverage, verdict.

    Args:
        prepared: the log.
        config: thresholds, persistence, policy.
        friction: fitted friction, or None to fit it on this very log (a finding says so).
        provenance: versions and hashes.
        truth: file of known events to score the detection against, if any.
    """
    known = (None, {}) if friction is None else (friction.identified, friction.channels)
    prepared = with_known(prepared, *known, config)
    series = judged_series(prepared)
    findings = list(prepared.findings)
    if friction is None:
        fits = fit_joints([prepared], config)
        findings.append(
            Finding(
                "friction-same-log",
                "warning",
                "Friction was fitted on the log it judges: a constant external force would be taken for friction.",
            )
        )
    else:
        fits = {joint: fit for joint, fit in friction.joints.items() if joint in series.joint_names}
        findings += _friction_mismatch(friction, prepared)
    laws, missing = friction_laws(fits, series)
    if friction is not None:
        laws, more = laws_at_temperature(laws, friction.trends, series)
        missing += more
    findings += friction_findings(fits) + missing
    rule, watch, more = make_rule(series, prepared.phases, config)
    findings += more
    contradicted = _contradicted(prepared)
    inputs = DetectionInputs(laws, contradicted, rule, watch)
    found = run_detector(prepared, inputs, config)
    residual, detected = found.residual, found.detected
    signals = _signals(series, residual.model_nm, residual.torque_nm, detected.state, rule.gamma_nm)
    coverage = measure_coverage(series, detected.state, watch)
    clean = {joint: clean_samples(signals, detected.collision_times(joint), joint) for joint in series.joint_names}
    stats = {joint: _stats(signals, joint, clean[joint], series.period_s) for joint in series.joint_names}
    findings += _level_findings(stats, rule.gamma_nm) + scatter_findings(fits, rule.gamma_nm)
    findings += detection_findings(series, found, inputs) + coverage_findings(coverage, config.policy.min_coverage)
    verdict, reasons = decide(config.policy, detected.collisions, detected.near_misses, coverage, findings)
    recommended = {
        joint: recommend_rule([_clean_residual(signals, joint, clean[joint], series.period_s)], rule.persistence_s)
        for joint in series.joint_names
        if watch[joint].watched
    }
    findings += little_data_findings(recommended)
    result = AuditResult(
        schema=AUDIT_SCHEMA,
        verdict=verdict,
        reasons=reasons,
        log=_log_facts(series),
        rule=rule,
        phases=phase_spans(series.time_s, prepared.phases, series.period_s),
        residual=stats,
        collisions=detected.collisions,
        near_misses=detected.near_misses,
        recommended=recommended,
        friction=fits,
        identification=None
        if friction is None
        else Identification(friction.identified, friction.channels, friction.trends),
        findings=tuple(findings),
        coverage=coverage,
        provenance=replace(provenance, model_sha256=prepared.robot.sha256),
        detection=detection_facts(prepared, found, inputs, config, clean, truth),
    )
    return Audit(result, signals)


def _contradicted(prepared: Prepared) -> frozenset[str]:
    """Joints whose effort runs against the model; all of them where the arm's pose is not known."""
    if any(f.code in ("log-position-unit-suspect", "model-joint-between") for f in prepared.findings):
        return frozenset(prepared.judged)
    return frozenset(g.joint for g in prepared.gains if g.inverted)


def _friction_mismatch(friction: FrictionFile, prepared: Prepared) -> list[Finding]:
    """A friction file of another model, and friction of joints that this log lacks."""
    findings = []
    fitted_with = friction.provenance.model_sha256
    if fitted_with is not None and fitted_with != prepared.robot.sha256:
        findings.append(
            Finding(
                "friction-other-model",
                "warning",
                "The friction was fitted with another robot model, tool or mounting than this log is judged with "
                f"(model hash {fitted_with[:12]}, here {prepared.robot.sha256[:12]}).",
            )
        )
    for joint, fit in friction.joints.items():
        if fit.model is not None and joint not in prepared.series.joint_names:
            text = f"Joint '{joint}' has a friction law and is not in this log: it was not judged."
            findings.append(Finding("judged-joint-missing", "error", text, joint=joint))
    return findings


def recommend_rules(audits: Sequence[Audit], persistence_s: float | None = None) -> dict[str, RecommendedRule]:
    """Recommended gamma and n per joint over all given audits.

    Args:
        audits: judged logs.
        persistence_s: persistence in s; the longest the audits used when absent.
    """
    wanted = persistence_s or max(a.result.rule.persistence_s for a in audits)
    joints = list(dict.fromkeys(j for a in audits for j in a.result.recommended))
    out = {}
    for joint in joints:
        data = []
        for audit in audits:
            if joint in audit.signals.joint_names:
                times = [(c.onset_s, c.onset_s + c.duration_s) for c in audit.result.collisions if c.joint == joint]
                clean = clean_samples(audit.signals, times, joint)
                data.append(_clean_residual(audit.signals, joint, clean, audit.result.log.sample_period_s))
        out[joint] = recommend_rule(data, wanted)
    return out


def _clean_residual(signals: Signals, joint: str, clean: BoolArray, period_s: float) -> CleanResidual:
    k = signals.joint_names.index(joint)
    left_out = np.count_nonzero(signals.state[:, k] == State.JUDGED) - np.count_nonzero(clean)
    return CleanResidual(signals.residual_nm[:, k], clean, period_s, float(left_out) * period_s)


def clean_samples(signals: Signals, collision_times: Sequence[tuple[float, float]], joint: str) -> BoolArray:
    """(n,) samples of a joint that were judged and lie half a second away from its collisions."""
    k = signals.joint_names.index(joint)
    clean: BoolArray = np.asarray(signals.state[:, k] == State.JUDGED)
    for start, end in collision_times:
        a, b = np.searchsorted(signals.time_s, [start - _AROUND_EVENT_S, end + _AROUND_EVENT_S])
        clean[a:b] = False
    return clean


def _signals(
    series: UniformSeries, model: np.ndarray, residual: np.ndarray, state: np.ndarray, gamma: dict[str, float]
) -> Signals:
    measured = np.full_like(series.position_rad, np.nan) if series.effort is None else series.effort
    return Signals(
        time_s=series.time_s,
        joint_names=series.joint_names,
        position_rad=series.position_rad,
        velocity_rad_s=series.velocity_rad_s,
        measured_nm=measured,
        model_nm=model,
        residual_nm=residual,
        state=state,
        gamma_nm=np.array([gamma.get(joint, np.nan) for joint in series.joint_names]),
    )


def _stats(signals: Signals, joint: str, clean: BoolArray, period_s: float) -> ResidualStats:
    k = signals.joint_names.index(joint)
    judged = signals.state[:, k] == State.JUDGED
    seconds = float(np.count_nonzero(judged)) * period_s
    x = np.abs(signals.residual_nm[judged, k])
    if x.size == 0:
        return ResidualStats(None, None, None, None, seconds)
    calm = np.abs(signals.residual_nm[clean, k])
    return ResidualStats(
        mean_abs_nm=float(np.mean(x)),
        rms_nm=float(np.sqrt(np.mean(x**2))),
        p99_nm=float(np.quantile(x, 0.99)),
        max_abs_nm=float(np.max(x)),
        judged_s=seconds,
        clean_mean_abs_nm=float(np.mean(calm)) if calm.size else None,
        clean_s=float(calm.size) * period_s,
    )


def _level_findings(stats: dict[str, ResidualStats], gamma: dict[str, float]) -> list[Finding]:
    findings = []
    for joint, level in stats.items():
        if joint in gamma and level.clean_mean_abs_nm is not None and level.clean_mean_abs_nm > 0.5 * gamma[joint]:
            findings.append(
                Finding(
                    "residual-level",
                    "warning",
                    f"The collision-free residual of joint '{joint}' averages {level.clean_mean_abs_nm:.3g} N·m "
                    f"against a threshold of {gamma[joint]:g} N·m: the model fits this joint too poorly for it.",
                    joint=joint,
                )
            )
    return findings


def _log_facts(series: UniformSeries) -> LogFacts:
    source = series.source
    start = None
    if source.start_ns is not None and source.start_ns > 0:
        seconds, nanoseconds = divmod(source.start_ns, 1_000_000_000)
        start = f"{datetime.fromtimestamp(seconds, tz=UTC):%Y-%m-%dT%H:%M:%S}.{nanoseconds:09d}Z"
    return LogFacts(
        name=source.name,
        sha256=source.sha256,
        format=source.format,
        start=start,
        duration_s=float(series.time_s[-1] - series.time_s[0]),
        sample_period_s=series.period_s,
        joints=series.joint_names,
        topic=source.topic,
        time_source=source.time_source,
    )
