"""The study of one log's rule: planes, added contacts, force map, what thresholds are made of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import sqrt

import numpy as np

from collaudit.core.config.schema import Config
from collaudit.core.data.audit_result import AuditResult, LogFacts
from collaudit.core.data.rule_study_result import (
    STUDY_SCHEMA,
    ForceMap,
    JointPlane,
    RuleSensitivity,
    RuleStudy,
    ThresholdParts,
)
from collaudit.core.data.signals import Signals, State
from collaudit.core.detection.detector_run import DetectionInputs, DetectorRun
from collaudit.core.detection.rule import MERGE_S
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray, Span
from collaudit.core.numeric.stage_progress import Progress, stage
from collaudit.core.numeric.stats import robust_sd
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.recommend.arm_evidence import ArmEvidence, Times, evidence_of
from collaudit.core.recommend.joint_thresholds import judge_set_rules, recommend_joints
from collaudit.core.recommend.outlying_peaks import unsuspicious
from collaudit.core.rule_study.arm_contacts import (
    AddedContacts,
    added_contacts,
    contact_sensitivities,
    labelled_curve,
)
from collaudit.core.rule_study.force_map import force_map
from collaudit.core.rule_study.injected_contacts import (
    REFERENCE_PUSH,
    SHAPES,
    open_moments,
    spread_moments,
)
from collaudit.core.rule_study.joint_plane import AddedTorque, JointSeries, frontier, joint_plane, plane_point
from collaudit.core.rule_study.shown_torque import judges_joints, margin_samples, through_filters, windows
from collaudit.core.rule_study.threshold_parts import PartInputs, threshold_parts
from collaudit.core.scoring.detection_score import TruthFile
from collaudit.core.scoring.known_events import contact_times, label_times
from collaudit.core.verdict.noticed_push import Push, noticed_torque

#: Moments that planes and the map are computed at.
_PUSH_MOMENTS, _MAP_MOMENTS = 160, 400
_SEED = 20210316


@dataclass(frozen=True, slots=True, eq=False)
class StudiedLog:
    """One judged log, and which of its time is free of contact.

    Attributes:
        prepared, run, inputs, config: as it was judged.
        log: its facts.
        free: (n,) samples away from any contact.
        contact: known contacts, s; None where none are known, and alarms are taken for contact.
    """

    prepared: Prepared
    run: DetectorRun
    inputs: DetectionInputs
    config: Config
    log: LogFacts
    free: BoolArray
    contact: Times | None = None

    @property
    def columns(self) -> list[int]:
        """Of the watched joints."""
        return [self.prepared.judged_series.column(joint) for joint in self.inputs.rule.watch]

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the watched joints."""
        return self.inputs.rule.watch


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
    rule, contact = inputs.rule, known_contact(prepared, config, truth)
    events = (result.collisions, result.near_misses)
    evidence = evidence_of(result.log, rule, signals, result.phases, events, contact)
    arm = unsuspicious(ArmEvidence((evidence,), evidence.watched), rule.persistence_s)
    rules, found = recommend_joints(arm, rule.persistence_s, config.study.per_hour)
    supported = {joint: one.gamma_nm for joint, one in rules.items() if one.gamma_nm is not None}
    studied = StudiedLog(prepared, run, inputs, config, result.log, evidence.free, contact)
    study = study_rule(studied, supported, progress)
    opinions = judge_set_rules(rules, found, rule.gamma_nm, config.study.per_hour)
    return replace(study, set_rules=opinions, units=dict(result.log.units))


def known_contact(prepared: Prepared, config: Config, truth: TruthFile | None) -> Times | None:
    """Start and end of all contacts of a log, s; none where it is stated to be free of them, None where unknown."""
    if config.fit.contact == "none":
        return ()
    if truth is not None:
        return contact_times(truth, prepared.judged)
    return label_times(prepared.series.annotations, config.detect.true_events)


