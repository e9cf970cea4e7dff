"""Thresholds of still joints that are judged for changes: from what their torque does by itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from collaudit.core.config.schema import Config
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
    if not levels or ("gamma_nm" in detect.model_fields_set and not automatic):
        return config
    if automatic and len(levels) < len(joints):
        return config
    common = detect.gamma_nm if isinstance(detect.gamma_nm, float) else 0.0
    gamma = {joint: levels[joint].gamma_nm if joint in levels else common for joint in joints}
    return config.model_copy(update={"detect": detect.model_copy(update={"gamma_nm": gamma})})
