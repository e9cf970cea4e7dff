"""Composition of the stages of an audit: one log to its result."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from collaudit.core.config.schema import Config
from collaudit.core.contacts.contact_scene import arm_geometry
from collaudit.core.contacts.contacts import find_contacts
from collaudit.core.contacts.controller_alarms import alarm_possible, compare_controller_alarms, controller_marks
from collaudit.core.contacts.rest_disturbances import disturbance_findings, rest_disturbances
from collaudit.core.data.audit_result import (
    AUDIT_SCHEMA,
    Audit,
    AuditResult,
    FrictionFile,
    LogFacts,
    PhaseSpan,
    PolicyLimits,
    Provenance,
    RecommendedRule,
    ResidualStats,
)
from collaudit.core.data.detection_result import DetectionFacts, DetectorFacts
from collaudit.core.data.identification_result import Identification
from collaudit.core.data.log_facts import log_facts
from collaudit.core.data.signals import Signals
from collaudit.core.data.threshold_result import FollowedMotion
from collaudit.core.detection.clean_samples import clean_samples, residual_stats
from collaudit.core.detection.detection_findings import detection_findings, residual_level_findings, scatter_findings
from collaudit.core.detection.detector_run import (
    DetectionInputs,
    DetectorRun,
    delay_facts,
    detector_facts,
    friction_levels,
    judged_signals,
    run_detector,
)
from collaudit.core.detection.fitted_rule import (
    change_findings,
    tight_threshold_findings,
    with_fitted_thresholds,
    with_rest_thresholds,
)
from collaudit.core.detection.guided_log import judged_log
from collaudit.core.detection.model_worth import model_worth_findings
from collaudit.core.detection.position_pattern import pattern_findings
from collaudit.core.detection.rest_steps import RestStep, rest_steps
from collaudit.core.detection.rule_reach import check_persistence, coarse_findings, reach_findings
from collaudit.core.detection.rule_settings import make_rule
from collaudit.core.detection.watch import control_modes
from collaudit.core.findings import Finding, joints_not_judged
from collaudit.core.findings.joint_units import in_joint_units
from collaudit.core.friction.applied_friction import AppliedFriction, applied_friction
from collaudit.core.numeric.parallel import by_name
from collaudit.core.numeric.stage_progress import Progress, stage
from collaudit.core.prepare.calibration import Calibration
from collaudit.core.prepare.phases import phase_spans
from collaudit.core.prepare.preparation import calibrated
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.recommend.arm_evidence import evidence_of
from collaudit.core.recommend.arm_recommendation import recommended_of_log
from collaudit.core.recommend.evidence_range import range_findings, ranges_behind
from collaudit.core.scoring.known_events import missing_labels, score_detection
from collaudit.core.scoring.truth_events import TruthFile
from collaudit.core.verdict.asked_findings import asked_findings
from collaudit.core.verdict.coverage import joints_in_motion, measure_coverage
from collaudit.core.verdict.exclusions import exclusions
from collaudit.core.verdict.sensitivity import measure_sensitivity
from collaudit.core.verdict.shortfalls import coverage_findings, shortfalls
from collaudit.core.verdict.verdict import Evidence, decide, unjudged

#: What takes the signals, and the hash of their log, while the rest is judged.
OnSignals = Callable[[Signals, str], None]
#: Of the time that a log takes, where its rule is studied too.
_SHARE_BESIDE_A_STUDY = 0.2


def audit_log(
    prepared: Prepared,
    config: Config,
    friction: FrictionFile | None,
    provenance: Provenance,
    truth: TruthFile | None = None,
    progress: Progress | None = None,
    on_signals: OnSignals | None = None,
) -> Audit:
    """Judge one log: residual, alarms, contacts, recommendation, coverage, verdict.

    Args:
        prepared: the log, with the calibration that the friction file holds; it is computed anew where it is not.
        config: thresholds, persistence, policy.
        friction: fitted friction, or None to fit it on this very log (a finding says so).
        provenance: versions and hashes.
        truth: known events to score the detection against, if any.
        progress: called with steps done and in all.
        on_signals: called with the signals and the log's hash while the rest is still judged.

    Raises:
        LogError: the known events cannot be understood.
        ConfigError: a label that marks them is not in the log, or the friction file is another arm's.
    """
    known = Calibration.of(friction, config)
    about_axes: list[Finding] = []
    if friction is None:
        from collaudit.core.identification.coupled_axes import fit_coupled

        coupled, about_axes = fit_coupled([prepared], config, with_inertia=False)
        known = replace(known, coupled=coupled)
    prepared = calibrated(prepared, known, config)
    series, units, sliding = prepared.judged_series, prepared.units, prepared.sliding
    phases = phase_spans(series.time_s, prepared.phases, series.period_s)
    applied = applied_friction(prepared, friction, config)
    prepared, series = judged_log(prepared, applied, config)
    config = with_rest_thresholds(config, applied.quiet, series.joint_names)
    auto = config.detect.gamma_nm == "auto"
    on_file = None if friction is None else friction.thresholds
    config, follows, chosen = with_fitted_thresholds(config, on_file, applied.quiet, series)
    judging = _SHARE_BESIDE_A_STUDY if config.study.run else 1.0
    step = stage(progress, 0.0, judging)
    step(2, 10)
    judged = _detect(prepared, applied, config, follows, on_signals, stage(progress, 0.2 * judging, 0.6 * judging))
    found = judged.run.detected.collisions
    tight = [] if auto else tight_threshold_findings(judged.inputs.rule, on_file, config, found)
    step(6, 10)
    contacts = find_contacts(prepared, judged.run, config)
    drawn = arm_geometry(prepared, config.robot.tool.frame)
    alarms = compare_controller_alarms(
        controller_marks(series, config.detect),
        contacts,
        series.time_s,
        alarm_possible(judged.run, judged.inputs, series.joint_names),
    )
    disturbed = rest_disturbances(judged.rest_steps, series.joint_names, [(c.onset_s, c.end_s) for c in contacts])
    at_rest = disturbance_findings(disturbed, config.policy.max_disturbed_at_rest)
    scores = score_detection(series, judged.run, judged.inputs, config.detect, truth)
    unlabelled = missing_labels(series, config) if truth is None else []
    recommended = _recommended(judged, log_facts(series), phases)
    step(8, 10)
    ranges = ranges_behind(config.detect.evidence, on_file, auto)
    beyond = range_findings(judged.signals, series.period_s, phases, series.temperature_c, ranges)
    detected = judged.run.detected
    moving = joints_in_motion(series, detected.state)
    coverage = measure_coverage(series, detected.state, judged.inputs.watch, moving)
    sensitivity = measure_sensitivity(prepared, judged.run, judged.inputs, config, coverage.gaps_s, moving)
    short = shortfalls(
        config.policy, coverage, sensitivity, judged.inputs, sliding, None if friction is None else friction.choice
    )
    findings = [*asked_findings(prepared, config), *about_axes, *applied.findings, *chosen, *tight, *judged.findings]
    findings += [*at_rest, *coverage_findings(short), *beyond]
    findings += unlabelled
    findings = list(in_joint_units(findings, sliding))
    evidence = Evidence(contacts, detected.near_misses, coverage, sensitivity, short, findings)
    verdict, reasons = decide(config.policy, evidence)
    result = AuditResult(
        schema=AUDIT_SCHEMA,
        verdict=verdict,
        reasons=reasons,
        log=replace(log_facts(series), units=units),
        rule=judged.inputs.rule,
        phases=phases,
        residual=judged.stats,
        collisions=detected.collisions,
        near_misses=detected.near_misses,
        recommended=recommended,
        friction=applied.fits,
        identification=None
        if friction is None
        else Identification(friction.identified, friction.channels, friction.trends, friction.coupled, friction.choice),
        findings=tuple(findings),
        coverage=coverage,
        provenance=replace(provenance, model_sha256=prepared.robot.sha256),
        detection=replace(judged.facts, flags=alarms, scores=scores),
        contacts=contacts,
        exclusions=exclusions(coverage, sensitivity, findings, units),
        sensitivity=sensitivity,
        disturbances=disturbed,
        unjudged=tuple(unjudged(config.policy, evidence)),
        stated=config.report.stated(),
        limits=PolicyLimits(
            config.policy.max_collisions, config.policy.max_near_misses_per_hour, config.policy.min_coverage
        ),
        arm=drawn,
    )
    study = None
    if config.study.run:
        from collaudit.core.rule_study.rule_study import audit_study

        study = audit_study(
            prepared, judged.run, judged.inputs, config, result, judged.signals, truth, stage(progress, judging, 1.0)
        )
    return Audit(result, judged.signals, study)


@dataclass(frozen=True, slots=True, eq=False)
class _Judged:
    """What detection made of a log: the run of its detector, the signals, and what follows from them joint by joint."""

    inputs: DetectionInputs
    run: DetectorRun
    signals: Signals
    stats: dict[str, ResidualStats]
    facts: DetectionFacts
    findings: tuple[Finding, ...]
    rest_steps: tuple[RestStep, ...]


def _detect(
    prepared: Prepared,
    applied: AppliedFriction,
    config: Config,
    follows: FollowedMotion,
    on_signals: OnSignals | None,
    step: Progress,
) -> _Judged:
    """Rule, residual, alarms, and what they leave to say; contacts, controller alarms and scores come later."""
    series, period = prepared.judged_series, prepared.judged_series.period_s
    rule, watch, found = make_rule(series, prepared.phases, config, follows)
    check_persistence(series, rule.n)
    found += change_findings(prepared, applied.quiet, rule.gamma_nm)
    found += reach_findings(series, prepared.robot, rule) + coarse_findings(series, rule)
    forbidden = joints_not_judged(prepared.findings, prepared.judged)
    inputs = DetectionInputs(applied.laws, forbidden, rule, watch, quiet=applied.quiet)
    run = run_detector(prepared, inputs, config)
    step(4, 10)
    signals = judged_signals(series, run, rule.gamma_nm)
    times = run.detected.collision_times
    clean = {joint: clean_samples(signals, times(joint), joint) for joint in series.joint_names}
    stats = by_name(lambda joint: residual_stats(signals, joint, clean[joint], period), series.joint_names)
    heat = {joint: (series.mean_temperature_c(joint), series.temperature_range_c(joint)) for joint in stats}
    stats = {
        joint: replace(item, temperature_c=heat[joint][0], temperature_range_c=heat[joint][1])
        for joint, item in stats.items()
    }
    others: dict[str, DetectorFacts] = {
        name: detector_facts(run_detector(prepared, inputs, config, name), rule, series.joint_names, period)
        for name in dict.fromkeys(config.detect.compare)
    }
    facts = DetectionFacts(
        causal=config.detect.causal,
        equation=run.detector.equation,
        delay=delay_facts(run.residual.balance.kernel, rule, period),
        friction_level=friction_levels(run.residual, config.detect.friction_level == "followed"),
        detectors=others,
        flags=(),
        control=control_modes(series, prepared.phases),
    )
    step(7, 10)
    if on_signals is not None:
        on_signals(signals, series.source.sha256)
    found += pattern_findings(signals, rule.gamma_nm)
    more = detection_findings(series, run, inputs, facts.friction_level)
    found += residual_level_findings(stats, rule.gamma_nm) + scatter_findings(applied.fits, rule.gamma_nm)
    more += model_worth_findings(prepared, run, inputs)
    step(9, 10)
    steps = rest_steps(prepared, run, inputs)
    return _Judged(inputs, run, signals, stats, facts, (*found, *more), steps)


def _recommended(judged: _Judged, log: LogFacts, phases: tuple[PhaseSpan, ...]) -> dict[str, RecommendedRule]:
    """A threshold for each watched joint from this log alone."""
    rule, detected = judged.inputs.rule, judged.run.detected
    events = (detected.collisions, detected.near_misses)
    evidence = evidence_of(log, rule, judged.signals, phases, events)
    return recommended_of_log(evidence, rule.persistence_s)