def study_rule(studied: StudiedLog, supported: Mapping[str, float], progress: Progress | None = None) -> RuleStudy:
    """Everything that a log tells of its rule and of others.

    Args:
        studied: the log.
        supported: by joint, thresholds that the evidence supports at the configured persistence.
        progress: called with steps done and in all.
    """
    rule = studied.inputs.rule
    added = _added(studied, stage(progress, 0.0, 0.6)) if judges_joints(studied.run) else []
    chosen = {joint: supported[joint] for joint in studied.joints if joint in supported}
    chosen = chosen if len(chosen) == len(studied.joints) else {}
    step = stage(progress, 0.0, 1.0)
    step(7, 10)
    planes = {joint: _plane(studied, j, chosen) for j, joint in zip(studied.columns, studied.joints, strict=True)}
    set_nm = {joint: rule.gamma_nm[joint] for joint in studied.joints}
    rules = [_rule("configured", added, set_nm, rule.n)] if added else []
    if added and chosen:
        rules.append(_rule("recommended", added, chosen, rule.n))
    step(9, 10)
    push = next((contacts for contacts in added if contacts.shape == REFERENCE_PUSH), None)
    return RuleStudy(
        schema=STUDY_SCHEMA,
        log=studied.log.name,
        log_sha256=studied.log.sha256,
        period_s=studied.log.sample_period_s,
        joints=planes,
        rules=tuple(rules),
        force_map=_map(studied),
        parts=_parts(studied),
        labelled=labelled_curve(studied.prepared, studied.run, studied.inputs, studied.contact or (), push),
        assumptions=tuple(_assumptions(studied, bool(added))),
    )


def _added(studied: StudiedLog, progress: Progress) -> list[AddedContacts]:
    """Contacts of every shape."""
    found = []
    for k, shape in enumerate(SHAPES, 1):
        contacts = added_contacts(
            studied.prepared,
            studied.run,
            studied.inputs,
            shape,
            studied.free,
            studied.config.study.contacts,
            studied.config.robot.tool.frame,
        )
        found.append(contacts)
        progress(k, len(SHAPES))
    return [contacts for contacts in found if contacts is not None]


def _rule(name: str, added: list[AddedContacts], gamma_nm: dict[str, float], n: int) -> RuleSensitivity:
    contacts = [c for one in added for c in contact_sensitivities(one, gamma_nm, list(gamma_nm), n)]
    return RuleSensitivity(name, gamma_nm, n, tuple(contacts))


def joint_series(studied: StudiedLog, j: int) -> JointSeries:
    """One joint's residual with its clean samples."""
    series, residual, state = studied.prepared.judged_series, studied.run.residual, studied.run.detected.state
    clean = np.asarray((state[:, j] <= State.FRICTION_INTERVAL) & studied.free)
    merge = round(MERGE_S / series.period_s)
    torque, doubt = (np.ascontiguousarray(x[:, j]) for x in (residual.torque_nm, residual.uncertainty_nm))
    return JointSeries(torque, doubt, clean, series.period_s, merge)


def _plane(studied: StudiedLog, j: int, chosen: Mapping[str, float]) -> JointPlane:
    joint, rule = joint_series(studied, j), studied.inputs.rule
    name = studied.prepared.judged_series.joint_names[j]
    push = _pushed(studied, j)
    plane = joint_plane(joint, rule.gamma_nm[name], rule.n, push)
    point = plane_point(joint, chosen[name], rule.n, push) if chosen else None
    return replace(plane, chosen=point, frontier=frontier(plane))


def _pushed(studied: StudiedLog, j: int) -> AddedTorque | None:
    """Pushes of a newton metre on a joint at judged moments; None where no moment is, or nothing is known of it."""
    series, run = studied.prepared.judged_series, studied.run
    if not judges_joints(run):
        return None
    kernel, period = run.residual.balance.kernel, series.period_s
    margin = margin_samples(kernel, series.bandwidth_hz, period)
    after = round(REFERENCE_PUSH.duration_s / period) + margin
    moments = open_moments(series, studied.free, margin, after)
    moments = moments[run.detected.state[moments, j] <= State.FRICTION_INTERVAL]
    if moments.size == 0:
        return None
    moments = spread_moments(moments, _PUSH_MOMENTS, np.random.default_rng(_SEED))
    samples: IntArray = moments[:, None] + np.arange(-margin, after)
    around = windows(series, run, studied.inputs.laws, [j], samples)
    time_s: FloatArray = period * np.arange(-margin, after, dtype=np.float64)
    unit = through_filters(REFERENCE_PUSH.values(time_s, period)[None, None, :], kernel, series.bandwidth_hz, period)
    sign = np.where(np.arange(moments.size) % 2 == 0, 1.0, -1.0)
    return AddedTorque(around, sign[None, :, None] * unit)


