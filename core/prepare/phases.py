"""Phases of a run (approach, contact, retreat), and eq. (1): force is commanded only in contact."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from collaudit.core.config.schema import PhasesConfig
from collaudit.core.data.audit_result import Phase, PhaseSpan
from collaudit.core.data.joint_log import Annotation
from collaudit.core.findings import Finding, fact
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.runs import closed, equal_runs, lasting, run_bounds

#: Force is smoothed over this before it is compared.
_SMOOTH_S = 0.05
#: Approach and retreat that are found rather than stated last this long.
_MARGIN_S = 2.0
#: Force that tells contact from free motion, N: ten times the noise of a wrist sensor.
CONTACT_FORCE_N = 3.0
#: Contacts and separations shorter than this are not phases, s: a tool that bounces has not left the part.
_LEAST_S = 0.5

PHASES: tuple[Phase, ...] = ("free", "approach", "contact", "retreat")


def label_phases(time_s: FloatArray, config: PhasesConfig) -> NDArray[np.int8]:
    """(n,) index into :data:`PHASES` of every sample; free where nothing was stated."""
    labels = np.zeros(time_s.size, dtype=np.int8)
    for code, name in enumerate(PHASES[1:], start=1):
        for start, end in getattr(config, name):
            labels[(time_s >= start) & (time_s < end)] = code
    return labels


def logged_phases(
    time_s: FloatArray, stated: Sequence[Annotation], config: PhasesConfig
) -> tuple[NDArray[np.int8], list[Finding]]:
    """(n,) phases as the log itself states them, and what its values were taken for.

    Args:
        time_s: (n,) s.
        stated: one label a value of the log's phase topic or column.
        config: which phase a value means, where it is not the phase's own name.
    """
    labels = np.zeros(time_s.size, dtype=np.int8)
    meaning, unknown = {}, []
    for label in stated:
        phase = config.values.get(label.name, label.name.strip().lower())
        if phase not in PHASES:
            unknown.append(label.name)
            continue
        meaning[label.name] = phase
        for start, end in label.intervals_s:
            labels[(time_s >= start) & (time_s <= end)] = PHASES.index(phase)
    text = "Phases were taken from the log: " + ", ".join(f"'{k}' is {v}" for k, v in meaning.items()) + "."
    findings = [fact(text, where=stated[0].source)] if meaning else []
    if unknown:
        text = (
            f"The log states phases that are not known: {', '.join(unknown)}; they were taken as free motion. "
            "[phases.values] says which phase each means."
        )
        findings.append(Finding("phases-unknown", "warning", text, where=stated[0].source))
    return labels, findings


def phase_spans(time_s: FloatArray, labels: NDArray[np.int8], period_s: float) -> tuple[PhaseSpan, ...]:
    """The labels as stretches of time."""
    return tuple(
        PhaseSpan(PHASES[int(labels[a])], float(time_s[a]), float(time_s[b - 1] + period_s))
        for a, b in zip(*equal_runs(labels), strict=True)
    )


def contact_mask(labels: NDArray[np.int8]) -> BoolArray:
    """(n,) True during contact."""
    return np.asarray(labels == PHASES.index("contact"))


def configured(config: PhasesConfig) -> bool:
    """Whether any phase is stated."""
    return bool(config.approach or config.contact or config.retreat)


def found_by_force(config: PhasesConfig, logged: bool) -> bool:
    """Whether the measured force alone says when contact is, for neither the configuration nor the log states it."""
    return config.find == "wrench" and not configured(config) and not logged


def find_phases(force_n: FloatArray, period_s: float) -> NDArray[np.int8]:
    """Contact from the measured force, with approach and retreat as the two seconds before and after it.

    Args:
        force_n: (n,) size of the tool's force, its offset removed; NaN where unknown.
        period_s: sample period, s.
    """
    width = max(1, round(_SMOOTH_S / period_s))
    known = np.nan_to_num(force_n)
    smooth = np.convolve(known, np.ones(width) / width, mode="same")
    least = round(_LEAST_S / period_s)
    touching = lasting(closed(smooth > CONTACT_FORCE_N, least - 1), least)
    labels = np.zeros(force_n.size, dtype=np.int8)
    margin = round(_MARGIN_S / period_s)
    for a, b in zip(*run_bounds(touching), strict=True):
        before, after = labels[max(0, a - margin) : a], labels[b : b + margin]
        before[before == 0] = PHASES.index("approach")
        after[after == 0] = PHASES.index("retreat")
    labels[touching] = PHASES.index("contact")
    return labels


def _outside(time_s: FloatArray, config: PhasesConfig) -> list[Finding]:
    """Configured stretches that hold no sample of the log: the phases of another run, perhaps."""
    first, last = float(time_s[0]), float(time_s[-1])
    out = []
    for name in (*PHASES[1:], "force_control"):
        for start, end in getattr(config, name):
            if start > last or end <= first:
                text = (
                    f"[phases] {name} from {start:.6g} to {end:.6g} s lies outside the log ({first:.4g} to "
                    f"{last:.6g} s): are these the phases of another run?"
                )
                out.append(Finding("log-label-missing", "warning", text, start_s=start, end_s=end))
    return out


def phase_findings(
    time_s: FloatArray, labels: NDArray[np.int8], config: PhasesConfig, stated: bool = False
) -> list[Finding]:
    """Whether phases are known at all, and when force was commanded outside contact (eq. 1).

    Args:
        time_s: (n,) s.
        labels: (n,) phases, configured or found.
        config: what was configured; ``force_control`` is t_c of eq. (1).
        stated: whether the log itself stated them.
    """
    findings = _outside(time_s, config)
    if not configured(config) and not stated and not labels.any():
        findings.append(fact("No phases are configured ([phases]); the whole log is judged as free motion."))
    if not labels.any():
        return findings
    for start, end in config.force_control:
        outside = (time_s >= start) & (time_s < end) & ~contact_mask(labels)
        for a, b in zip(*run_bounds(outside), strict=True):
            first, last = float(time_s[a]), float(time_s[b - 1])
            text = (
                f"Force was commanded from {start:.6g} to {end:.6g} s; from {first:.6g} to {last:.6g} s of that the "
                "tool was not in its contact phase."
            )
            findings.append(Finding("log-label-missing", "warning", text, start_s=first, end_s=last))
    return findings
