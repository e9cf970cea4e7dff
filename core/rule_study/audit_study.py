"""The study of the rule of a log that was just judged."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from collaudit.core.config.schema import Config
from collaudit.core.data.audit_result import AuditResult
from collaudit.core.data.rule_study_result import RuleStudy
from collaudit.core.data.signals import Signals
from collaudit.core.detection.detector_run import DetectionInputs, DetectorRun
from collaudit.core.numeric.stage_progress import Progress
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.recommend.arm_evidence import ArmEvidence, Times, evidence_of
from collaudit.core.recommend.arm_recommendation import recommended_of_log
from collaudit.core.recommend.outlying_peaks import unsuspicious
from collaudit.core.recommend.set_rules import judge_set_rules
from collaudit.core.rule_study.rule_study import StudiedLog, study_rule
from collaudit.core.scoring.known_events import contact_times, label_times
from collaudit.core.scoring.truth_events import TruthFile


def audit_study(
    prepared: Prepared,
    run: DetectorRun,
    inputs: DetectionInputs,
    config: Config,
    result: AuditResult,
    signals: Signals,
    truth: TruthFile | None,
    progress: Progress | None = None,
) -> RuleStudy:
    """Study the rule of a judged log, with the thresholds that this log alone supports.

    Args:
        prepared, run, inputs, config, signals: as it was judged.
        result: of the audit.
        truth: known contacts, if any; labels of the log that the configuration names count as well.
        progress: called with steps done and in all.
    """
    contact = known_contact(prepared, config, truth)
    events = (result.collisions, result.near_misses)
    evidence = evidence_of(result.log, inputs.rule, signals, result.phases, events, contact)
    period = result.log.sample_period_s

    def gammas_at(n: int) -> Mapping[str, float | None]:
        rules = recommended_of_log(evidence, n * period, config.study.per_hour)
        return {joint: rule.gamma_nm for joint, rule in rules.items()}

    study = study_rule(
        StudiedLog(prepared, run, inputs, config, result.log, evidence.free, contact), gammas_at, progress
    )
    rule = result.rule
    arm = unsuspicious(ArmEvidence((evidence,), evidence.watched), rule.persistence_s)
    gammas = {joint: gamma for joint, gamma in rule.gamma_nm.items() if joint in arm.joints}
    opinions = judge_set_rules(arm, gammas, rule.persistence_s, config.study.per_hour)
    return replace(study, set_rules=opinions, units=dict(result.log.units))


def known_contact(prepared: Prepared, config: Config, truth: TruthFile | None) -> Times | None:
    """Start and end of all contacts of a log, s; none where it is stated to be free of them, None where unknown."""
    if config.fit.contact == "none":
        return ()
    if truth is not None:
        return contact_times(truth, prepared.judged)
    return label_times(prepared.series.annotations, config.detect.true_events)
