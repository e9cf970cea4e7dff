"""One log judged: its rule, the residual, alarms and near misses, and what they leave to say.

A log of which each part is judged by a fit that has not seen it has one rule all the same: the lowest threshold of its
parts. Where the other parts of the log ask for more, the threshold in force is raised.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.config.schema import Config
from collaudit.core.data.audit_result import Collision, ResidualStats
from collaudit.core.data.detection_result import DetectionFacts, RestDisturbance
from collaudit.core.data.joint_log import UniformSeries
from collaudit.core.data.recommendation_result import FittedThresholds, MotionLevels
from collaudit.core.data.signals import CycleReference, Signals, State
from collaudit.core.detection.detection_findings import (
    detection_findings,
    model_worth_findings,
    residual_level_findings,
    scatter_findings,
    spike_findings,
)
from collaudit.core.detection.detector_run import (
    DetectionInputs,
    DetectorRun,
    Settled,
    detection_facts,
    judged_signals,
    run_detector,
)
from collaudit.core.detection.fitted_rule import (
    change_findings,
    tight_threshold_findings,
    with_fitted_thresholds,
    with_rest_thresholds,
)
from collaudit.core.detection.position_pattern import pattern_findings
from collaudit.core.detection.rest_steps import rest_steps
from collaudit.core.detection.rule_settings import make_rule, reach_findings, watch_findings
from collaudit.core.detection.unjudged_time import unjudged_effort_findings
from collaudit.core.findings import Finding, fact, joints_not_judged
from collaudit.core.friction.applied_friction import AppliedFriction
from collaudit.core.identification.channel_audit import late_effort_findings
from collaudit.core.identification.log_cleaning import find_contact
from collaudit.core.numeric.arrays import BoolArray
from collaudit.core.numeric.parallel import Progress, by_name, ordered_map
from collaudit.core.numeric.stats import quantile_of
from collaudit.core.prepare.effort_smoothing import Friction
from collaudit.core.prepare.hand_guiding import with_effort_smoothing, without_guiding
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.residual.followed_offsets import BOUND_SHARE


@dataclass(frozen=True, slots=True, eq=False)
class Judged:
    """What detection made of a log.

    Attributes:
        prepared: the log, hand guiding and smoothing marked that its friction shows.
        series: its judged joints.
        config: with numbers in place of "auto".
        applied: friction laws.
        thresholds: of the friction file, if any.
        automatic: whether they are the ones in use.
        choices: findings on how thresholds were chosen.
        inputs: the rule, watched joints, joints that a finding forbids judging.
        run: the detector's residual, alarms and near misses.
        signals: sample by sample.
        stats: level of the residual by joint.
        facts: of the detection; contacts, controller alarms and scores come later.
        rest_steps: steps of standing joints.
        checked: what the checks say of it.
    """

    prepared: Prepared
    series: UniformSeries
    config: Config
    applied: AppliedFriction
    thresholds: FittedThresholds | None
    automatic: bool
    choices: tuple[Finding, ...]
    inputs: DetectionInputs
    run: DetectorRun
    signals: Signals
    stats: dict[str, ResidualStats]
    facts: DetectionFacts
    rest_steps: tuple[RestDisturbance, ...]
    checked: tuple[Finding, ...] = ()


#: Every check of a judged log, in the order in which it is said.
CHECKS: tuple[Callable[[Judged], Iterable[Finding]], ...] = (
    lambda log: tight_threshold_findings(
        log.inputs.rule, None if log.automatic else log.thresholds, log.config, log.run.detected.collisions
    ),
    lambda log: watch_findings(log.inputs.watch),
    lambda log: change_findings(log.prepared, log.applied.quiet, log.applied.laws, log.inputs.rule.gamma_nm),
    lambda log: reach_findings(log.prepared, log.inputs.rule),
    lambda log: pattern_findings(log.signals, log.inputs.rule.gamma_nm),
    lambda log: residual_level_findings(log.signals, log.stats, log.inputs.rule.gamma_nm, _fitted_nm(log)),
    lambda log: scatter_findings(log.applied.fits, log.inputs.rule.gamma_nm),
    lambda log: detection_findings(log.series, log.run, log.inputs, log.facts.friction_level),
    lambda log: unjudged_effort_findings(log.prepared, log.run, log.inputs),
    lambda log: model_worth_findings(log.prepared, log.run, log.inputs),
    lambda log: spike_findings(log.series, log.run.detected.collisions),
    lambda log: late_effort_findings(log.prepared, log.config) if log.run.detected.collisions else (),
)


def _fitted_nm(log: Judged) -> dict[str, float]:
    """By joint the robust standard deviation of the detector's residual in the fitted motion; empty where unknown."""
    fitted = log.thresholds
    if fitted is None or fitted.detector != log.config.detect.detector:
        return {}
    return {joint: one.noise_nm for joint, one in fitted.joints.items() if one.noise_nm is not None}


