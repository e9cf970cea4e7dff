"""How long a stretch without measurements has to be to hide a contact."""

from __future__ import annotations

from math import ceil

from collaudit.core.config.schema_detect import DEFAULT_PERSISTENCE_MS, DetectConfig

#: Rounding of a persistence in samples.
_ROUNDING = 1e-3
#: Two values are on a straight line always.
_SHORTEST = 3


def shortest_stretch(detect: DetectConfig, period_s: float) -> int:
    """Samples of it: as many as an alarm needs.

    Args:
        detect: the rule.
        period_s: usual step between stamps.
    """
    asked_s = (detect.persistence_ms or DEFAULT_PERSISTENCE_MS) / 1e3
    return max(_SHORTEST, detect.n or ceil(asked_s / period_s - _ROUNDING))
