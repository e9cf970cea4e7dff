"""Applying the rule to the residuals of a log: collisions, near misses, and the final state of each sample."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from collaudit.core.data.audit_result import Collision, NearMiss, NearMissKind, RuleFacts, Spoke
from collaudit.core.data.signals import CycleSignals, State
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.detection.rule import MERGE_S, Event, both_events
from collaudit.core.detection.rule_settings import Watch
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.parallel import each, ordered_map
from collaudit.core.numeric.runs import lasting, lowest_in_row
from collaudit.core.prepare.phases import PHASES, contact_mask
from collaudit.core.residual.residual import Residual


@dataclass(frozen=True, slots=True, eq=False)
class DetectedEvents:
    """Events of all joints in time order, and (n, j) states with unwatched stretches marked."""

    collisions: tuple[Collision, ...]
    near_misses: tuple[NearMiss, ...]
    state: NDArray[np.int8]


@dataclass(frozen=True, slots=True, eq=False)
class JudgedLog:
    """What the rule is applied to.

    Attributes:
        series: the judged joints.
        residual: of them.
        gamma_nm: (n, j) threshold in force.
        rule: as applied.
        phases: (n,) labels.
        cycles: the second residual, by cycles; None where nothing repeats.
    """

    series: UniformSeries
    residual: Residual
    gamma_nm: NDArray[np.float32]
    rule: RuleFacts
    phases: NDArray[np.int8]
    cycles: CycleSignals | None = None


def detect_events(log: JudgedLog, watch: Mapping[str, Watch]) -> DetectedEvents:
    """Rule (6) on every watched joint where its residual is evidence.

    Args:
        log: residual and thresholds.
        watch: which joints count.
    """
    series, rule = log.series, log.rule
    state = _with_unwatched(log.residual.state, series.joint_names, watch, log.phases, rule.n)
    watched = [series.column(joint) for joint in rule.watch]
    hits: list[Collision] = []
    near: list[NearMiss] = []
    for its_hits, its_near in ordered_map(lambda j: _events(log, j, state[:, j]), watched):
        hits += its_hits
        near += its_near
    return DetectedEvents(
        tuple(sorted(hits, key=lambda c: (c.onset_s, c.joint))),
        tuple(sorted(near, key=lambda c: (c.onset_s, c.joint))),
        state,
    )


def _events(log: JudgedLog, j: int, state: NDArray[np.int8]) -> tuple[list[Collision], list[NearMiss]]:
    """Collisions and near misses of one column; ``state`` (n,) of its samples."""
    series, rule = log.series, log.rule
    joint = series.joint_names[j]
    evidence = np.asarray(state <= State.FRICTION_INTERVAL)
    x, gamma = np.ascontiguousarray(log.residual.torque_nm[:, j]), np.ascontiguousarray(log.gamma_nm[:, j])
    near = gamma - np.float32(rule.below_gamma_nm(joint))
    merge, n = round(MERGE_S / series.period_s), rule.n
    cycle = None if log.cycles is None else (log.cycles.torque_nm[:, j], log.cycles.gamma_nm[:, j])
    levels = {"model": (x, gamma), "both": (x, gamma), "cycle": cycle or (x, gamma)}
    fired, low, brief = both_events((x, gamma, near), cycle, evidence, n, rule.near_miss_persistence, merge)

    def hit(event: Event, spoke: Spoke) -> Collision:
        return Collision(
            joint=joint,
            onset_s=float(series.time_s[event.span.start]),
            detected_s=float(series.time_s[event.detected]),
            duration_s=len(event.span) * series.period_s,
            peak_nm=event.peak,
            gamma_nm=float(levels[spoke][1][event.peak_at]),
            phase=PHASES[int(log.phases[event.span.start])],
            spoke=spoke,
        )

    nearly: list[tuple[NearMissKind, Event, Spoke, float]] = [
        ("amplitude", e, spoke, _kept_share(levels[spoke][0], evidence, levels[spoke][1], e, n)) for e, spoke in low
    ]
    nearly += [("persistence", e, spoke, e.longest / n) for e, spoke in brief]
    return [hit(*told) for told in fired], [_near_miss(hit(e, spoke), kind, ratio) for kind, e, spoke, ratio in nearly]


def _kept_share(x: FloatArray, evidence: BoolArray, gamma: NDArray[np.float32], event: Event, n: int) -> float:
    """The largest share of the threshold in force that n samples of an event in a row keep."""
    part = event.span.slice
    share = np.where(evidence[part], np.abs(x[part]), 0.0) / gamma[part]
    return float(lowest_in_row(share, n).max())


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
        spoke=event.spoke,
    )
