"""How much of a judged log lies outside the range of the evidence behind its thresholds."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from collaudit.core.config.schema_detect import EvidenceConfig
from collaudit.core.data.audit_result import PhaseSpan
from collaudit.core.data.signals import Signals, State
from collaudit.core.data.threshold_result import FittedThresholds
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.runs import widened
from collaudit.core.recommend.evidence_range import acceleration, reversals_at

#: A little beyond the range is still like it.
_SLACK = 1.05
#: Less of a log than this out of the range is not worth a word; more than that is a warning.
_SAID, _WARNED = 0.005, 0.05
#: Reversals that come this many times as often are another motion; what a reversal does to a residual lasts so long, s.
_MORE_OFTEN, _REVERSAL_S = 3.0, 0.5
#: That many reversals may come by chance.
_BY_CHANCE = 3


def ranges_behind(
    stated: Mapping[str, EvidenceConfig], fitted: FittedThresholds | None, auto: bool
) -> dict[str, EvidenceConfig]:
    """The ranges that count: of the configuration, and of the friction file where its thresholds are used.

    Args:
        stated: ``[detect.evidence]``.
        fitted: thresholds of the friction file.
        auto: whether they are the ones in use.
    """
    out: dict[str, EvidenceConfig] = {}
    if auto and fitted is not None:
        for joint, known in fitted.joints.items():
            if known.evidence is not None:
                r = known.evidence
                out[joint] = EvidenceConfig(
                    fastest_rad_s=r.fastest_rad_s,
                    hardest_rad_s2=r.hardest_rad_s2,
                    load_nm=(r.least_nm, r.most_nm),
                    temperature_c=r.temperature_c,
                    standing=r.standing > 0,
                    reversals_per_h=r.reversals_per_h,
                )
    return out | dict(stated)


def range_findings(
    signals: Signals,
    period_s: float,
    phases: tuple[PhaseSpan, ...],
    temperature_c: FloatArray | None,
    ranges: Mapping[str, EvidenceConfig],
) -> list[Finding]:
    """One finding for each joint that leaves the range, with the shares of its judged time.

    Args:
        signals: of the judged log.
        period_s: sample period, s.
        phases: of the run.
        temperature_c: (n, j) °C, or None.
        ranges: by joint.
    """
    found = []
    for j, joint in enumerate(signals.joint_names):
        judged = np.asarray(signals.state[:, j] <= State.FRICTION_INTERVAL)
        if joint not in ranges or not judged.any():
            continue
        celsius = None if temperature_c is None else temperature_c[:, j]
        masks = _beyond(signals, j, period_s, phases, celsius, ranges[joint])
        shares = {what: float(np.mean(mask[judged])) for what, mask in masks.items()}
        any_of = float(np.mean(np.logical_or.reduce(list(masks.values()))[judged]))
        if any_of < _SAID:
            continue
        listed = ", ".join(f"{_percent(share)} % {what}" for what, share in shares.items() if share >= _SAID / 2)
        text = (
            f"{_percent(any_of)} % of the judged time of joint '{joint}' lies outside the range of the evidence "
            "for its threshold: "
            f"{listed or 'in several ways, each of them seldom'}."
        )
        found.append(Finding("evidence-range", "warning" if any_of >= _WARNED else "info", text, joint=joint))
    return found


def _beyond(
    signals: Signals,
    j: int,
    period_s: float,
    phases: tuple[PhaseSpan, ...],
    celsius: FloatArray | None,
    known: EvidenceConfig,
) -> dict[str, BoolArray]:
    """Masks (n,) of what lies beyond the range, by what it is."""
    velocity, load = signals.velocity_rad_s[:, j], signals.model_nm[:, j]
    low, high = known.load_nm
    room = (_SLACK - 1.0) * max(high - low, 1e-9)
    with np.errstate(invalid="ignore"):
        masks: dict[str, BoolArray] = {
            f"faster than {known.fastest_rad_s:.3g} rad/s": np.abs(velocity) > _SLACK * known.fastest_rad_s,
            f"accelerated harder than {known.hardest_rad_s2:.3g} rad/s²": acceleration(velocity, period_s)
            > _SLACK * known.hardest_rad_s2,
            f"loaded beyond {low:.3g} to {high:.3g} N·m": (load < low - room) | (load > high + room),
        }
        if celsius is not None and known.temperature_c is not None:
            cold, warm = known.temperature_c
            masks[f"colder or warmer than {cold:.3g} to {warm:.3g} °C"] = (celsius < cold - 1) | (celsius > warm + 1)
    masks |= _reversing(velocity, period_s, known.reversals_per_h)
    if not known.standing:
        masks["at rest or just after a reversal"] = np.asarray(signals.state[:, j] == State.FRICTION_INTERVAL)
    other = {span.phase for span in phases} - set(known.phases) if known.phases else set()
    for phase in sorted(other):
        mask = np.zeros(velocity.size, dtype=np.bool_)
        for span in phases:
            if span.phase == phase:
                a, b = np.searchsorted(signals.time_s, [span.start_s, span.end_s])
                mask[a:b] = True
        masks[f"in phase {phase}"] = mask
    return masks


def _reversing(velocity: FloatArray, period_s: float, usual_per_h: float | None) -> dict[str, BoolArray]:
    """Mask (n,) of what lies around reversals, where they come far more often than in the evidence."""
    at, hours = reversals_at(np.nan_to_num(velocity)), velocity.size * period_s / 3600.0
    if usual_per_h is None or at.size <= _MORE_OFTEN * usual_per_h * hours + _BY_CHANCE:
        return {}
    mask = np.zeros(velocity.size, dtype=np.bool_)
    mask[at] = True
    what = f"around reversals, {at.size / hours:,.0f} an hour where the evidence has {usual_per_h:,.0f}"
    return {what: widened(mask, round(_REVERSAL_S / period_s))}


def _percent(share: float) -> str:
    return f"{100 * share:.0f}" if share >= 0.1 else f"{100 * share:.2g}"
