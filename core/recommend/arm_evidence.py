"""What recommendations rest on: the residuals of all joints of all logs, and which of their samples count."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
import scipy

from collaudit.core.cycles.null_level import NullEvidence
from collaudit.core.data.audit_result import Audit, Collision, LogFacts, NearMiss, PhaseSpan, RuleFacts
from collaudit.core.data.detection_result import RestDisturbance
from collaudit.core.data.signals import Signals, State
from collaudit.core.detection.rule import persistence_samples
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray, lowest_in_row

#: Start and end of stretches of time, s.
Times = Sequence[tuple[float, float]]
Why = Literal["contact", "alarm", "near miss", "disturbed", "suspicious"]
#: Left out on either side of an event: what a contact does to an arm lasts longer than what exceeds a level.
MARGIN_S = 0.5
#: Peaks closer than this are one, s.
_APART_S = 1.0


@dataclass(frozen=True, slots=True)
class LeftOutStretch:
    """A stretch that is no evidence, for any joint.

    Attributes:
        log: name of its log.
        start_s, end_s: s from the log's first sample, margin included.
        why: known contact, an alarm or near miss of a joint, a standing joint that was disturbed, or suspicious beside
            the rest of the residual.
        joints: the joints that gave cause; empty for known contact.
    """

    log: str
    start_s: float
    end_s: float
    why: Why
    joints: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class LogEvidence:
    """What one log contributes.

    Attributes:
        name, sha256: of the log.
        signals: its residuals and motion.
        period_s: sample period, s.
        watched: the joints that its rule judges.
        free: (n,) samples that no event, of whichever joint, lies near.
        clean: (n, j) samples that count: free, and the rule can fire there (friction a value or an interval).
        left_out: the stretches that are not free, in time order.
        contact_known: a person or a file says what was contact; alarms elsewhere are false ones, and count.
        phases: of the run, as stretches of time.
        temperature_c: lowest and highest of the whole log, by joint, where it is known.
    """

    name: str
    sha256: str
    signals: Signals
    period_s: float
    watched: tuple[str, ...]
    free: BoolArray
    clean: BoolArray
    left_out: tuple[LeftOutStretch, ...]
    contact_known: bool
    phases: tuple[PhaseSpan, ...] = ()
    temperature_c: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    def of_joint(self, joint: str, moving: bool = False) -> NullEvidence:
        """One joint's residual with its clean samples, or those of them in motion."""
        k = self.signals.joint_names.index(joint)
        clean = self.clean[:, k] & (self.signals.state[:, k] == State.JUDGED) if moving else self.clean[:, k]
        return NullEvidence(self.signals.residual_nm[:, k], clean, self.period_s)

    def left_out_s(self, joint: str) -> float:
        """Seconds in which one joint's rule can fire, left out because they lie around events."""
        k = self.signals.joint_names.index(joint)
        lost = np.count_nonzero(~self.free & (self.signals.state[:, k] <= State.FRICTION_INTERVAL))
        return float(lost) * self.period_s

    def without(self, stretches: Sequence[LeftOutStretch]) -> LogEvidence:
        """The same with further stretches left out."""
        if not stretches:
            return self
        free = self.free & ~self.signals.inside([(s.start_s, s.end_s) for s in stretches])
        every = tuple(sorted((*self.left_out, *stretches), key=lambda s: s.start_s))
        return replace(self, free=free, clean=self.clean & free[:, None], left_out=every)


@dataclass(frozen=True, slots=True, eq=False)
class SustainedPeaks:
    """Separate peaks of one joint over all logs.

    Attributes:
        level_nm: (b,) the largest level that |residual| kept for n samples in a row.
        log: (b,) index of its log.
        time_s: (b,) when, s from the start of its log.
        hours: clean time in stretches in which the rule can fire.
    """

    level_nm: FloatArray
    log: IntArray
    time_s: FloatArray
    hours: float


@dataclass(frozen=True, slots=True, eq=False)
class ArmEvidence:
    """The evidence of all logs together.

    Attributes:
        logs: one entry a log.
        joints: watched in any of them, in their order.
    """

    logs: tuple[LogEvidence, ...]
    joints: tuple[str, ...]
    _peaks: dict[tuple[str, float], SustainedPeaks] = field(default_factory=dict)

    def watching(self, joint: str) -> list[LogEvidence]:
        """The logs that watch a joint."""
        return [log for log in self.logs if joint in log.watched]

    def of_joint(self, joint: str, moving: bool = False) -> list[NullEvidence]:
        """Clean residuals of one joint, or those in motion, one entry for each log that watches it."""
        return [log.of_joint(joint, moving) for log in self.watching(joint)]

    def peaks(self, joint: str, persistence_s: float) -> SustainedPeaks:
        """Separate peaks of one joint over its logs, found once for a persistence."""
        if (joint, persistence_s) not in self._peaks:
            data = self.of_joint(joint)
            counts = [persistence_samples(persistence_s, d.period_s) for d in data]
            self._peaks[joint, persistence_s] = separate_peaks(data, counts)
        return self._peaks[joint, persistence_s]

    @property
    def left_out(self) -> tuple[LeftOutStretch, ...]:
        """What is left out, log by log."""
        return tuple(stretch for log in self.logs for stretch in log.left_out)


