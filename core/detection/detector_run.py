"""One detector applied to one log: balance, residual, threshold, events."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from collaudit.core.config.schema import Config
from collaudit.core.data.audit_result import RuleFacts
from collaudit.core.data.detection_result import DelayFacts, DetectorEvent, DetectorFacts
from collaudit.core.data.signals import State
from collaudit.core.detection.events import DetectedEvents, detect_events
from collaudit.core.detection.threshold import Threshold
from collaudit.core.detection.watch import Watch
from collaudit.core.friction.friction_model import FrictionModel
from collaudit.core.prepare.prepared import Prepared, judged_series
from collaudit.core.residual.balance import Balance
from collaudit.core.residual.energy import energy_residual
from collaudit.core.residual.judged_balance import judged_balance
from collaudit.core.residual.residual import Residual, compute_residual


@dataclass(frozen=True, slots=True, eq=False)
class DetectorRun:
    """What one detector made of a log; ``threshold`` is the level its residual had to exceed."""

    balance: Balance
    residual: Residual
    threshold: Threshold
    detected: DetectedEvents


@dataclass(frozen=True, slots=True)
class DetectionInputs:
    """What every detector shares: friction laws, joints that contradict the model, the rule, watched joints."""

    laws: Mapping[str, FrictionModel]
    contradicted: frozenset[str]
    rule: RuleFacts
    watch: Mapping[str, Watch]


def run_detector(prepared: Prepared, inputs: DetectionInputs, config: Config, name: str | None = None) -> DetectorRun:
    """Apply the configured detector, or the named one."""
    series = judged_series(prepared)
    balance = judged_balance(prepared, config.detect, name)
    if balance.engine.scalar:
        residual = energy_residual(prepared, inputs.laws, inputs.contradicted, config.detect)
    else:
        residual = compute_residual(series, balance, inputs.laws, inputs.contradicted, config.detect)
    threshold = Threshold(series, balance, residual, inputs.rule, config.detect)
    detected = detect_events(
        series,
        residual,
        threshold.of,
        inputs.rule,
        inputs.watch,
        prepared.phases,
        config,
        scalar=balance.engine.scalar,
    )
    return DetectorRun(balance, residual, threshold, detected)


def delay_facts(balance: Balance, rule: RuleFacts, period_s: float) -> DelayFacts:
    """Delay of a detector in its parts."""
    return DelayFacts(balance.kernel.delay_s, rule.persistence_s, period_s, balance.kernel.noise_gain(period_s))


def detector_facts(found: DetectorRun, rule: RuleFacts, joints: tuple[str, ...], period_s: float) -> DetectorFacts:
    """A detector's outcome for the side-by-side table."""
    levels: dict[str, float | None] = {}
    for j, joint in enumerate(joints):
        x = found.residual.torque_nm[found.detected.state[:, j] == State.JUDGED, j]
        levels[joint] = float(np.mean(np.abs(x))) if x.size else None
    events = tuple(
        DetectorEvent(c.joint, c.onset_s, c.detected_s, c.duration_s, c.peak_nm) for c in found.detected.collisions
    )
    return DetectorFacts(delay_facts(found.balance, rule, period_s), events, len(found.detected.near_misses), levels)