def judge(
    prepared: Prepared,
    applied: AppliedFriction,
    config: Config,
    thresholds: FittedThresholds | None,
    step: Progress,
    parts: Sequence[Settled] = (),
    earlier: tuple[CycleReference, ...] = (),
) -> Judged:
    """Rule, residual and alarms of one log, and what the checks say of it.

    Of a joint that a finding excludes nothing is judged, neither pass nor fail: where a check of what was judged finds
    such a joint, the log is judged without it.

    Args:
        prepared: the log.
        applied: its friction laws, which tell what its drives supply.
        config: thresholds, persistence, watched joints.
        thresholds: of the friction file, for "auto".
        step: called with steps done and in all.
        parts: of the log, where each is judged by a fit of its own; the fit of all of it is then only shown.
        earlier: what passed nights say of the program's cycles.

    Raises:
        NotJudgedError: the persistence is longer than the log.
    """
    automatic = with_rest_thresholds(config, applied.quiet, prepared.judged).detect.automatic
    common = _with_common_rule(settled(prepared, applied, config, thresholds), parts)
    prepared, config, choices, inputs = common.prepared, common.config, common.choices, common.inputs
    inputs = replace(inputs, earlier=earlier)
    series, rule, forbidden = prepared.judged_series, inputs.rule, inputs.not_judged

    def run_with(inputs: DetectionInputs) -> Judged:
        run = run_detector(prepared, inputs, config, parts)
        signals = judged_signals(series, run, rule)
        judged = Judged(
            prepared=prepared,
            series=series,
            config=config,
            applied=applied,
            thresholds=thresholds,
            automatic=automatic,
            choices=choices,
            inputs=inputs,
            run=run,
            signals=signals,
            stats=by_name(
                lambda joint: _residual_stats(series, signals, run.detected.collisions, joint),
                series.joint_names,
            ),
            facts=detection_facts(run, rule, config.detect.causal, series.period_s),
            rest_steps=rest_steps(prepared, run, inputs),
        )
        found = ordered_map(lambda check: list(check(judged)), CHECKS)
        return replace(judged, checked=tuple(finding for its in found for finding in its))

    step(3, 10)
    judged = run_with(inputs)
    step(7, 10)
    excluded = joints_not_judged(judged.checked, prepared.judged) - forbidden
    if excluded:
        why = [finding for finding in judged.checked if joints_not_judged([finding], excluded)]
        judged = run_with(replace(inputs, not_judged=forbidden | excluded))
        judged = replace(judged, checked=tuple(dict.fromkeys((*why, *judged.checked))))
    return judged


#: Samples count as clean so far from a collision of their joint, s.
_AROUND_EVENT_S = 0.5


def _residual_stats(
    series: UniformSeries, signals: Signals, collisions: Sequence[Collision], joint: str
) -> ResidualStats:
    """Level of one joint's residual over what was judged, and away from its collisions, at its temperature."""
    k = signals.joint_names.index(joint)
    judged = np.asarray(signals.state[:, k] == State.JUDGED)
    events = [(c.onset_s, c.onset_s + c.duration_s) for c in collisions if c.joint == joint]
    clean = judged & ~signals.inside([(a - _AROUND_EVENT_S, b + _AROUND_EVENT_S) for a, b in events])
    seconds = float(np.count_nonzero(judged)) * series.period_s
    residual = signals.residual_nm[:, k]
    low_c, mean_c, high_c = series.temperatures_c(joint) or (None, None, None)
    range_c = None if low_c is None or high_c is None else (low_c, high_c)
    x = residual[judged]
    if x.size == 0:
        return ResidualStats(None, None, None, None, seconds, temperature_c=mean_c, temperature_range_c=range_c)
    np.abs(x, out=x)
    mean, rms, most = float(np.mean(x)), float(np.sqrt(np.mean(x**2))), float(np.max(x))
    p99 = quantile_of(x, 0.99)
    x = residual[clean]
    np.abs(x, out=x)
    return ResidualStats(
        mean_abs_nm=mean,
        rms_nm=rms,
        p99_nm=p99,
        max_abs_nm=most,
        judged_s=seconds,
        clean_mean_abs_nm=float(np.mean(x)) if x.size else None,
        clean_s=float(x.size) * series.period_s,
        temperature_c=mean_c,
        temperature_range_c=range_c,
    )


