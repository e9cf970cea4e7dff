"""Thresholds of still joints that are judged for changes: from what their torque does by itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from collaudit.core.config.schema import Config
from collaudit.core.findings import Finding
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.prepare.quiet_level import QuietLevel


def with_rest_thresholds(config: Config, levels: Mapping[str, QuietLevel], joints: Sequence[str]) -> Config:
    """The configuration with their thresholds, N·m, where it states none; unchanged where it does.

    Args:
        config: as given.
        levels: of the joints judged for changes.
        joints: all judged joints; those without a level keep what is configured for all.
    """
    detect = config.detect
    automatic = detect.gamma_nm == "auto"
    if not levels or ("gamma_nm" in detect.given and not automatic):
        return config
    if automatic and len(levels) < len(joints):
        return config
    common = detect.gamma_nm if isinstance(detect.gamma_nm, float) else 0.0
    gamma = {joint: levels[joint].gamma_nm if joint in levels else common for joint in joints}
    return config.changed({"detect": detect.changed({"gamma_nm": gamma})})


def change_findings(
    prepared: Prepared, levels: Mapping[str, QuietLevel], gamma_nm: Mapping[str, float]
) -> list[Finding]:
    """That joints were judged for changes only, and what that cannot see.

    Args:
        prepared: the log.
        levels: of the joints judged so.
        gamma_nm: thresholds that were applied.
    """
    if not levels:
        return []
    some = next(iter(levels.values()))
    offsets = ", ".join(f"{joint} {float(np.nanmedian(one.level_nm)):.3g}" for joint, one in levels.items())
    held = "" if prepared.effort_source == "joint" else ", nor one that the friction of the gears holds"
    text = (
        "The arm never moves and friction is not known: joints were judged for changes of torque against their own "
        f"quiet level (estimated from {some.quiet_s:.3g} s without a touch). A load that stays constant for "
        f"{some.stretch_s:.3g} s cannot be seen{held}. Constant difference from the model, N·m: {offsets}."
    )
    findings = [Finding("judged-for-changes", "warning", text)]
    for joint, one in levels.items():
        if gamma_nm.get(joint, np.inf) < one.gamma_nm:
            text = (
                f"The threshold of joint '{joint}', {gamma_nm[joint]:.3g} N·m, is below {one.gamma_nm:.3g} N·m: what "
                "its torque does by itself at rest, with a margin."
            )
            findings.append(Finding("change-threshold", "warning", text, joint=joint))
    return findings
