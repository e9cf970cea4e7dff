"""Phases of a run (approach, contact, retreat), and eq. (1): force is commanded only in contact."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from collaudit.core.config.schema import PhasesConfig
from collaudit.core.findings import Finding
from collaudit.core.result import Phase, PhaseSpan
from collaudit.core.series import BoolArray, FloatArray

PHASES: tuple[Phase, ...] = ("free", "approach", "contact", "retreat")


def label_phases(time_s: FloatArray, config: PhasesConfig) -> NDArray[np.int8]:
    """(n,) index into :data:`PHASES` of every sample; free where nothing was stated."""
    labels = np.zeros(time_s.size, dtype=np.int8)
    for code, name in enumerate(PHASES[1:], start=1):
        for start, end in getattr(config, name):
            labels[(time_s >= start) & (time_s < end)] = code
    return labels


def phase_spans(time_s: FloatArray, labels: NDArray[np.int8], period_s: float) -> tuple[PhaseSpan, ...]:
    """The labels as stretches of time."""
    if labels.size == 0:
        return ()
    starts = np.concatenate(([0], np.flatnonzero(np.diff(labels)) + 1))
    stops = np.concatenate((starts[1:], [labels.size]))
    return tuple(
        PhaseSpan(PHASES[int(labels[a])], float(time_s[a]), float(time_s[b - 1] + period_s))
        for a, b in zip(starts, stops, strict=True)
    )


def contact_mask(labels: NDArray[np.int8]) -> BoolArray:
    """(n,) True during contact."""
    return np.asarray(labels == PHASES.index("contact"))


def phase_findings(config: PhasesConfig) -> list[Finding]:
    """Whether phases are known at all, and whether force was commanded outside contact (eq. 1)."""
    if not (config.approach or config.contact or config.retreat):
        return [
            Finding(
                "phases-unknown",
                "info",
                "No phases are configured ([phases]); the whole log is judged as free motion.",
            )
        ]
    return [
        Finding(
            "force-outside-contact",
            "warning",
            f"Force was commanded from {start:.6g} to {end:.6g} s, not wholly within a contact phase (eq. 1).",
            start_s=start,
            end_s=end,
        )
        for start, end in config.force_control
        if not any(a <= start and end <= b for a, b in config.contact)
    ]
