"""What motion, load and phases the evidence covers, and how much of a judged log lies beyond."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from collaudit.core.config.schema_detect import EvidenceConfig
from collaudit.core.data.audit_result import PhaseSpan
from collaudit.core.data.recommendation_result import RangeOfEvidence
from collaudit.core.data.signals import Signals, State
from collaudit.core.data.threshold_result import FittedThresholds
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.runs import widened
from collaudit.core.numeric.stats import quantile_of
from collaudit.core.recommend.arm_evidence import ArmEvidence, LogEvidence

#: The range leaves out this share of the evidence at each end: a moment at some speed is no evidence for it.
_TAIL = 1e-3
_STEP_S = 0.02
#: Slower is rest: noise of a velocity changes its sign.
_MOVING_RAD_S = 1e-3


def ranges_of_evidence(evidence: ArmEvidence) -> dict[str, RangeOfEvidence]:
    """The range of every joint that has clean time."""
    known = {joint: range_of_evidence(evidence, joint) for joint in evidence.joints}
    return {joint: found for joint, found in known.items() if found is not None}


def range_of_evidence(evidence: ArmEvidence, joint: str) -> RangeOfEvidence | None:
    """The range of one joint over all logs; None without clean time."""
    parts = [_of_log(log, joint) for log in evidence.logs if joint in log.watched]
    speed, turn, load = (np.concatenate([part[k] for part in parts]) if parts else np.empty(0) for k in range(3))
    if speed.size == 0:
        return None
    weights = [log.period_s for log in evidence.logs if joint in log.watched]
    seconds = sum(part[0].size * w for part, w in zip(parts, weights, strict=True))
    phases: dict[str, float] = {}
    for log, weight in zip([log for log in evidence.logs if joint in log.watched], weights, strict=True):
        for phase, samples in _phases(log, joint).items():
            phases[phase] = phases.get(phase, 0.0) + samples * weight / seconds
    standing = sum(part[4] * w for part, w in zip(parts, weights, strict=True)) / seconds
    heat = [log.temperature_c[joint] for log in evidence.logs if joint in log.watched and joint in log.temperature_c]
    reversals = (sum(part[3] for part in parts), seconds / 3600.0)
    return range_of_samples(speed, turn, load, reversals, standing, phases, np.array(heat).ravel())


def range_of_samples(
    speed: FloatArray,
    turn: FloatArray,
    load: FloatArray,
    reversals: tuple[int, float],
    standing: float,
    phases: dict[str, float],
    temperature_c: FloatArray | None = None,
) -> RangeOfEvidence:
    """The range that samples cover.

    Args:
        speed, turn, load: (n,) |velocity| in rad/s, |acceleration| in rad/s², modelled torque in N·m.
        reversals: changes of direction, and in how many hours.
        standing, phases: as of :class:`RangeOfEvidence`.
        temperature_c: (n,) °C, NaN where not known; None without.
    """
    known = np.empty(0) if temperature_c is None else temperature_c[np.isfinite(temperature_c)]
    return RangeOfEvidence(
        fastest_rad_s=quantile_of(speed, 1 - _TAIL),
        hardest_rad_s2=quantile_of(turn, 1 - _TAIL),
        least_nm=quantile_of(load, _TAIL),
        most_nm=quantile_of(load, 1 - _TAIL),
        reversals=reversals[0],
        standing=standing,
        phases=phases,
        temperature_c=(float(known.min()), float(known.max())) if known.size else None,
        reversals_per_h=reversals[0] / reversals[1] if reversals[1] > 0 else None,
    )


def reversals_at(velocity_rad_s: FloatArray) -> IntArray:
    """Samples at which (n,) velocities have changed their direction, rest left out."""
    moving = np.flatnonzero(np.abs(velocity_rad_s) > _MOVING_RAD_S)
    sign = np.sign(velocity_rad_s[moving])
    return np.asarray(moving[1:][sign[1:] != sign[:-1]], dtype=np.int64)


def reversals_of(velocity_rad_s: FloatArray) -> int:
    """Number of changes of direction of (n,) velocities, rest left out."""
    return int(reversals_at(velocity_rad_s).size)


def acceleration(velocity_rad_s: FloatArray, period_s: float) -> FloatArray:
    """(n,) |acceleration| over 40 ms; 0 where velocity is not known."""
    step = max(1, round(_STEP_S / period_s))
    out = np.zeros(velocity_rad_s.size)
    if velocity_rad_s.size > 2 * step:
        out[step:-step] = np.abs(velocity_rad_s[2 * step :] - velocity_rad_s[: -2 * step]) / (2 * step * period_s)
    return np.nan_to_num(out)


def _of_log(log: LogEvidence, joint: str) -> tuple[FloatArray, FloatArray, FloatArray, int, int]:
    """Speed, acceleration and load of the clean samples, changes of direction, and samples at rest."""
    k = log.signals.joint_names.index(joint)
    clean: BoolArray = log.clean[:, k]
    velocity = log.signals.velocity_rad_s[:, k]
    load = log.signals.model_nm[clean, k]
    reversals = reversals_of(velocity[clean])
    standing = int(np.count_nonzero(log.signals.state[clean, k] == State.FRICTION_INTERVAL))
    turn = acceleration(velocity, log.period_s)[clean]
    return np.abs(np.nan_to_num(velocity[clean])), turn, np.nan_to_num(load), reversals, standing


def _phases(log: LogEvidence, joint: str) -> dict[str, int]:
    k = log.signals.joint_names.index(joint)
    out: dict[str, int] = {}
    for span in log.phases:
        a, b = np.searchsorted(log.signals.time_s, [span.start_s, span.end_s])
        out[span.phase] = out.get(span.phase, 0) + int(np.count_nonzero(log.clean[a:b, k]))
    return {phase: samples for phase, samples in out.items() if samples}


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
