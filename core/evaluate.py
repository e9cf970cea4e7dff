"""One detector applied to one log: balance, residual, threshold, events."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from collaudit.core.config.schema import Config
from collaudit.core.detectors.balance import Balance
from collaudit.core.detectors.energy import energy_residual
from collaudit.core.detectors.judged import judged_balance
from collaudit.core.friction.model import FrictionModel
from collaudit.core.judge import Judgement, judge
from collaudit.core.prepare import Prepared, judged_series
from collaudit.core.residual import Residual, compute_residual
from collaudit.core.result import RuleFacts
from collaudit.core.result_detection import DelayFacts, DetectorEvent, DetectorFacts
from collaudit.core.signals import State
from collaudit.core.threshold import Threshold
from collaudit.core.watch import Watch


@dataclass(frozen=True, slots=True, eq=False)
class Evaluation:
    """What one detector made of a log; ``threshold`` is the level its residual had to exceed."""

    balance: Balance
    residual: Residual
    threshold: Threshold
    judgement: Judgement


@dataclass(frozen=True, slots=True)
class Grounds:
    """What every detector shares: friction laws, joints that contradict the model, the rule, watched joints."""

    laws: Mapping[str, FrictionModel]
    contradicted: frozenset[str]
    rule: RuleFacts
    watch: Mapping[str, Watch]


def evaluate(prepared: Prepared, grounds: Grounds, config: Config, name: str | None = None) -> Evaluation:
    """Apply the configured detector, or the named one."""
    series = judged_series(prepared)
    balance = judged_balance(prepared, config.detect, name)
    if balance.engine.scalar:
        residual = energy_residual(prepared, grounds.laws, grounds.contradicted, config.detect)
    else:
        residual = compute_residual(series, balance, grounds.laws, grounds.contradicted, config.detect)
    threshold = Threshold(series, balance, residual, grounds.rule, config.detect)
    judgement = judge(
        series,
        residual,
        threshold.of,
        grounds.rule,
        grounds.watch,
        prepared.phases,
        config,
        scalar=balance.engine.scalar,
    )
    return Evaluation(balance, residual, threshold, judgement)


def delay_facts(balance: Balance, rule: RuleFacts, period_s: float) -> DelayFacts:
    """Delay of a detector in its parts."""
    return DelayFacts(balance.kernel.delay_s, rule.persistence_s, period_s, balance.kernel.noise_gain(period_s))


def detector_facts(found: Evaluation, rule: RuleFacts, joints: tuple[str, ...], period_s: float) -> DetectorFacts:
    """A detector's outcome for the side-by-side table."""
    levels: dict[str, float | None] = {}
    for j, joint in enumerate(joints):
        x = found.residual.torque_nm[found.judgement.state[:, j] == State.JUDGED, j]
        levels[joint] = float(np.mean(np.abs(x))) if x.size else None
    events = tuple(
        DetectorEvent(c.joint, c.onset_s, c.detected_s, c.duration_s, c.peak_nm) for c in found.judgement.collisions
    )
    return DetectorFacts(delay_facts(found.balance, rule, period_s), events, len(found.judgement.near_misses), levels)
