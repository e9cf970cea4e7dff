"""Composition of the stages of an audit: one log to its result."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import partial
from hashlib import sha256

from collaudit.core.causes.causes import find_causes, told_load
from collaudit.core.config.schema import Config
from collaudit.core.contacts.contact_scene import arm_geometry
from collaudit.core.contacts.contact_states import Precedents, with_states
from collaudit.core.contacts.contacts import disturbance_findings, find_contacts, rest_disturbances
from collaudit.core.data.audit_result import AUDIT_SCHEMA, Audit, AuditResult, FrictionFile, PolicyLimits, Provenance
from collaudit.core.data.identification_result import Identification
from collaudit.core.data.joint_log import log_facts
from collaudit.core.data.signals import CycleReference
from collaudit.core.detection.detector_run import Settled
from collaudit.core.detection.judgement import judge, settled
from collaudit.core.findings import Finding, in_joint_units
from collaudit.core.friction.applied_friction import applied_friction, fitted_alone
from collaudit.core.numeric.parallel import Progress, stage
from collaudit.core.prepare.calibration import Calibration
from collaudit.core.prepare.phases import phase_spans
from collaudit.core.prepare.preparation import calibrated, carrying
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.recommend.arm_evidence import evidence_of
from collaudit.core.recommend.arm_recommendation import recommended_of_log
from collaudit.core.recommend.evidence_range import range_findings, ranges_behind
from collaudit.core.robot.robot_model import RobotModel
from collaudit.core.scoring.detection_score import TruthFile
from collaudit.core.scoring.known_events import controller_alarms, missing_labels, score_detection
from collaudit.core.verdict.coverage import exclusions, log_time, measure_coverage
from collaudit.core.verdict.sensitivity import measure_sensitivity
from collaudit.core.verdict.shortfalls import shortfalls, unstated_force
from collaudit.core.verdict.verdict import Evidence, asked_findings, decide, uncounted_texts, unjudged


def audit_log(
    prepared: Prepared,
    config: Config,
    friction: FrictionFile | None,
    provenance: Provenance,
    truth: TruthFile | None = None,
    progress: Progress | None = None,
    known: Precedents | None = None,
    earlier: Sequence[CycleReference] = (),
    siblings: Iterable[tuple[str, RobotModel]] | None = (),
) -> Audit:
    """Judge one log: residual, alarms, contacts, recommendation, coverage, verdict; again with the load that it tells.

    That is where the tool's mass is to be estimated and a load takes the residual away that no hand explains as well.

    Args:
        prepared: the log, with the calibration that the friction file holds; it is computed anew where it is not.
        config: thresholds, persistence, policy.
        friction: fitted friction, or None to fit it on this very log (a finding says so).
        provenance: versions and hashes.
        truth: known events to score the detection against, if any.
        progress: called with steps done and in all.
        known: earlier contacts of the robot, and accepted ones; None for nothing.
        earlier: what passed nights say of the program's cycles, in their order.
        siblings: other descriptions of the arm's family, by name; looked at where a cause is sought. None where none is
            to be sought: no load is told then.

    Raises:
        LogError: the known events cannot be understood.
        ConfigError: a label that marks them is not in the log, or the friction file is another arm's.
    """
    judge = partial(
        _judged,
        config=config,
        friction=friction,
        provenance=provenance,
        truth=truth,
        progress=progress,
        known=known,
        earlier=earlier,
    )
    audit = judge(prepared, siblings=siblings)
    load = told_load(audit.result.causes) if config.robot.tool.mass_kg == "estimate" else None
    return audit if load is None else judge(carrying(prepared, *load, config), siblings=())


def _judged(
    prepared: Prepared,
    config: Config,
    friction: FrictionFile | None,
    provenance: Provenance,
    truth: TruthFile | None,
    progress: Progress | None,
    known: Precedents | None,
    earlier: Sequence[CycleReference],
    siblings: Iterable[tuple[str, RobotModel]] | None,
) -> Audit:
    """One log, with the model that it was prepared with; arguments as of :func:`audit_log`."""
    step = stage(progress, 0.0, 1.0)
    parts: list[Settled] = []
    if config.policy.same_log == "folds" and (friction is None or fitted_alone(friction, prepared)):
        friction, parts = _by_parts(prepared, friction, config, provenance, stage(progress, 0.0, 0.15))
    prepared, about_axes = _calibrated(prepared, friction, config)
    units, sliding, series = prepared.units, prepared.sliding, prepared.judged_series
    phases = phase_spans(series.time_s, prepared.phases, series.period_s)
    applied = applied_friction(prepared, friction, config)
    step(2, 10)
    version = _version(prepared, provenance, config)
    judged = judge(
        prepared,
        applied,
        config,
        None if friction is None else friction.thresholds,
        stage(progress, 0.2, 0.6),
        parts,
        tuple(
            one for one in earlier if one.version == version and not prepared.series.source.sha256.startswith(one.log)
        ),
    )
    prepared, series, config = judged.prepared, judged.series, judged.config
    inputs, run, detected = judged.inputs, judged.run, judged.run.detected
    step(6, 10)
    log, events = log_facts(series), (detected.collisions, detected.near_misses)
    contacts = find_contacts(prepared, run, config)
    contacts = with_states(contacts, known, log.sha256, log.start)
    arm = arm_geometry(prepared, config.robot.tool.frame)
    disturbed = rest_disturbances(judged.rest_steps, series.joint_names, [(c.onset_s, c.end_s) for c in contacts])
    at_rest = disturbance_findings(disturbed, config.policy.max_disturbed_at_rest)
    alarms = controller_alarms(series, run, inputs, config.detect, contacts)
    scores = score_detection(series, run, inputs, config.detect, truth)
    unlabelled = missing_labels(series, config) if truth is None else []
    step(8, 10)
    time = log_time(prepared, run, [joint for joint in inputs.rule.watch if joint not in inputs.not_judged])
    coverage = measure_coverage(series, detected.state, inputs.watch, time)
    sensitivity = measure_sensitivity(prepared, run, inputs, config, time)
    evidence_here = evidence_of(log, inputs.rule, judged.signals, phases, events)
    rules = recommended_of_log(evidence_here, inputs.rule, sensitivity)
    ranges = ranges_behind(judged.thresholds if judged.automatic else None)
    beyond = range_findings(judged.signals, series.period_s, series.temperature_c, ranges)
    short = (
        *shortfalls(
            config.policy, coverage, sensitivity, inputs, sliding, None if friction is None else friction.choice
        ),
        *unstated_force(prepared, sensitivity, inputs.rule.n),
    )
    findings = in_joint_units(
        (
            *asked_findings(prepared, config, applied.findings),
            *about_axes,
            *judged.choices,
            *judged.checked,
            *at_rest,
            *short,
            *beyond,
            *unlabelled,
        ),
        sliding,
    )
    evidence = Evidence(contacts, detected.near_misses, coverage, sensitivity, short, findings)
    verdict, reasons = decide(config.policy, evidence)
    result = AuditResult(
        schema=AUDIT_SCHEMA,
        verdict=verdict,
        reasons=reasons,
        log=replace(log, units=units),
        rule=inputs.rule,
        phases=phases,
        residual=judged.stats,
        collisions=detected.collisions,
        near_misses=detected.near_misses,
        recommended=rules,
        friction=applied.fits,
        identification=None
        if friction is None
        else Identification(friction.identified, friction.channels, friction.trends, friction.coupled, friction.choice),
        findings=findings,
        coverage=coverage,
        provenance=replace(provenance, model_sha256=prepared.robot.sha256),
        detection=replace(judged.facts, flags=alarms, scores=scores),
        contacts=contacts,
        exclusions=(
            *uncounted_texts(contacts, config.policy),
            *exclusions(coverage, sensitivity, findings, units, config.log.effort_kind != "auto", prepared.left_out),
        ),
        sensitivity=sensitivity,
        disturbances=disturbed,
        unjudged=tuple(unjudged(config.policy, evidence)),
        stated=config.report.stated(),
        limits=PolicyLimits(
            config.policy.max_collisions, config.policy.max_near_misses_per_hour, config.policy.min_coverage
        ),
        arm=arm,
        causes=find_causes(prepared, run, applied.laws, inputs.rule.gamma_nm, judged.thresholds, config, siblings)
        if siblings is not None
        and verdict != "pass"
        and (contacts or any(finding.doubts_alarms for finding in findings))
        else (),
        cycles=None if run.cycles is None else run.cycles.facts,
    )
    reference = None if run.cycles is None else run.cycles.reference
    return Audit(result, judged.signals, None if reference is None else replace(reference, version=version))


def _version(prepared: Prepared, provenance: Provenance, config: Config) -> str:
    """Of a program: residuals of nights are comparable where joints, model, friction and detector are the same."""
    parts = (*prepared.judged, prepared.robot.sha256, provenance.friction_sha256 or "", config.detect.detector)
    return sha256("\n".join(map(str, parts)).encode()).hexdigest()


def _by_parts(
    prepared: Prepared, friction: FrictionFile | None, config: Config, provenance: Provenance, progress: Progress
) -> tuple[FrictionFile | None, list[Settled]]:
    """The fit of the whole log, which is shown, and for each part of the log the fit of the others, which judges it.

    No parts where the log shows no friction: what is judged then needs no fit, and no earlier one is taken for it.

    Raises:
        NotJudgedError: nothing can be fitted.
    """
    from collaudit.core.fitting import fit_by_parts

    logged = calibrated(prepared, Calibration.of(None, config), config)
    whole, fits = fit_by_parts(logged, config, provenance, progress)
    if all(fit.model is None for fit in whole.joints.values()):
        return None if friction is None else whole, []
    parts = []
    for rows, fitted in fits:
        own, _ = _calibrated(logged, fitted, config)
        parts.append(settled(own, applied_friction(own, fitted, config), config, fitted.thresholds, rows))
    return whole, parts


def _calibrated(prepared: Prepared, friction: FrictionFile | None, config: Config) -> tuple[Prepared, list[Finding]]:
    """The log with what is known of arm, drives and sensor; without a friction file with its own coupled axes."""
    known = Calibration.of(friction, config)
    if friction is not None:
        return calibrated(prepared, known, config), []
    from collaudit.core.friction.arm_fit import fit_coupled

    coupled, findings = fit_coupled([prepared], config, with_inertia=False)
    return calibrated(prepared, replace(known, coupled=coupled), config), findings
