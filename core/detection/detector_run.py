"""One detector applied to one log: residual, threshold, events."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from collaudit.core.config.schema import Config
from collaudit.core.cycles.cycle_reference import CycleResidual, cycle_residual
from collaudit.core.data.audit_result import Collision, NearMiss, NearMissKind, RuleFacts, Spoke
from collaudit.core.data.detection_result import DelayFacts, DetectionFacts
from collaudit.core.data.joint_log import UniformSeries
from collaudit.core.data.signals import CycleReference, CycleSignals, Signals, State
from collaudit.core.detection.rule import MERGE_S, Event, both_events
from collaudit.core.detection.rule_settings import Watch
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import BoolArray, FloatArray, lasting, lowest_in_row
from collaudit.core.numeric.parallel import by_name, each
from collaudit.core.prepare.phases import PHASES, contact_mask
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.residual.detector import Detector, detector_named, joined_residual
from collaudit.core.residual.residual import Residual, ResidualInputs


@dataclass(frozen=True, slots=True, eq=False)
class DetectedEvents:
    """Events of all joints in time order, and (n, j) states with unwatched stretches marked."""

    collisions: tuple[Collision, ...]
    near_misses: tuple[NearMiss, ...]
    state: NDArray[np.int8]


def detect_events(
    prepared: Prepared,
    residual: Residual,
    gamma_nm: NDArray[np.float32],
    cycles: CycleSignals | None,
    inputs: DetectionInputs,
) -> DetectedEvents:
    """Rule (6) on every watched joint where its residual is evidence.

    Args:
        prepared: the log.
        residual: of its judged joints.
        gamma_nm: (n, j) threshold in force.
        cycles: the second residual, by cycles; None where nothing repeats.
        inputs: the rule, and which joints count.
    """
    series, rule = prepared.judged_series, inputs.rule
    state = _with_unwatched(residual.state, series.joint_names, inputs.watch, prepared.phases, rule.n)
    merge = round(MERGE_S / series.period_s)

    def of_joint(joint: str) -> tuple[list[Collision], list[NearMiss]]:
        j = series.column(joint)
        evidence = np.asarray(state[:, j] <= State.FRICTION_INTERVAL)
        x, gamma = np.ascontiguousarray(residual.torque_nm[:, j]), np.ascontiguousarray(gamma_nm[:, j])
        near = gamma - np.float32(rule.below_gamma_nm(joint))
        cycle = None if cycles is None else (cycles.torque_nm[:, j], cycles.gamma_nm[:, j])
        levels = {"model": (x, gamma), "both": (x, gamma), "cycle": cycle or (x, gamma)}
        fired, low, brief = both_events((x, gamma, near), cycle, evidence, rule.n, rule.near_miss_persistence, merge)

        def hit(event: Event, spoke: Spoke) -> Collision:
            return Collision(
                joint=joint,
                onset_s=float(series.time_s[event.span.start]),
                detected_s=float(series.time_s[event.detected]),
                duration_s=len(event.span) * series.period_s,
                peak_nm=event.peak,
                gamma_nm=float(levels[spoke][1][event.peak_at]),
                phase=PHASES[int(prepared.phases[event.span.start])],
                spoke=spoke,
            )

        near_misses = [
            _near_miss(hit(e, spoke), "amplitude", _kept_share(levels[spoke][0], evidence, levels[spoke][1], e, rule.n))
            for e, spoke in low
        ]
        near_misses += [_near_miss(hit(e, spoke), "persistence", e.longest / rule.n) for e, spoke in brief]
        return [hit(*told) for told in fired], near_misses

    found = by_name(of_joint, rule.watch).values()
    return DetectedEvents(
        tuple(sorted((one for hits, _ in found for one in hits), key=lambda c: (c.onset_s, c.joint))),
        tuple(sorted((one for _, near in found for one in near), key=lambda c: (c.onset_s, c.joint))),
        state,
    )


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
        if joint in rule.motion_nm or joint in residual.still:  # automatic: raised in multiples of a power of two
            step = 2.0 ** np.floor(np.log2(_STEP * gamma))
            gamma = gamma + step * np.ceil(raised / step)
        out[:, j] = gamma

    each(fill, range(joints))
    return out


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
class Settled:
    """What a log, or a part of one, is judged with.

    Attributes:
        prepared: the whole log, as its fit has it; hand guiding and smoothing marked that its friction shows.
        config: with numbers in place of "auto".
        choices: findings on how thresholds were chosen.
        inputs: rule and laws.
        rows: (n,) samples of a part that is judged by a fit which has not seen it; None for all.
    """

    prepared: Prepared
    config: Config
    choices: tuple[Finding, ...]
    inputs: DetectionInputs
    rows: BoolArray | None = None


def run_detector(
    prepared: Prepared, inputs: DetectionInputs, config: Config, parts: Sequence[Settled] = ()
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

    def of_part(part: Settled) -> Residual:
        own = replace(part.inputs, not_judged=inputs.not_judged)
        found = detector.residual(part.prepared, own, config.detect)
        _raise_thresholds(found, own.rule, inputs.rule, part.prepared.judged)
        return found

    if parts:
        residual = joined_residual((part.rows, of_part(part)) for part in parts if part.rows is not None)
    else:
        residual = detector.residual(prepared, inputs, config.detect)
    series, rule = prepared.judged_series, inputs.rule
    gamma = gamma_in_force(series, residual, rule)
    cycles = None
    if not config.detect.causal:
        cycles = cycle_residual(series, residual, rule, config, inputs, inputs.earlier)
    detected = detect_events(prepared, residual, gamma, None if cycles is None else cycles.signals, inputs)
    return DetectorRun(detector, residual, gamma, detected, cycles)


def _raise_thresholds(residual: Residual, own: RuleFacts, common: RuleFacts, joints: Sequence[str]) -> None:
    """Raise what is in force from the thresholds that all parts have in common to those of one part."""
    for j, joint in enumerate(joints):
        if joint in common.gamma_nm:
            residual.uncertainty_nm[:, j] += own.gamma_nm[joint] - common.gamma_nm[joint]
            more = own.at_rest_nm.get(joint, 0.0) - common.at_rest_nm.get(joint, 0.0)
            residual.uncertainty_nm[residual.state[:, j] == State.FRICTION_INTERVAL, j] += more


def detection_facts(run: DetectorRun, rule: RuleFacts, causal: bool, period_s: float) -> DetectionFacts:
    """Equation, delay in its parts, friction level and torque zero of a run; alarms of others and scores come later."""
    kernel, residual = run.residual.balance.kernel, run.residual
    return DetectionFacts(
        causal=causal,
        equation=run.detector.equation,
        delay=DelayFacts(kernel.delay_s, rule.persistence_s, period_s, kernel.noise_gain(period_s)),
        friction_level=residual.levels,
        flags=(),
        torque_zero=residual.zeros,
    )


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
