"""All states of an arm in one log that are not to be judged, with a finding for each stretch.

Whether drives move an arm: beside the rigid-body torque a drive that moves a joint brings up friction, y = effort -
tau_rigid > 0 along the motion. Where a hand moves it, or nothing does, y is near zero, or against the motion by what
inertia takes.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from collaudit.core.arm_states.drives_off import DrivesOff, braking_before, drives_off
from collaudit.core.data.joint_log import MOVING_RAD_S, Annotation, UniformSeries
from collaudit.core.findings import Finding, fact
from collaudit.core.findings.finding_kinds import FACT, Severity
from collaudit.core.numeric.arrays import BoolArray, FloatArray, Span, covered, frozen
from collaudit.core.numeric.stats import median_of, robust_sd
from collaudit.core.vendors.vendor_words import STATE_WORDS, StateKind, state_of

#: Share of its usual friction that a joint's drive brings up at least, in the median of the joints that tell.
_DRIVEN = 0.6
#: Joints that must tell, and samples in motion that each needs.
_LEAST_JOINTS, _LEAST_SAMPLES = 2, 5
#: A joint tells where its friction is so many standard errors of its scatter in the stretch.
_CLEAR = 4.0


def driven(series: UniformSeries, rigid_nm: FloatArray, outside: BoolArray, span: Span) -> bool:
    """Whether the drives plainly move the arm in a stretch.

    Args:
        series: all joints of the log, efforts in N·m.
        rigid_nm: (n, j) rigid-body torque.
        outside: (n,) samples that tell how the drives act elsewhere.
        span: the stretch.
    """
    if series.effort is None:
        return False
    shares = []
    for j in range(len(series.joint_names)):
        velocity = series.velocity_rad_s[:, j]
        with np.errstate(invalid="ignore"):
            along = (series.effort[:, j] - rigid_nm[:, j]) * np.sign(velocity)
            moves = (np.abs(velocity) > MOVING_RAD_S) & np.isfinite(along)
        usual, here = along[outside & moves], along[span.slice][moves[span.slice]]
        if usual.size < _LEAST_SAMPLES or here.size < _LEAST_SAMPLES:
            continue
        level = median_of(usual)
        if level > _CLEAR * robust_sd(usual) / np.sqrt(here.size):
            shares.append(median_of(here) / level)
    return len(shares) >= _LEAST_JOINTS and float(np.median(shares)) >= _DRIVEN


_LISTED = 20
#: Of a flag of the log: code and severity of what is said.
_FLAGS: dict[StateKind, tuple[str, Severity]] = {
    "stopped": ("arm-stopped", "warning"),
    "guided": ("arm-guided", "info"),
    "off": (FACT, "info"),
}
#: A stop brakes the arm for so long at most, s.
_BRAKES_S = 1.0


def find_arm_states(
    series: UniformSeries, rigid_nm: FloatArray | None, true_events: Collection[str] = ()
) -> tuple[BoolArray, list[Finding]]:
    """Look for them in the log's own flags and in the signals.

    Args:
        series: all joints of the log.
        rigid_nm: (n, j) model torque, or None.
        true_events: names of labels, or their sources, that mark what is to be found, and are no states.

    Returns:
        (n,) samples with drives off, braking, stopped by the controller, or guided by hand; a finding for each stretch.
    """
    mask = np.zeros(series.time_s.size, dtype=np.bool_)
    in_nm = series.effort_unit == "Nm"  # what does not bear a load in another unit may be any part of it
    findings = _flagged(series, mask, rigid_nm if in_nm else None, true_events)
    for found in drives_off(series, rigid_nm if in_nm else None):
        if not mask[found.span.slice].all():
            findings.append(_finding(series, found))
        mask[found.span.slice] = True
    mask.flags.writeable = False
    return mask, findings[:_LISTED]


def without_states(series: UniformSeries, not_driven: BoolArray | None) -> UniformSeries:
    """The series with what was not driven (n,) marked; its effort counts as missing there, for fitting and judging."""
    if series.effort is None or not_driven is None or not not_driven.any():
        return series
    effort = series.effort.copy(order="F")
    effort[not_driven] = np.nan
    return replace(series, effort=frozen(effort), not_driven=not_driven)


def _flagged(
    series: UniformSeries, mask: BoolArray, rigid_nm: FloatArray | None, true_events: Collection[str]
) -> list[Finding]:
    """Findings of the log's own flags; their samples are set in ``mask`` but where the drives contradict the flag."""
    findings = []
    stated = _stated(series, true_events)
    outside = ~covered((span for _, _, span in stated), series.time_s.size)
    for label, kind, span in stated:
        start, end = (float(series.time_s[k]) for k in (span.start, span.stop - 1))
        braking = min(round(_BRAKES_S / series.period_s), len(span)) if kind == "stopped" else 0
        if rigid_nm is not None and driven(series, rigid_nm, outside, Span(span.start + braking, span.stop)):
            text = (
                f"The log itself says '{label.name}' from {start:.4g} to {end:.4g} s, where the drives move the arm as "
                "they do elsewhere: the flag masks nothing, and this time is judged."
            )
            findings.append(Finding("arm-guided", "info", text, label.source, None, start, end))
            continue
        text = (
            f"The log itself says '{label.name}' from {start:.4g} to {end:.4g} s: the arm was {STATE_WORDS[kind]}; not "
            "judged there."
        )
        first = braking_before(series, span) if kind == "off" else span.start
        mask[first : span.stop] = True
        if first < span.start:
            start = float(series.time_s[first])
            text += _braked(start)
        code, severity = _FLAGS["stopped" if first < span.start else kind]
        findings.append(Finding(code, severity, text, label.source, None, start, end))
    return findings


def _stated(series: UniformSeries, true_events: Collection[str]) -> list[tuple[Annotation, StateKind, Span]]:
    """Flags of states, and the samples that each covers."""
    out = []
    for label in series.annotations:
        kind = state_of(label.name)
        if kind is None or label.name in true_events or label.source in true_events:
            continue
        for start, end in label.intervals_s:
            inside = np.flatnonzero((series.time_s >= start) & (series.time_s <= end + series.period_s))
            if inside.size:
                out.append((label, kind, Span(int(inside[0]), int(inside[-1]) + 1)))
    return out


def _finding(series: UniformSeries, found: DrivesOff) -> Finding:
    first, last = (float(series.time_s[k]) for k in (found.span.start, found.span.stop - 1))
    since = float(series.time_s[found.off.start])
    why = "are zero although gravity loads the arm" if found.zero else "repeat exactly while the arm rests"
    text = (
        f"The efforts of all joints {why}, from {since:.4g} to {last:.4g} s: drives off, brakes on, or nothing "
        "measured; not judged there."
    )
    if found.braked:
        return Finding("arm-stopped", "warning", text + _braked(first), start_s=first, end_s=last)
    return fact(text, start_s=first, end_s=last)


def _braked(since_s: float) -> str:
    return (
        f" The arm was moving until then: its braking from {since_s:.4g} s on belongs to it. What stopped the arm may "
        "have been a contact."
    )
