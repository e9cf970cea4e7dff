"""One detector applied to one log: residual, threshold, events."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from collaudit.core.config.schema import Config
from collaudit.core.cycles.cycle_reference import CycleResidual, cycle_residual
from collaudit.core.data.audit_result import Collision, NearMiss, NearMissKind, RuleFacts, Spoke
from collaudit.core.data.cycles_result import CycleReference
from collaudit.core.data.detection_result import (
    DelayFacts,
    LevelFacts,
    ShortestPush,
    ZeroFacts,
)
from collaudit.core.data.signals import CycleSignals, Signals, State
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.detection.rule import MERGE_S, Event, both_events
from collaudit.core.detection.rule_settings import Watch
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.kernel import Kernel
from collaudit.core.numeric.parallel import each, ordered_map
from collaudit.core.numeric.runs import lasting, lowest_in_row
from collaudit.core.numeric.stats import median_of
from collaudit.core.prepare.phases import PHASES, contact_mask
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.residual.detector import Detector, detector_named
from collaudit.core.residual.parts import joined_residual
from collaudit.core.residual.residual import Residual, ResidualInputs


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


#: What raises a threshold does so in steps of at most this share of it: a slow change then takes no room in a file.
_STEP = 1.0 / 256.0


def gamma_in_force(series: UniformSeries, residual: Residual, rule: RuleFacts) -> NDArray[np.float32]:
    """(n, j) threshold of each sample, N·m; NaN of a joint without one. Nothing lowers it.

    A stated one is constant, as stated. In 32 bits, as ``signals.parquet`` keeps it: whoever compares with it there
    compares with what was applied.

    Args:
        series: the judged joints.
        residual: what it may be wrong by raises a threshold.
        rule: thresholds; what comes on top where friction is an interval.
    """
    n, joints = residual.torque_nm.shape
    out = np.empty((n, joints), np.float32, order="F")

    def fill(j: int) -> None:
        joint = series.joint_names[j]
        gamma, extra = rule.gamma_nm.get(joint, np.nan), rule.at_rest_nm.get(joint, 0.0)
        raised = residual.uncertainty_nm[:, j]
        if extra > 0.0:
            raised = np.where(residual.state[:, j] == State.FRICTION_INTERVAL, raised + extra, raised)
        automatic = joint in rule.motion_nm or joint in residual.still
        out[:, j] = gamma + _whole_steps(raised, gamma) if automatic else gamma

    each(fill, range(joints))
    return out


def _whole_steps(raised_nm: FloatArray, gamma_nm: float) -> FloatArray:
    """(n,) rounded up to multiples of a power of two."""
    step = 2.0 ** np.floor(np.log2(_STEP * gamma_nm))
    return np.asarray(step * np.ceil(raised_nm / step))


@dataclass(frozen=True, slots=True, eq=False)
class DetectorRun:
    """What one detector made of a log; ``gamma_nm`` (n, j) is the threshold in force, NaN of a joint without one.

    ``cycles`` is the second residual, of the same place in other cycles; None where nothing repeats.
    """

    detector: Detector
    residual: Residual
    gamma_nm: NDArray[np.float32]
    detected: DetectedEvents
    cycles: CycleResidual | None = None

    def strongest(self, j: int, rows: slice = slice(None)) -> tuple[FloatArray, FloatArray]:
        """(m,) of one joint the residual that stands further above its threshold, and over that threshold."""
        torque = self.residual.torque_nm[rows, j]
        ratio = torque / self.gamma_nm[rows, j]
        if self.cycles is None:
            return torque, ratio
        its = self.cycles.signals.torque_nm[rows, j]
        beside = its / self.cycles.signals.gamma_nm[rows, j]
        more = np.abs(beside) > np.abs(ratio)
        return np.where(more, its, torque), np.where(more, beside, ratio)


@dataclass(frozen=True, slots=True)
class DetectionInputs(ResidualInputs):
    """What every detector shares: beside friction laws and joints not to be judged the rule and the watched joints.

    ``earlier`` is what passed nights say of the program's cycles.
    """

    rule: RuleFacts
    watch: Mapping[str, Watch]
    earlier: tuple[CycleReference, ...] = field(default=(), kw_only=True)


@dataclass(frozen=True, slots=True, eq=False)
class JudgedPart:
    """A part of a log, judged by a fit that has not seen it.

    Attributes:
        rows: (n,) samples of the part.
        prepared: the whole log, as that fit has it.
        inputs: laws, and the rule, as that fit gives them.
    """

    rows: BoolArray
    prepared: Prepared
    inputs: DetectionInputs


def run_detector(
    prepared: Prepared, inputs: DetectionInputs, config: Config, parts: Sequence[JudgedPart] = ()
) -> DetectorRun:
    """Apply the configured detector.

    Args:
        prepared: the log.
        inputs: friction laws, joints that contradict the model, the rule, watched joints.
        config: the detector and its settings.
        parts: of the log, where each has a fit of its own; none where the inputs are those of all of it.

    Raises:
        ConfigError: there is no such detector.
    """
    detector = detector_named(config.detect.detector)

    def of_part(part: JudgedPart) -> Residual:
        own = replace(part.inputs, not_judged=inputs.not_judged)
        found = detector.residual(part.prepared, own, config.detect)
        _raise_thresholds(found, own.rule, inputs.rule, part.prepared.judged)
        return found

    if parts:
        residual = joined_residual((part.rows, of_part(part)) for part in parts)
    else:
        residual = detector.residual(prepared, inputs, config.detect)
    series, rule = prepared.judged_series, inputs.rule
    gamma = gamma_in_force(series, residual, rule)
    cycles = None
    if not config.detect.causal:
        cycles = cycle_residual(series, residual, rule, config, inputs, inputs.earlier)
    signals = None if cycles is None else cycles.signals
    detected = detect_events(JudgedLog(series, residual, gamma, rule, prepared.phases, signals), inputs.watch)
    return DetectorRun(detector, residual, gamma, detected, cycles)


def _raise_thresholds(residual: Residual, own: RuleFacts, common: RuleFacts, joints: Sequence[str]) -> None:
    """Raise what is in force from the thresholds that all parts have in common to those of one part."""
    for j, joint in enumerate(joints):
        if joint in common.gamma_nm:
            residual.uncertainty_nm[:, j] += own.gamma_nm[joint] - common.gamma_nm[joint]
            more = own.at_rest_nm.get(joint, 0.0) - common.at_rest_nm.get(joint, 0.0)
            residual.uncertainty_nm[residual.state[:, j] == State.FRICTION_INTERVAL, j] += more


def delay_facts(kernel: Kernel, rule: RuleFacts, period_s: float) -> DelayFacts:
    """Delay of a detector with this kernel, in its parts."""
    exactly = shortest_pushes(kernel, rule.n, period_s)
    return DelayFacts(kernel.delay_s, rule.persistence_s, period_s, kernel.noise_gain(period_s), exactly)


def friction_levels(residual: Residual) -> dict[str, LevelFacts]:
    """Range and standard error of each joint's friction level."""
    facts = {}
    for joint, level in residual.levels.items():
        share = 1.0 + level.deviation
        facts[joint] = LevelFacts(
            lowest=float(share.min()),
            median=median_of(share),
            highest=float(share.max()),
            sd=median_of(level.sd),
            mean=1.0 + level.mean,
        )
    return facts


