"""Rule (6) alone, without near misses."""

from __future__ import annotations

from collaudit.core.detection.rule import Event, Level, rule_events
from collaudit.core.numeric.arrays import BoolArray, FloatArray


def collisions(residual: FloatArray, evidence: BoolArray, gamma: Level, n: int, merge_samples: int = 0) -> list[Event]:
    """Runs of at least n samples above gamma; arguments as of :func:`rule_events`."""
    return rule_events(residual, evidence, gamma, n, gamma, 0.5, merge_samples)[0]
