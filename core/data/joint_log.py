"""A log, as recorded and as conditioning puts it on a uniform time base.

Joint signals, the wrist sensor, what the log says of itself, and where it came from; below them what lies in a folder
of logs and was not judged.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from datetime import UTC, datetime
from math import ceil
from typing import Literal, Protocol

import numpy as np

from collaudit.core.data import Showing, Shown, first_few
from collaudit.core.data.audit_result import LogFacts
from collaudit.core.data.identification_result import Coupling
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray, Span, frozen

EffortUnit = Literal["Nm", "raw"]
JointType = Literal["revolute", "prismatic"]


class Digest(Protocol):
    """A hash that is computed where it is asked for."""

    def result(self) -> str:
        """The hash."""


@dataclass(frozen=True, slots=True)
class LogSource:
    """Where a log came from.

    The hash is computed when results are written: who looks at a log does without. A copy or a pickle holds the text.

    Attributes:
        name: file name without its folder (several files joined by ``+``).
        digest: hash of the bytes, or what computes it for :attr:`sha256`.
        format: ``csv``, ``mcap-ros2``, ``mcap-ros1``, ``ros1-bag``, ``ros2-db3`` …
        start_ns: absolute stamp of the first sample in nanoseconds since the epoch, or None when unknown.
        time_source: ``header``, ``log``, ``column``, or the ``rate`` of rows.
        topic: the topic or file(s) the joint states came from.
    """

    name: str
    digest: str | Digest = field(compare=False)
    format: str
    start_ns: int | None
    time_source: str
    topic: str

    @property
    def sha256(self) -> str:
        """Hash of the bytes; of several files, the hash of their hashes in the order of their names."""
        return self.digest if isinstance(self.digest, str) else self.digest.result()


@dataclass(frozen=True, slots=True, eq=False)
class WrenchSeries:
    """A wrist force/torque signal on its own stamps, as recorded (sensor frame, offset not removed).

    Attributes:
        time_s: (k,) seconds from the log's first joint sample.
        wrench: (k, 6) force in N, then torque in N·m.
        topic: where it came from.
    """

    time_s: FloatArray
    wrench: FloatArray
    topic: str


@dataclass(frozen=True, slots=True)
class Annotation:
    """What a log itself says about stretches of time: a controller's alarm, a note of a person, a phase.

    Attributes:
        name: of the alarm or note, or the phase's value as text.
        source: topic or column it came from.
        intervals_s: (start, end) of the stretches in which it holds, seconds from the log's first joint sample, in
            order; the end is the last stamp at which it held.
        joint: the joint it speaks of, or None for the whole arm.
    """

    name: str
    source: str
    intervals_s: tuple[tuple[float, float], ...]
    joint: str | None = None


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class JointLog(Showing):
    """Joint signals as recorded, in SI units, columns in ``joint_names`` order.

    Units, signs and torque constants from the configuration are already applied; stamps are as
    recorded (they may repeat, run backwards or leave gaps: conditioning deals with that).
    Missing values are NaN.

    Attributes:
        time_s: (n,) seconds from the first sample.
        joint_names: j names, the robot model's where a mapping was given.
        position_rad: (n, j) rad, or m for prismatic joints.
        velocity_rad_s: (n, j) rad/s or m/s, or None when the log has none at all.
        effort: (n, j) in ``effort_unit``, or None when the log has none at all.
        effort_unit: ``Nm`` (N for prismatic joints) or ``raw`` when the log's unit is not a torque.
        wrench: the wrist sensor, or None.
        source: provenance.
        findings: what reading the log showed.
        annotations: alarms of the controller and notes of true events that the log holds.
        phases: the phases that the log itself states, one annotation a value.
        temperature_c: (n, j) temperature of each joint, °C; None when the log has none.
        joint_torque_nm: (n, j) of torque sensors behind the gears, where ``effort`` is the drives'; None without.
        couplings: motors that turn with several joints, as the configuration states them.
    """

    time_s: FloatArray
    joint_names: tuple[str, ...]
    position_rad: FloatArray
    velocity_rad_s: FloatArray | None
    effort: FloatArray | None
    effort_unit: EffortUnit
    wrench: WrenchSeries | None
    source: LogSource
    findings: tuple[Finding, ...] = ()
    annotations: tuple[Annotation, ...] = ()
    phases: tuple[Annotation, ...] = ()
    temperature_c: FloatArray | None = None
    joint_torque_nm: FloatArray | None = None
    couplings: tuple[Coupling, ...] = ()

    def __post_init__(self) -> None:
        n, j = self.time_s.shape[0], len(self.joint_names)
        for name in ("position_rad", "velocity_rad_s", "effort", "temperature_c", "joint_torque_nm"):
            array = getattr(self, name)
            if array is not None and array.shape != (n, j):
                raise ValueError(f"{name} has shape {array.shape}, expected {(n, j)}")

    def samples(self, rows: BoolArray | slice) -> JointLog:
        """The log with some of its samples only; the wrench, which has stamps of its own, stays whole."""
        values = {each.name: getattr(self, each.name) for each in fields(self)}
        kept = {name: frozen(value[rows]) for name, value in values.items() if isinstance(value, np.ndarray)}
        return replace(self, **kept)  # type: ignore[arg-type]

    def outline(self) -> Shown:
        """Joints, length, rate, what was recorded, findings."""
        n, span_s = len(self.time_s), float(self.time_s[-1] - self.time_s[0]) if len(self.time_s) else 0.0
        missing = [name for name in ("velocity_rad_s", "effort", "wrench") if getattr(self, name) is None]
        rows = [
            ("joints", ", ".join(self.joint_names)),
            ("samples", f"{n}, about {(n - 1) / span_s:.4g} Hz" if span_s > 0 else str(n)),
            ("effort", self.effort_unit),
            ("not in it", ", ".join(missing)),
            ("findings", first_few(dict.fromkeys(finding.code for finding in self.findings), 8)),
        ]
        return f"{self.source.name} ({self.source.format}), {span_s:.4g} s", [row for row in rows if row[1]]


#: A joint moves when it is faster than this, rad/s (m/s of a prismatic joint): slower, noise decides on the direction,
#: friction is not that of sliding, and the same position twice is no surprise.
MOVING_RAD_S = 0.02
#: Less than any channel resolves, in any unit of an effort: values that differ by less are memory that nobody filled.
LEAST_EFFORT_CHANGE = 1e-12
#: Periods of the filters' -3 dB frequency after which nothing is left of how a stretch begins.
SETTLED_PERIODS = 1.5


@dataclass(frozen=True, slots=True, eq=False)
class LoneRows:
    """Rows recorded in gaps of the grid: they lack a position, or are too few in a row to be judged.

    Attributes:
        at: (k,) nearest grid samples.
        effort: (k, j) as recorded.
        position_rad, velocity_rad_s: (k, j) as recorded; NaN where unknown.
        slopes_rad_s2: (2, k, j) slope of the velocity from the row before and to the row after.
    """

    at: IntArray
    effort: FloatArray
    position_rad: FloatArray
    velocity_rad_s: FloatArray
    slopes_rad_s2: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class UniformSeries:
    """Joint signals on a uniform time base, with gaps kept as gaps.

    Attributes:
        time_s: (n,) seconds from the log's first sample, spaced ``period_s``.
        period_s: sample period in s.
        joint_names: j names.
        position_rad, velocity_rad_s, acceleration_rad_s2: (n, j); NaN inside gaps. Acceleration is the slope of the
            velocity, and computed where it is read.
        effort: (n, j), not filtered; NaN inside gaps; None when there is none.
        effort_unit: ``Nm`` or ``raw``.
        wrench: (n, 6) in the sensor frame, not filtered, NaN where absent; or None.
        segments: the gap-free stretches, in order.
        edge: (n,) True near the ends of a segment where the filters have not settled.
        saturated: (n, j) True where the effort is pinned at an extreme.
        bandwidth_hz: -3 dB frequency of the zero-phase filters.
        source: provenance of the log.
        findings: those of the log and those made here.
        raw_velocity_rad_s: (n, j) the believed velocity before any filter; None when not kept, as for detectors that
            are not causal.
        velocity_lag_s: how late the logged velocity is against the positions, s; None where that is not told.
        annotations, phases: those of the log.
        temperature_c: (n, j), or None.
        bridged: (n,) samples that were lost and interpolated; None where that is not told.
        joint_torque_nm: (n, j) of torque sensors behind the gears, not filtered; or None.
        couplings: those of the log.
        off_grid_s: time of the log that has no sample on the grid: most of a very long gap, and rows without
            positions before the first sample and after the last, s.
        not_driven: (n,) True where the drives were off, braking or stopped, or the arm was guided by hand; None
            where that never was.
        lone: rows recorded in gaps; None where there is none.
    """

    time_s: FloatArray
    period_s: float
    joint_names: tuple[str, ...]
    position_rad: FloatArray
    velocity_rad_s: FloatArray
    acceleration_rad_s2: FloatArray
    effort: FloatArray | None
    effort_unit: EffortUnit
    wrench: FloatArray | None
    segments: tuple[Span, ...]
    edge: BoolArray
    saturated: BoolArray
    bandwidth_hz: float
    source: LogSource
    findings: tuple[Finding, ...] = ()
    raw_velocity_rad_s: FloatArray | None = None
    velocity_lag_s: float | None = None
    annotations: tuple[Annotation, ...] = ()
    phases: tuple[Annotation, ...] = ()
    temperature_c: FloatArray | None = None
    bridged: BoolArray | None = None
    joint_torque_nm: FloatArray | None = None
    couplings: tuple[Coupling, ...] = ()
    off_grid_s: float = 0.0
    not_driven: BoolArray | None = None
    lone: LoneRows | None = None

    @property
    def settling(self) -> int:
        """Samples next to a gap or end in which the filters have not settled."""
        return ceil(SETTLED_PERIODS / (self.bandwidth_hz * self.period_s))

    @property
    def motion(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Position, velocity and acceleration, (n, j) each, as the dynamics take them."""
        return self.position_rad, self.velocity_rad_s, self.acceleration_rad_s2

    def column(self, joint: str) -> int:
        """Index of a joint's column."""
        return self.joint_names.index(joint)

    def temperatures_c(self, joint: str) -> tuple[float, float, float] | None:
        """Lowest, mean and highest temperature of a joint, °C; None where the log has none."""
        if self.temperature_c is None:
            return None
        own = self.temperature_c[:, self.column(joint)]
        known = own[np.isfinite(own)]
        return (float(known.min()), float(known.mean()), float(known.max())) if known.size else None


