"""Applying the rule to the residuals of a log: collisions, near misses, and the final state of each sample."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from collaudit.core.data.audit_result import Collision, NearMiss, NearMissKind, Phase
from collaudit.core.data.signals import State
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.detection.knocks import knock_width, knocks
from collaudit.core.detection.rule import MERGE_S, Event, apart, collisions, rule_events
from collaudit.core.detection.threshold import Threshold
from collaudit.core.detection.watch import Watch
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.parallel import each, ordered_map
from collaudit.core.numeric.runs import run_bounds
from collaudit.core.prepare.phases import PHASES, contact_mask


@dataclass(frozen=True, slots=True, eq=False)
class DetectedEvents:
    """Events of all joints in time order, and (n, j) states with unwatched stretches marked."""

    collisions: tuple[Collision, ...]
    near_misses: tuple[NearMiss, ...]
    state: NDArray[np.int8]

    def collision_times(self, joint: str) -> list[tuple[float, float]]:
        """Start and end of a joint's collisions, s."""
        return [(c.onset_s, c.onset_s + c.duration_s) for c in self.collisions if c.joint == joint]


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
    watched = [j for j, name in enumerate(series.joint_names) if watch[name].watched and name in rule.gamma_nm]
    columns = residual.isolation.judged_columns(watched, rule.gamma_nm)
    hits: list[Collision] = []
    near: list[NearMiss] = []

    width = knock_width(rule.n, residual.balance.kernel.settle_s, series.period_s)

    def events_of(j: int) -> _Found:
        return _events(residual.torque_nm[:, j], state[:, j], threshold, j, merge, width)

    def joint_of(j: int, event: Event) -> str:
        return residual.isolation.joint_of(j, event.span.start)

    for j, found in zip(columns, ordered_map(events_of, columns), strict=True):
        gamma = rule.gamma_nm[series.joint_names[j]]
        hits += [_collision(series, joint_of(j, e), e, gamma, phases) for e in found.fired]
        lower = rule.lasting_nm.get(series.joint_names[j], gamma)
        hits += [replace(_collision(series, joint_of(j, e), e, lower, phases), lasting=True) for e in found.lasting]
        nearly: list[tuple[NearMissKind, Event, float]] = [("amplitude", e, abs(e.peak) / gamma) for e in found.low]
        nearly += [("persistence", e, e.longest / rule.n) for e in found.brief]
        nearly += [("impulse", e, ratio) for e, ratio in found.knocks]
        near += [_near_miss(series, joint_of(j, e), e, gamma, kind, ratio, phases) for kind, e, ratio in nearly]
    return DetectedEvents(
        tuple(sorted(hits, key=lambda c: (c.onset_s, c.joint))),
        tuple(sorted(near, key=lambda c: (c.onset_s, c.joint))),
        state,
    )


@dataclass(frozen=True, slots=True)
class _Found:
    """One joint's collisions, those of the lower threshold of what lasts, and near misses.

    These are by amplitude, by persistence and, with its ratio each, by impulse.
    """

    fired: list[Event]
    lasting: list[Event]
    low: list[Event]
    brief: list[Event]
    knocks: list[tuple[Event, float]]


def _events(
    torque_nm: FloatArray, state: NDArray[np.int8], threshold: Threshold, j: int, merge: int, width: int
) -> _Found:
    rule = threshold.rule
    evidence = np.asarray(state <= State.FRICTION_INTERVAL)
    (level, _), *lower = threshold.with_persistences(j)
    x, level = np.ascontiguousarray(torque_nm), np.ascontiguousarray(level)
    fired, low, brief = rule_events(
        x, evidence, level, rule.n, rule.near_miss_amplitude, rule.near_miss_persistence, merge
    )
    lasting = [e for less, n in lower for e in apart(collisions(x, evidence, less, n, merge), fired, merge)]
    low, brief = apart(low, lasting, merge), apart(brief, lasting, merge)
    ratios = dict(knocks(x, evidence, level, rule.n, width, rule.near_miss_impulse))
    left = apart(list(ratios), [*fired, *lasting, *low, *brief], max(merge, width))
    return _Found(fired, lasting, low, brief, [(e, ratios[e]) for e in left])


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
        _mark_too_brief(column, n)

    each(fill_joint, range(len(joints)))
    return out


def _mark_too_brief(state: NDArray[np.int8], n: int) -> None:
    """Stretches of evidence shorter than n cannot fire: they were not judged, whatever their residual."""
    starts, stops = run_bounds(np.asarray(state <= State.FRICTION_INTERVAL))
    for k in np.flatnonzero(stops - starts < n):
        state[starts[k] : stops[k]] = State.TOO_BRIEF


def _phase(phases: NDArray[np.int8], sample: int) -> Phase:
    return PHASES[int(phases[sample])]


def _collision(series: UniformSeries, joint: str, event: Event, gamma: float, phases: NDArray[np.int8]) -> Collision:
    return Collision(
        joint=joint,
        onset_s=float(series.time_s[event.span.start]),
        detected_s=float(series.time_s[event.detected]),
        duration_s=len(event.span) * series.period_s,
        peak_nm=event.peak,
        gamma_nm=gamma,
        phase=_phase(phases, event.span.start),
    )


def _near_miss(
    series: UniformSeries,
    joint: str,
    event: Event,
    gamma: float,
    kind: NearMissKind,
    ratio: float,
    phases: NDArray[np.int8],
) -> NearMiss:
    return NearMiss(
        joint=joint,
        onset_s=float(series.time_s[event.span.start]),
        duration_s=len(event.span) * series.period_s,
        peak_nm=event.peak,
        gamma_nm=gamma,
        ratio=ratio,
        kind=kind,
        phase=_phase(phases, event.span.start),
    )