def settled(
    prepared: Prepared,
    applied: AppliedFriction,
    config: Config,
    thresholds: FittedThresholds | None,
    rows: BoolArray | None = None,
) -> Settled:
    """What one fit gives before anything is judged: numbers in place of "auto", the rule, what its detector needs.

    Arguments and errors as of :func:`judge`; ``rows`` (n,) of a part that the fit has not seen.
    """
    friction = {joint: law.torque for joint, law in applied.laws.items()}
    prepared = _with_smoothing(without_guiding(prepared, friction, config), friction, config)
    series = prepared.judged_series
    config = with_rest_thresholds(config, applied.quiet, series.joint_names)
    automatic = config.detect.automatic
    config, motion, choices = with_fitted_thresholds(config, thresholds, applied.quiet, series)
    rule, watch = make_rule(series, prepared.phases, config, motion)
    gamma_nm, beyond_nm = rule.gamma_nm, motion.beyond_nm if automatic else rule.gamma_nm
    quiet = {
        joint: replace(level, gamma_nm=gamma_nm[joint], beyond_nm=beyond_nm.get(joint, np.inf))
        for joint, level in applied.quiet.items()
        if joint in gamma_nm
    }
    inputs = DetectionInputs(
        applied.laws,
        joints_not_judged((*prepared.findings, *choices), prepared.judged),
        rule,
        watch,
        quiet=quiet,
        covered=motion.known,
        zero_bound_nm={joint: BOUND_SHARE * gamma_nm[joint] for joint in rule.motion_nm},
    )
    return Settled(prepared, config, tuple(choices), inputs, rows)


def _with_common_rule(whole: Settled, parts: Sequence[Settled]) -> Settled:
    """The log with the rule that its parts have in common; as it is without parts.

    A joint that one part cannot judge is not judged in any.

    Args:
        whole: by the fit of all of it.
        parts: by the fit of each part's rest.
    """
    if not parts:
        return whole
    prepared = whole.prepared
    gamma_nm = [part.inputs.rule.gamma_nm for part in parts]
    motion = MotionLevels(
        _lowest([part.inputs.rule.motion_nm for part in parts]),
        _lowest([part.inputs.rule.at_rest_nm for part in parts]),
    )
    config = whole.config.changed({"detect": whole.config.detect.changed({"gamma_nm": _lowest(gamma_nm)})})
    rule, watch = make_rule(prepared.judged_series, prepared.phases, config, motion)
    said = {(one.code, one.joint): one for part in parts for one in part.choices if one.severity != "info"}
    ranges = (f"{joint} {low:.3g} to {max(one[joint] for one in gamma_nm):.3g}" for joint, low in rule.gamma_nm.items())
    text = f"Thresholds of the {len(parts)} parts of the log, each told from the others, N·m: {', '.join(ranges)}."
    choices = (*said.values(), fact(text))
    found = [finding for part in parts for finding in part.prepared.findings]
    inputs = replace(
        whole.inputs,
        rule=rule,
        watch=watch,
        not_judged=joints_not_judged((*prepared.findings, *found, *choices), prepared.judged),
    )
    return Settled(prepared, config, choices, inputs)


def _lowest(parts: Sequence[Mapping[str, float]]) -> dict[str, float]:
    """By joint the least number, of joints that all parts know."""
    return {joint: min(part[joint] for part in parts) for joint in parts[0] if all(joint in part for part in parts)}


def _with_smoothing(prepared: Prepared, friction: Mapping[str, Friction], config: Config) -> Prepared:
    """How far efforts are smoothed, beside contact: a controller that yields to it looks like a filter there."""
    whole = with_effort_smoothing(prepared, friction)
    if not any(one.shown for one in whole.effort_smoothing.values()):
        return whole
    contact, facts = find_contact(prepared)
    beside = with_effort_smoothing(prepared, friction, contact)
    return whole if facts.refused or not beside.effort_smoothing else beside
