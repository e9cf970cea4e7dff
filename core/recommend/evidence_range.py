"""What motion, load and phases the evidence covers, and how much of a judged log lies beyond."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from collaudit.core.data.recommendation_result import FittedThresholds, RangeOfEvidence
from collaudit.core.data.signals import Signals, State
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray, widened
from collaudit.core.numeric.stats import quantile_of
from collaudit.core.recommend.arm_evidence import ArmEvidence, LogEvidence

#: The range leaves out this share of the evidence at each end: a moment at some speed is no evidence for it.
_TAIL = 1e-3
_STEP_S = 0.02
#: Travel between two reversals, rad (m): the noise of a velocity changes its sign over less.
_STROKE_RAD = 1e-3


@dataclass(frozen=True, slots=True, eq=False)
class Driven:
    """What one joint did in the evidence of one log.

    Attributes:
        velocity_rad_s, model_nm: (n,) of the joint.
        used: (n,) samples that are evidence.
        standing: (n,) samples at rest, in slow motion or just after a reversal.
        period_s: sample period, s.
        phase_s: time of the evidence in each phase of the run, s.
        temperature_c: temperatures in it, °C, NaN where not known.
    """

    velocity_rad_s: FloatArray
    model_nm: FloatArray
    used: BoolArray
    standing: BoolArray
    period_s: float
    temperature_c: FloatArray
    phase_s: Mapping[str, float] = field(default_factory=dict)


def ranges_of_evidence(evidence: ArmEvidence) -> dict[str, RangeOfEvidence]:
    """The range of every joint that has clean time."""
    known = {
        joint: range_of([_of_log(log, joint) for log in evidence.logs if joint in log.watched])
        for joint in evidence.joints
    }
    return {joint: found for joint, found in known.items() if found is not None}


def range_of(logs: Sequence[Driven]) -> RangeOfEvidence | None:
    """The range that one joint covers over its logs; None without evidence."""
    logs = [one for one in logs if one.used.any()]
    if not logs:
        return None
    velocity = [one.velocity_rad_s[one.used] for one in logs]
    speed, load, turn, heat = (
        np.nan_to_num(np.concatenate([np.abs(v) for v in velocity])),
        np.nan_to_num(np.concatenate([one.model_nm[one.used] for one in logs])),
        np.concatenate([acceleration(one.velocity_rad_s, one.period_s)[one.used] for one in logs]),
        np.concatenate([one.temperature_c[np.isfinite(one.temperature_c)] for one in logs]),
    )
    seconds = sum(v.size * one.period_s for v, one in zip(velocity, logs, strict=True))
    standing_s = sum(float(np.count_nonzero(one.used & one.standing)) * one.period_s for one in logs)
    phases = dict.fromkeys(phase for one in logs for phase in one.phase_s)
    reversals = sum(reversals_at(v, one.period_s).size for v, one in zip(velocity, logs, strict=True))
    return RangeOfEvidence(
        fastest_rad_s=quantile_of(speed, 1 - _TAIL),
        hardest_rad_s2=quantile_of(turn, 1 - _TAIL),
        least_nm=quantile_of(load, _TAIL),
        most_nm=quantile_of(load, 1 - _TAIL),
        reversals=reversals,
        standing=standing_s / seconds,
        phases={phase: sum(one.phase_s.get(phase, 0.0) for one in logs) / seconds for phase in phases},
        temperature_c=(float(heat.min()), float(heat.max())) if heat.size else None,
        reversals_per_h=reversals / (seconds / 3600.0),
    )


def reversals_at(velocity_rad_s: FloatArray, period_s: float) -> IntArray:
    """Samples at which (n,) velocities turn from a stroke in one direction to a stroke in the other, noise left out."""
    velocity = np.nan_to_num(velocity_rad_s)
    starts = np.flatnonzero(np.diff(np.sign(velocity), prepend=np.nan))
    way = np.add.reduceat(velocity, starts) * period_s
    strokes = np.abs(way) > _STROKE_RAD
    starts, direction = starts[strokes], np.sign(way[strokes])
    return np.asarray(starts[1:][direction[1:] != direction[:-1]], dtype=np.int64)


def acceleration(velocity_rad_s: FloatArray, period_s: float) -> FloatArray:
    """(n,) |acceleration| over 40 ms; 0 where velocity is not known."""
    step = max(1, round(_STEP_S / period_s))
    out = np.zeros(velocity_rad_s.size)
    if velocity_rad_s.size > 2 * step:
        out[step:-step] = np.abs(velocity_rad_s[2 * step :] - velocity_rad_s[: -2 * step]) / (2 * step * period_s)
    return np.nan_to_num(out)


def _of_log(log: LogEvidence, joint: str) -> Driven:
    k = log.signals.joint_names.index(joint)
    clean, phase_s = log.clean[:, k], dict[str, float]()
    for span in log.phases:
        a, b = np.searchsorted(log.signals.time_s, [span.start_s, span.end_s])
        if samples := int(np.count_nonzero(clean[a:b])):
            phase_s[span.phase] = phase_s.get(span.phase, 0.0) + samples * log.period_s
    return Driven(
        log.signals.velocity_rad_s[:, k],
        log.signals.model_nm[:, k],
        clean,
        np.asarray(log.signals.state[:, k] == State.FRICTION_INTERVAL),
        log.period_s,
        np.array(log.temperature_c.get(joint, ())),
        phase_s,
    )


#: A little beyond the range is still like it.
_SLACK = 1.05
#: Less of a log than this out of the range is not worth a word; more than that is a warning.
_SAID, _WARNED = 0.005, 0.05
#: Reversals that come this many times as often are another motion; what a reversal does to a residual lasts so long, s.
_MORE_OFTEN, _REVERSAL_S = 3.0, 0.5
#: That many reversals may come by chance.
_BY_CHANCE = 3


def ranges_behind(fitted: FittedThresholds | None) -> dict[str, RangeOfEvidence]:
    """The ranges that the thresholds of a friction file rest on, by joint."""
    joints = {} if fitted is None else fitted.joints
    return {joint: known.evidence for joint, known in joints.items() if known.evidence is not None}


def range_findings(
    signals: Signals,
    period_s: float,
    temperature_c: FloatArray | None,
    ranges: Mapping[str, RangeOfEvidence],
) -> list[Finding]:
    """One finding for each joint that leaves the range, with the shares of its judged time.

    Args:
        signals: of the judged log.
        period_s: sample period, s.
        temperature_c: (n, j) °C, or None.
        ranges: by joint.
    """
    found = []
    for j, joint in enumerate(signals.joint_names):
        judged = np.asarray(signals.state[:, j] <= State.FRICTION_INTERVAL)
        if joint not in ranges or not judged.any():
            continue
        celsius = None if temperature_c is None else temperature_c[:, j]
        masks = _beyond(signals, j, period_s, celsius, ranges[joint])
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
    signals: Signals, j: int, period_s: float, celsius: FloatArray | None, known: RangeOfEvidence
) -> dict[str, BoolArray]:
    """Masks (n,) of what lies beyond the range, by what it is."""
    velocity, load = signals.velocity_rad_s[:, j], signals.model_nm[:, j]
    low, high = known.least_nm, known.most_nm
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
    if known.standing == 0.0:
        masks["at rest, in slow motion or just after a reversal"] = np.asarray(
            signals.state[:, j] == State.FRICTION_INTERVAL
        )
    return masks


def _reversing(velocity: FloatArray, period_s: float, usual_per_h: float | None) -> dict[str, BoolArray]:
    """Mask (n,) of what lies around reversals, where they come far more often than in the evidence."""
    at, hours = reversals_at(velocity, period_s), velocity.size * period_s / 3600.0
    if usual_per_h is None or at.size <= _MORE_OFTEN * usual_per_h * hours + _BY_CHANCE:
        return {}
    mask = np.zeros(velocity.size, dtype=np.bool_)
    mask[at] = True
    what = f"around reversals, {at.size / hours:,.0f} an hour where the evidence has {usual_per_h:,.0f}"
    return {what: widened(mask, round(_REVERSAL_S / period_s))}


def _percent(share: float) -> str:
    return f"{100 * share:.0f}" if share >= 0.1 else f"{100 * share:.2g}"
