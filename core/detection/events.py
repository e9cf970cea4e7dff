"""Applying the rule to the residuals of a log: collisions, near misses, and the final state of each sample.

Knocks shorter than the persistence are near misses by impulse. A blow of 12 ms never lasts n samples, and the kernel of
a detector lowers its peak. What a kernel of unit gain keeps is the impulse, torque times time. A torque of gamma for n
samples has the impulse gamma·n·T: a short excursion of the residual that reaches a share of it is nearly a collision,
however brief it was.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import ceil

import numpy as np
from numpy.typing import NDArray

from collaudit.core.data.audit_result import Collision, NearMiss, NearMissKind
from collaudit.core.data.signals import State
from collaudit.core.detection.rule import MERGE_S, Event, Level, apart, lasting_collisions, rule_events
from collaudit.core.detection.rule_settings import Watch
from collaudit.core.detection.threshold import Threshold
from collaudit.core.numeric.arrays import BoolArray, FloatArray, Span
from collaudit.core.numeric.parallel import each, ordered_map
from collaudit.core.numeric.runs import lasting, run_bounds
from collaudit.core.numeric.stats import SD_PER_MAD, median_of
from collaudit.core.prepare.phases import PHASES, contact_mask


@dataclass(frozen=True, slots=True, eq=False)
class DetectedEvents:
    """Events of all joints in time order, and (n, j) states with unwatched stretches marked."""

    collisions: tuple[Collision, ...]
    near_misses: tuple[NearMiss, ...]
    state: NDArray[np.int8]


def detect_events(threshold: Threshold, watch: Mapping[str, Watch], phases: NDArray[np.int8]) -> DetectedEvents:
    """Rule (6) on every watched joint where its residual is evidence.

    Args:
        threshold: of a residual, by the rule.
        watch: which joints count.
        phases: (n,) labels.
    """
    series, residual, rule = threshold.series, threshold.residual, threshold.rule
    state = _with_unwatched(residual.state, series.joint_names, watch, phases, rule.n)
    merge = round(MERGE_S / series.period_s)
    watched = [series.column(joint) for joint in rule.watch]
    columns = residual.isolation.judged_columns(watched, rule.gamma_nm)
    width = knock_width(rule.n, residual.balance.kernel.settle_s, series.period_s)
    hits: list[Collision] = []
    near: list[NearMiss] = []
    for its_hits, its_near in ordered_map(
        lambda j: _events(threshold, j, state[:, j], phases, (merge, width)), columns
    ):
        hits += its_hits
        near += its_near
    return DetectedEvents(
        tuple(sorted(hits, key=lambda c: (c.onset_s, c.joint))),
        tuple(sorted(near, key=lambda c: (c.onset_s, c.joint))),
        state,
    )


def _events(
    threshold: Threshold, j: int, state: NDArray[np.int8], phases: NDArray[np.int8], margins: tuple[int, int]
) -> tuple[list[Collision], list[NearMiss]]:
    """Collisions of one column, those of the lower threshold of what lasts among them, and near misses.

    Args:
        threshold, j: of a column.
        state: (n,) of its samples.
        phases: (n,) labels.
        margins: samples within which events are one, and that a knock lies within.
    """
    series, residual, rule, (merge, width) = threshold.series, threshold.residual, threshold.rule, margins
    gamma = rule.gamma_nm[series.joint_names[j]]
    evidence = np.asarray(state <= State.FRICTION_INTERVAL)
    x, level = np.ascontiguousarray(residual.torque_nm[:, j]), np.ascontiguousarray(threshold.of(j))
    fired, low, brief = rule_events(
        x, evidence, level, rule.n, rule.near_miss_amplitude, rule.near_miss_persistence, merge
    )
    lower = threshold.lasting(j)
    held = [] if lower is None else apart(lasting_collisions(x, evidence, lower, rule.lasting_n, merge), fired, merge)
    low, brief = apart(low, held, merge), apart(brief, held, merge)
    ratios = dict(knocks(x, evidence, level, rule.n, width, rule.near_miss_impulse))
    left = apart(list(ratios), [*fired, *held, *low, *brief], max(merge, width))

    def hit(event: Event, gamma_nm: float) -> Collision:
        return Collision(
            joint=residual.isolation.joint_of(j, event.span.start),
            onset_s=float(series.time_s[event.span.start]),
            detected_s=float(series.time_s[event.detected]),
            duration_s=len(event.span) * series.period_s,
            peak_nm=event.peak,
            gamma_nm=gamma_nm,
            phase=PHASES[int(phases[event.span.start])],
        )

    hits = [hit(e, gamma) for e in fired]
    hits += [replace(hit(e, rule.lasting_nm[series.joint_names[j]]), lasting=True) for e in held]
    nearly: list[tuple[NearMissKind, Event, float]] = [("amplitude", e, abs(e.peak) / gamma) for e in low]
    nearly += [("persistence", e, e.longest / rule.n) for e in brief]
    nearly += [("impulse", e, ratios[e]) for e in left]
    return hits, [_near_miss(hit(e, gamma), kind, ratio) for kind, e, ratio in nearly]


def _with_unwatched(
    state: NDArray[np.int8], joints: tuple[str, ...], watch: Mapping[str, Watch], phases: NDArray[np.int8], n: int
) -> NDArray[np.int8]:
    """States (n, j) with what is not watched, and stretches of evidence that are too brief for ``n`` samples."""
    out = np.empty_like(state)
    contact = contact_mask(phases)

    def fill_joint(j: int) -> None:
        column, its = out[:, j], watch[joints[j]]
        column[...] = state[:, j]
        if not its.watched:
            np.maximum(column, State.NOT_WATCHED, out=column)
        elif not its.in_contact:
            column[contact] = np.maximum(column[contact], State.NOT_WATCHED)
        evidence = np.asarray(column <= State.FRICTION_INTERVAL)
        column[evidence & ~lasting(evidence, n)] = State.TOO_BRIEF  # it cannot fire, whatever its residual

    each(fill_joint, range(len(joints)))
    return out


def _near_miss(event: Collision, kind: NearMissKind, ratio: float) -> NearMiss:
    """What nearly was this collision."""
    return NearMiss(
        joint=event.joint,
        onset_s=event.onset_s,
        duration_s=event.duration_s,
        peak_nm=event.peak_nm,
        gamma_nm=event.gamma_nm,
        ratio=ratio,
        kind=kind,
        phase=event.phase,
    )


#: A kernel leaves nearly all of a short knock within this many of its settling times.
_SETTLING_TIMES = 1.4
#: Impulses count from so many robust standard deviations of those of the log: ripple is no series of knocks.
_SDS = 6.0


def knock_width(n: int, settle_s: float, period_s: float) -> int:
    """Samples within which a knock of fewer than ``n`` samples lies once it has passed a kernel."""
    return max(n, ceil(_SETTLING_TIMES * settle_s / period_s - 1e-9))


def knocks(
    residual: FloatArray, evidence: BoolArray, gamma: Level, n: int, width: int, share: float
) -> list[tuple[Event, float]]:
    """Excursions within ``width`` samples whose impulse is at least ``share`` of gamma·n·T.

    Counted is what stands above the mean of the n samples before and the n samples after, and half as much of it above
    either: a torque that is there anyway, or that comes and stays, is no knock.

    Args:
        residual: (m,) N·m, through the detector's kernel.
        evidence: (m,) samples that may count; all of a knock and of the samples beside it must.
        gamma: threshold, N·m; one number, or (m,).
        n: persistence, samples.
        width: samples, of :func:`knock_width`.
        share: of the impulse gamma·n·T.

    Returns:
        Each excursion, with its impulse over gamma·n·T.
    """
    ratio = _impulse_ratio(residual, evidence, gamma, n, width)
    known = ratio[ratio > 0.0]
    if known.size == 0:
        return []
    starts, stops = run_bounds(ratio >= max(share, _SDS * SD_PER_MAD * median_of(known)))
    out: list[tuple[Event, float]] = []
    for a, b in zip(starts, stops, strict=True):
        best = int(a) + int(np.argmax(ratio[a:b]))
        out.append((_event(residual, best, width), float(ratio[best])))
    return out


def _impulse_ratio(residual: FloatArray, evidence: BoolArray, gamma: Level, n: int, width: int) -> FloatArray:
    """(m,) impulse of ``width`` samples from each on, over gamma·n·T; 0 where they, or those beside, do not count."""
    out = np.zeros(residual.size)
    count = residual.size - width - 2 * n + 1
    if count <= 0:
        return out
    usable, reach = evidence & np.isfinite(residual), width + 2 * n
    total = np.append(0.0, np.cumsum(np.where(usable, residual, 0.0)))
    lost = np.append(0, np.cumsum(~usable))
    level = gamma if isinstance(gamma, float) else gamma[n : n + count]
    counts = (lost[reach:] == lost[:-reach]) & np.greater(level, 0.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = np.maximum(_impulse(total, n, width), 0.0) / (n * level)
    out[n : n + count] = np.where(counts, ratio, 0.0)
    return out


def _impulse(total: FloatArray, n: int, width: int) -> FloatArray:
    """(m,) impulse of ``width`` samples above those beside, from running sums (m + width + 2 n,)."""
    count = total.size - width - 2 * n
    start, stop = total[n : n + count], total[n + width : n + width + count]
    inside, before, after = stop - start, start - total[:count], total[width + 2 * n :] - stop
    sign = np.copysign(1.0, inside)  # a push downwards is turned up
    inside, before, after = sign * inside, sign * (before / n), sign * (after / n)
    middle, higher = np.maximum(0.5 * (before + after), 0.0), np.maximum(np.maximum(before, after), 0.0)
    return np.asarray(np.minimum(inside - width * middle, 2.0 * (inside - width * higher)))


def _event(residual: FloatArray, start: int, width: int) -> Event:
    """The part of an excursion that is at least half as high as its peak."""
    part = residual[start : start + width]
    size = np.abs(part)
    top = int(np.argmax(size))
    low = np.flatnonzero(size < 0.5 * size[top])
    first = int(low[low < top].max(initial=-1)) + 1
    last = int(low[low > top].min(initial=width))
    return Event(Span(start + first, start + last), start + last - 1, last - first, float(part[top]))