def gather_evidence(audits: Sequence[Audit], contact: Sequence[Times | None] = ()) -> ArmEvidence:
    """Evidence of finished audits.

    Args:
        audits: judged logs.
        contact: for each audit the start and end of all contacts, s, none where it is free of them; None where that is
            not known: alarms and near misses of all joints are left out then.
    """
    known = [*contact, *[None] * (len(audits) - len(contact))]
    logs = tuple(log_evidence(audit, stated) for audit, stated in zip(audits, known, strict=True))
    return ArmEvidence(logs, tuple(dict.fromkeys(joint for log in logs for joint in log.watched)))


def log_evidence(audit: Audit, contact: Times | None = None) -> LogEvidence:
    """Evidence of one audit; arguments as of :func:`gather_evidence`."""
    result = audit.result
    events = (result.collisions, result.near_misses)
    known = {joint: stats.temperature_range_c for joint, stats in result.residual.items()}
    found = evidence_of(result.log, result.rule, audit.signals, result.phases, events, contact, result.disturbances)
    return replace(found, temperature_c={joint: heat for joint, heat in known.items() if heat is not None})


def evidence_of(
    log: LogFacts,
    rule: RuleFacts,
    signals: Signals,
    phases: tuple[PhaseSpan, ...],
    events: tuple[Sequence[Collision], Sequence[NearMiss]],
    contact: Times | None = None,
    disturbances: Sequence[RestDisturbance] = (),
) -> LogEvidence:
    """Evidence of one judged log.

    Args:
        log, rule, signals, phases: of its audit.
        events: its alarms and near misses.
        contact: as of :func:`gather_evidence`.
        disturbances: standing joints that were pushed below what alarms.
    """
    causes: list[LeftOutStretch] = []
    if contact is None:
        causes += [_around(log.name, c.onset_s, c.duration_s, "alarm", c.joint) for c in events[0]]
        causes += [_around(log.name, m.onset_s, m.duration_s, "near miss", m.joint) for m in events[1]]
        causes += [
            LeftOutStretch(
                log.name, d.onset_s - MARGIN_S, d.end_s + MARGIN_S, "disturbed", tuple(j.joint for j in d.joints)
            )
            for d in disturbances
        ]
    else:
        causes += [LeftOutStretch(log.name, a - MARGIN_S, b + MARGIN_S, "contact") for a, b in contact]
    stretches = joined(causes)
    free = ~signals.inside([(s.start_s, s.end_s) for s in stretches])
    clean = np.isfinite(signals.residual_nm)
    for own, states in zip(clean.T, signals.state.T, strict=True):  # a joint at a time: tables of a long log are large
        own &= free
        own &= states <= State.FRICTION_INTERVAL
    return LogEvidence(
        name=log.name,
        sha256=log.sha256,
        signals=signals,
        period_s=log.sample_period_s,
        watched=tuple(joint for joint in signals.joint_names if joint in rule.watch),
        free=free,
        clean=clean,
        left_out=stretches,
        contact_known=contact is not None,
        phases=phases,
    )


def _around(log: str, onset_s: float, duration_s: float, why: Why, joint: str) -> LeftOutStretch:
    return LeftOutStretch(log, onset_s - MARGIN_S, onset_s + duration_s + MARGIN_S, why, (joint,))


def joined(stretches: Sequence[LeftOutStretch]) -> tuple[LeftOutStretch, ...]:
    """Stretches of one log with those that overlap made one; an alarm outranks a near miss, known contact both."""
    rank: Mapping[Why, int] = {"contact": 0, "alarm": 1, "near miss": 2, "disturbed": 3, "suspicious": 4}
    out: list[LeftOutStretch] = []
    for new in sorted(stretches, key=lambda s: (s.start_s, s.end_s)):
        if out and new.start_s <= out[-1].end_s:
            last = out.pop()
            why = min(last.why, new.why, key=rank.__getitem__)
            joints = tuple(dict.fromkeys((*last.joints, *new.joints)))
            new = LeftOutStretch(last.log, last.start_s, max(last.end_s, new.end_s), why, joints)
        out.append(new)
    return tuple(out)


def sustained_level(data: NullEvidence, n: int) -> FloatArray:
    """(m,) the smallest |residual| of each n samples in a row, by their first sample; -inf where one does not count.

    Rule (6) with this n fires in clean data exactly where it exceeds gamma.
    """
    known = data.moving & np.isfinite(data.residual_nm)
    return lowest_in_row(np.where(known, np.abs(data.residual_nm), -np.inf), n)


def separate_peaks(data: Sequence[NullEvidence], counts: Sequence[int]) -> SustainedPeaks:
    """Peaks of one joint over its logs, a second apart at least.

    Args:
        data: its clean residuals, one entry a log.
        counts: n of the rule on each log, samples.
    """
    level, time_s, log, hours = list[FloatArray](), list[FloatArray](), list[IntArray](), 0.0
    for k, (one, n) in enumerate(zip(data, counts, strict=True)):
        sustained = sustained_level(one, n)
        ends = np.pad(sustained, 1, constant_values=-np.inf)  # a peak may be the first or last sample
        at = scipy.signal.find_peaks(ends, distance=max(1, round(_APART_S / one.period_s)))[0] - 1
        level.append(sustained[at])
        time_s.append(np.asarray(at * one.period_s, dtype=np.float64))
        log.append(np.full(at.size, k))
        hours += float(np.count_nonzero(np.isfinite(sustained))) * one.period_s / 3600.0
    if not data:
        return SustainedPeaks(np.empty(0), np.empty(0, np.int64), np.empty(0), 0.0)
    return SustainedPeaks(np.concatenate(level), np.concatenate(log), np.concatenate(time_s), hours)
