"""One log judged: its rule, the residual, alarms and near misses, and what they leave to say."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.config.schema import Config
from collaudit.core.data.audit_result import Collision, ResidualStats
from collaudit.core.data.cycles_result import CycleReference
from collaudit.core.data.detection_result import DetectionFacts
from collaudit.core.data.recommendation_result import FittedThresholds
from collaudit.core.data.signals import Signals, State
from collaudit.core.data.uniform_series import UniformSeries
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
    with_rest_thresholds,
)
from collaudit.core.detection.position_pattern import pattern_findings
from collaudit.core.detection.rest_steps import RestStep, rest_steps
from collaudit.core.detection.rule_reach import reach_findings
from collaudit.core.detection.rule_settings import watch_findings
from collaudit.core.detection.settled_rule import settled, with_common_rule
from collaudit.core.detection.unjudged_time import unjudged_effort_findings
from collaudit.core.findings import Finding, joints_not_judged
from collaudit.core.friction.applied_friction import AppliedFriction
from collaudit.core.identification.channel_audit import late_effort_findings
from collaudit.core.numeric.parallel import Progress, by_name, ordered_map
from collaudit.core.numeric.stats import quantile_of
from collaudit.core.prepare.prepared import Prepared


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
    rest_steps: tuple[RestStep, ...]
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
    common = with_common_rule(settled(prepared, applied, config, thresholds), parts)
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