def _map(studied: StudiedLog) -> ForceMap | None:
    """The smallest force over the poses of the log that a push of the duration asked for needs."""
    series, run, n = studied.prepared.judged_series, studied.run, studied.inputs.rule.n
    if not judges_joints(run) or not studied.columns:
        return None
    push = Push.of(studied.config.policy.observable_ms / 1e3, run.residual.balance.kernel, n, series.period_s)
    known = np.asarray((run.detected.state <= State.FRICTION_INTERVAL).any(axis=1))
    samples = push.moments(known, _MAP_MOMENTS)
    level = np.full((samples.size, len(series.joint_names)), np.inf)
    for j in studied.columns:
        level[:, j] = noticed_torque(run, j, push, samples)
    return force_map(studied.prepared, level, samples, studied.config.robot.tool.frame)


def _parts(studied: StudiedLog) -> dict[str, ThresholdParts]:
    """What each threshold is made of, where the model is known."""
    prepared, series = studied.prepared, studied.prepared.judged_series
    if prepared.rigid_nm is None or series.effort is None or not judges_joints(studied.run):
        return {}
    columns = prepared.columns()
    gravity = prepared.robot.gravity_torque(prepared.series.position_rad)
    motion = np.nan_to_num(np.asarray(series.acceleration_rad_s2))
    out = {}
    for j, name in zip(studied.columns, studied.joints, strict=True):
        joint, column = joint_series(studied, j), columns[j]
        inputs = PartInputs(
            joint.residual_nm,
            joint.uncertainty_nm,
            joint.clean,
            np.asarray(studied.run.detected.state[:, j] == State.FRICTION_INTERVAL),
            series.position_rad[:, j],
            series.velocity_rad_s[:, j],
            gravity[:, column],
            prepared.rigid_nm[:, column] - gravity[:, column],
            motion,
            _sensor_noise(studied, j),
            series.period_s,
        )
        found = threshold_parts(inputs, studied.inputs.rule.n)
        if found is not None:
            out[name] = found
    return out


def _sensor_noise(studied: StudiedLog, j: int) -> FloatArray:
    """(n,) made-up noise, as white and as large as that of a joint's effort, as it passes the kernel."""
    series, kernel = studied.prepared.judged_series, studied.run.residual.balance.kernel
    assert series.effort is not None
    bend = np.diff(series.effort[:, j], 2)
    bend = bend[np.isfinite(bend)]
    white = robust_sd(bend) / sqrt(6.0) if bend.size else 0.0
    made = white * np.random.default_rng([_SEED, j]).normal(size=(series.time_s.size, 1))
    return kernel.apply(made, [Span(0, series.time_s.size)], series.period_s)[:, 0]


def _assumptions(studied: StudiedLog, added: bool) -> list[str]:
    """What the numbers rest on."""
    out = []
    if studied.contact is None:
        out.append(
            "Nothing is known of contact in this log: half a second around alarms and near misses of any joint at the "
            "configured rule was left out, so alarms of lower thresholds are counted in the quieter rest only."
        )
    if not added:
        out.append("No contacts could be added: this needs a robot model and a detector with one residual per joint.")
        return out
    out += [
        "Added contacts keep the recorded motion, and act on the arm in the poses that it was in, in the direction of "
        "their link.",
        "They pass the filters of the motion as well as that of the detector, since a knock reaches the "
        "residual through the motion.",
        "The delay of a contact is that of this residual"
        + (
            "."
            if studied.config.detect.causal
            else ", whose filters look both ways in time: the delay of a controller's own filter comes on top."
        ),
        "Friction of a standing joint takes up a push first. Real pushes move the arm and show more than "
        "injected ones.",
    ]
    return out
