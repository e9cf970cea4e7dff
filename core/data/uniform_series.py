"""A log on its uniform time base: what conditioning makes of it."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime
from math import ceil

import numpy as np

from collaudit.core.data.audit_result import LogFacts
from collaudit.core.data.identification_result import Coupling
from collaudit.core.data.joint_log import Annotation, EffortUnit, LogSource
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray, Span
from collaudit.core.numeric.filters import SETTLED_PERIODS

#: A joint moves when it is faster than this, rad/s (m/s of a prismatic joint): slower, noise decides on the direction,
#: friction is not that of sliding, and the same position twice is no surprise.
MOVING_RAD_S = 0.02
#: Less than any channel resolves, in any unit of an effort: values that differ by less are memory that nobody filled.
LEAST_EFFORT_CHANGE = 1e-12


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
