"""Phases of a run (approach, contact, retreat), and eq. (1): force is commanded only in contact.

Of the tool's force in contact what is usual there was commanded, and not a blow that stands out of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from collaudit.core.config.schema import PhasesConfig
from collaudit.core.data import first_few
from collaudit.core.data.audit_result import Phase, PhaseSpan
from collaudit.core.data.joint_log import Annotation
from collaudit.core.findings import Finding, fact
from collaudit.core.numeric.arrays import BoolArray, FloatArray, closed, equal_runs, lasting, run_bounds
from collaudit.core.numeric.stats import quantile_of

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


def phase_findings(
    time_s: FloatArray, labels: NDArray[np.int8], config: PhasesConfig, stated: bool = False
) -> list[Finding]:
    """Whether phases are known at all and lie in the log, and when force was commanded outside contact (eq. 1).

    Args:
        time_s: (n,) s.
        labels: (n,) phases, configured or found.
        config: what was configured; ``force_control`` is t_c of eq. (1).
        stated: whether the log itself stated them.
    """
    findings, first, last = list[Finding](), float(time_s[0]), float(time_s[-1])
    for name in (*PHASES[1:], "force_control"):
        for start, end in getattr(config, name):
            if start > last or end <= first:
                text = (
                    f"[phases] {name} from {start:.6g} to {end:.6g} s lies outside the log ({first:.4g} to "
                    f"{last:.6g} s): are these the phases of another run?"
                )
                findings.append(Finding("log-label-missing", "warning", text, start_s=start, end_s=end))
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


#: A force this many times the level that contact keeps below for 95 % of its time, and this much above it, stands out.
_TIMES, _ABOVE_N = 1.5, 5.0
_SHARE = 0.95
#: So many phases that were found by their force show what is usual; two may be one obstacle that was met twice.
_LEAST_FOUND = 3
#: Shorter than this is an impact of the tool that no rule would see, s.
_IMPACT_S = 0.01
#: Stretches closer than this are one, s.
_TOGETHER_S = 0.2
_LISTED = 20


@dataclass(frozen=True, slots=True)
class ExcessForce:
    """A stretch in which the tool's force exceeded what is taken as commanded.

    Attributes:
        start_s, end_s: seconds from the log's first sample.
        peak_n: its largest force.
        limit_n: what was taken as commanded; 0 where nothing was.
    """

    start_s: float
    end_s: float
    peak_n: float
    limit_n: float


def commanded_share(
    time_s: FloatArray, force_n: FloatArray, contact: BoolArray, config: PhasesConfig, found: bool = False
) -> tuple[FloatArray, tuple[ExcessForce, ...]]:
    """The share of the measured force that is taken as commanded.

    A force above the limit counts as commanded up to it; what exceeds it stays in the residual, where it can alarm.

    Args:
        time_s: (n,) s.
        force_n: (n,) size of the tool's force.
        contact: (n,) samples in which force is commanded; none where phases are not known.
        config: ``force_limit_n``; when absent, 1.5 times the level kept for 95 % of the contact, and 5 N more.
        found: whether ``contact`` is where force was found. A phase is then measured by the others, not by itself.

    Returns:
        (n,) factor of at most 1, and the stretches in which it was less.
    """
    share = np.ones(force_n.size)
    known = contact & np.isfinite(force_n)
    if not known.any() and (found or config.force_limit_n is None):
        return share, ()
    if config.force_limit_n is not None:
        limit = np.full(force_n.size, config.force_limit_n)
    else:
        limit = _found_limit(force_n, contact) if found else _limit(force_n, quantile_of(force_n[known], _SHARE))
    where = known if contact.any() else np.isfinite(force_n)
    above = where & (np.nan_to_num(force_n) > limit)
    share[above] = limit[above] / force_n[above]
    return share, tuple(_stretches(time_s, np.where(above, force_n, 0.0), limit))


def _limit(force_n: FloatArray, level_n: float) -> FloatArray:
    return np.full(force_n.size, _TIMES * level_n + _ABOVE_N)


def _found_limit(force_n: FloatArray, contact: BoolArray) -> FloatArray:
    """(n,) limit from the median level of the other phases, none of too few; 0 in a phase that lies above it.

    Of two levels in the middle the lower counts. It is the same whichever phase above it is left out.
    """
    bounds = list(zip(*run_bounds(contact), strict=True))
    levels = [quantile_of(np.nan_to_num(force_n[a:b]), _SHARE) for a, b in bounds]
    limit = _limit(force_n, sorted(levels)[len(levels) // 2 - 1] if len(levels) >= _LEAST_FOUND else 0.0)
    for (a, b), level in zip(bounds, levels, strict=True):
        if level > limit[a]:
            limit[a:b] = 0.0  # as in free motion, for nothing says that any of it was commanded
    return limit


def _stretches(time_s: FloatArray, excess_n: FloatArray, limit_n: FloatArray) -> list[ExcessForce]:
    period_s = float(time_s[1] - time_s[0])
    out = []
    for a, b in zip(*run_bounds(closed(excess_n > 0.0, round(_TOGETHER_S / period_s))), strict=True):
        first, last = float(time_s[a]), float(time_s[b - 1])
        if last - first >= _IMPACT_S:
            out.append(ExcessForce(first, last, float(excess_n[a:b].max()), float(limit_n[a])))
    return out


def excess_findings(excess: Sequence[ExcessForce], config: PhasesConfig) -> list[Finding]:
    """A fact for each of the first stretches."""
    what = "[phases] force_limit_n" if config.force_limit_n is not None else "the limit of what is usual in its contact"
    out = []
    for one in excess[:_LISTED]:
        judged = (
            f"above {one.limit_n:.3g} N, {what}. Force up to this limit was taken as intended; the rest was judged."
        )
        if not one.limit_n > 0:
            judged = "more than other contact that was found shows to be usual. All of it was judged."
        text = (
            f"The tool's force rose to {one.peak_n:.3g} N between {one.start_s:.4g} and {one.end_s:.4g} s, {judged} "
            "[phases] force_limit_n states what is allowed."
        )
        out.append(fact(text, start_s=one.start_s, end_s=one.end_s))
    return out


def found_finding(time_s: FloatArray, force_n: FloatArray, contact: BoolArray, config: PhasesConfig) -> Finding:
    """What the force alone tells of contact: a tool that collides looks the same.

    Args:
        time_s: (n,) s.
        force_n: (n,) size of the tool's force; NaN where unknown.
        contact: (n,) samples in contact, some of them True.
        config: what they were found with.
    """
    bounds = list(zip(*run_bounds(contact), strict=True))
    spans = first_few(f"{time_s[a]:.4g} to {time_s[b - 1]:.4g} s" for a, b in bounds)
    top = int(np.argmax(np.where(contact, np.nan_to_num(force_n), 0.0)))
    limit = config.force_limit_n
    usual = f"what is usual in {_LEAST_FOUND} or more phases" if limit is None else f"force up to {limit:g} N"
    text = (
        f"{len(bounds)} contact phase{'' if len(bounds) == 1 else 's'} found where the tool's force exceeds "
        f"{CONTACT_FORCE_N:g} N ({spans}; largest {force_n[top]:.3g} N at {time_s[top]:.4g} s). Nothing else "
        f"says that contact is intended: {usual} is taken as intended there, so a collision of the tool with no more "
        "cannot be seen. State in [phases] of the configuration when contact is intended."
    )
    return Finding("phases-unknown", "warning", text)
