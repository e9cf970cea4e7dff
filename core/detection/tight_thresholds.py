"""Thresholds that are stated, against those that the fit's held-out residual asks for."""

from __future__ import annotations

from collections.abc import Sequence

from collaudit.core.config.schema import Config
from collaudit.core.data.audit_result import Collision, RuleFacts
from collaudit.core.data.threshold_result import FittedThresholds
from collaudit.core.detection.fitted_rule import level_at, usable_thresholds
from collaudit.core.findings import Finding
from collaudit.core.numeric.stats import MARGIN


def tight_threshold_findings(
    rule: RuleFacts,
    thresholds: FittedThresholds | None,
    config: Config,
    alarms: Sequence[Collision],
) -> list[Finding]:
    """Joints whose stated threshold the residual of the fitted logs exceeds, without contact.

    Args:
        rule: thresholds and persistence as applied.
        thresholds: of the friction file; None without a file, or of an older one.
        config: the detector whose residual is judged.
        alarms: of the log.
    """
    usable, _ = usable_thresholds(thresholds, config)
    if usable is None:
        return []
    out = []
    for joint, gamma in rule.gamma_nm.items():
        known = usable.joints.get(joint)
        level = None if known is None else level_at(known, rule.n, rule.persistence_s)
        if known is None or level is None or MARGIN * gamma >= level.gamma_nm:
            continue
        own = [abs(alarm.peak_nm) for alarm in alarms if alarm.joint == joint]
        text = (
            f"The threshold of joint '{joint}', {gamma:.3g} N·m, is below what the fit's held-out residual reaches "
            f"without contact: for {1e3 * rule.persistence_s:.3g} ms it asks for {level.gamma_nm:.3g} N·m"
        )
        if known.rms_nm is not None:
            text += f" (its RMS is {known.rms_nm:.3g} N·m)"
        text += (
            ". Likely causes are a spring, cable or payload that the model lacks, or friction that is off: find the "
            "cause before a higher threshold is set"
        )
        if own:
            below = sum(peak < level.gamma_nm for peak in own)
            text += f"; {below} of this joint's {len(own)} alarms in this log stay below that"
        out.append(Finding("gamma-too-tight", "warning", text + ".", joint=joint))
    return out