def log_facts(series: UniformSeries) -> LogFacts:
    """What a result says of its log; units are left empty."""
    source = series.source
    start = None
    if source.start_ns is not None and source.start_ns > 0:
        seconds, nanoseconds = divmod(source.start_ns, 1_000_000_000)
        start = f"{datetime.fromtimestamp(seconds, tz=UTC):%Y-%m-%dT%H:%M:%S}.{nanoseconds:09d}Z"
    return LogFacts(
        name=source.name,
        sha256=source.sha256,
        format=source.format,
        start=start,
        duration_s=float(series.time_s[-1] - series.time_s[0]),
        sample_period_s=series.period_s,
        joints=series.joint_names,
        topic=source.topic,
        time_source=source.time_source,
    )


LeftOutKind = Literal["leftover", "archive", "unreadable", "other", "companion"]


@dataclass(frozen=True, slots=True)
class LeftOut:
    """A file, or folder, that was not judged.

    Attributes:
        name: its path or URL.
        kind: ``leftover`` of a recorder or a copy that was cut; ``archive`` that holds logs, or may; ``unreadable``;
            ``other``: any other name; ``companion``: what usually lies beside logs, which is named and never counts.
        not_judged: whether it counts as a log that was not judged.
        text: why it was left out.
    """

    name: str
    kind: LeftOutKind
    not_judged: bool
    text: str