def torque_zeros(residual: Residual) -> dict[str, ZeroFacts]:
    """What was found of each joint's zero, and its bound."""
    return {joint: ZeroFacts(z.lowest_nm, z.highest_nm, z.bound_nm) for joint, z in residual.zeros.items()}


def judged_signals(series: UniformSeries, run: DetectorRun, rule: RuleFacts) -> Signals:
    """The sample-by-sample evidence of a run: torques, what is left over, the threshold in force, what was judged."""
    measured = np.broadcast_to(np.nan, series.position_rad.shape) if series.effort is None else series.effort
    least, most = _spans(run)
    return Signals(
        time_s=series.time_s,
        joint_names=series.joint_names,
        position_rad=series.position_rad,
        velocity_rad_s=series.velocity_rad_s,
        measured_nm=measured,
        model_nm=run.residual.model_nm,
        residual_nm=run.residual.torque_nm,
        state=run.detected.state,
        gamma_nm=run.gamma_nm,
        near_below_nm=np.array(
            [rule.below_gamma_nm(joint) if joint in rule.gamma_nm else np.nan for joint in series.joint_names]
        ),
        least_nm=least,
        most_nm=most,
        wrench=series.wrench,
        cycles=None if run.cycles is None else run.cycles.signals,
    )


def _spans(run: DetectorRun) -> tuple[NDArray[np.float32], NDArray[np.float32]] | tuple[None, None]:
    """Least and greatest residual where friction is an interval, NaN elsewhere; in 7 digits, which are looked at."""
    state, spans = run.detected.state, run.residual.span_nm
    if spans is None:
        return None, None
    least, most = (np.empty(state.shape, np.float32, order="F") for _ in spans)

    def fill(j: int) -> None:
        for out, span in ((least, spans[0]), (most, spans[1])):
            out[:, j] = np.where(state[:, j] == State.FRICTION_INTERVAL, span[:, j], np.nan)

    each(fill, range(state.shape[1]))
    return least, most


#: Heights of the pushes, in thresholds.
RATIOS = (1.3, 2.0, 4.0)


def shortest_pushes(kernel: Kernel, n: int, period_s: float) -> tuple[ShortestPush, ...]:
    """Shortest rectangular push of each height whose smoothed torque lies above gamma for ``n`` samples in a row.

    Args:
        kernel: of the detector; the torque of the motion passes the filters of the signals besides.
        n: persistence, samples.
        period_s: sample period, s.
    """
    longest = n + max(16, math.ceil(4.0 * kernel.settle_s / period_s))

    def alarms(samples: int, ratio: float) -> bool:
        response, _ = kernel.push_response(samples, period_s)
        return bool(lasting(response > 1.0 / ratio, n).any())

    # A longer push alarms where a shorter one does.
    found = {r: bisect_left(range(longest + 1), True, key=partial(alarms, ratio=r)) for r in RATIOS}
    return tuple(ShortestPush(ratio, count * period_s) for ratio, count in found.items() if count <= longest)
