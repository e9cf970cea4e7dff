"""Conditioning: recorded joint signals onto a uniform time base, with gaps kept as gaps."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from math import ceil

import numpy as np

from collaudit.core.conditioning.position_jumps import continued_angles, missing_rows
from collaudit.core.conditioning.stamp_order import (
    duplicate_findings,
    interpolated,
    lost_ends_s,
    missing_findings,
    picked_rows,
    positions_known,
    usable_order,
    with_positions,
    without_contradictions,
)
from collaudit.core.conditioning.timebase import SEVERAL, Timebase, filled, make_timebase
from collaudit.core.conditioning.unmeasured import effort_signal_findings, saturation, without_unmeasured
from collaudit.core.conditioning.velocity_choice import choose_velocity
from collaudit.core.config.schema import ConditioningConfig, DetectConfig
from collaudit.core.data.joint_log import SETTLED_PERIODS, JointLog, LoneRows, UniformSeries, WrenchSeries
from collaudit.core.findings import Finding
from collaudit.core.logs.signals.stamp_conflicts import contradictions
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray, Span, covered, frozen
from collaudit.core.numeric.filters import default_bandwidth_hz, differentiate
from collaudit.core.numeric.stats import median_of

#: A step of the clock is longer than so many sample periods, and than so many seconds.
_PERIODS, _LEAST_S = 20, 0.5
#: Samples on either side that tell the speed; the arm moves by so much in each, rad (m if prismatic).
_SIDE, _MOVES_RAD = 5, 2e-5
#: Share of a usual step by which the step of the positions differs at most.
_ALIKE = 0.5
_MOST = 20
_HOUR_S = 3600.0


def clock_step_findings(time_s: FloatArray, position: FloatArray) -> list[Finding]:
    """Steps of the stamps, forward or back, at which a moving arm goes on by one sample's way.

    Args:
        time_s: (n,) stamps in the order of recording, s.
        position: (n, j) at them, rad (m if prismatic).
    """
    steps = np.diff(time_s)
    known = np.isfinite(steps)
    if not known.any():
        return []
    limit = max(_PERIODS * median_of(np.abs(steps[known])), _LEAST_S)
    findings = []
    with np.errstate(invalid="ignore"):
        places = np.flatnonzero(np.abs(steps) > limit)
    for k in places[(places >= _SIDE) & (places + 1 + _SIDE < time_s.size)][:_MOST].tolist():
        usual = (position[k] - position[k - _SIDE] + position[k + 1 + _SIDE] - position[k + 1]) / (2 * _SIDE)
        off = np.abs(position[k + 1] - position[k] - usual)
        size = float(np.nanmax(np.abs(usual), initial=0.0))
        if size > _MOVES_RAD and float(np.nanmax(off, initial=0.0)) <= _ALIKE * size:
            at_s, by_s = float(time_s[k]), float(steps[k])
            hours = round(by_s / _HOUR_S)
            shifted = 0 < abs(hours) < 24 and abs(by_s - hours * _HOUR_S) < 1.0
            cause = "as daylight saving or another time zone does" if shifted else "as NTP does"
            text = (
                f"The clock was set {'forward' if by_s > 0 else 'back'} by {abs(by_s):.7g} s at {at_s:.4g} s, {cause}: "
                "the arm goes on from sample to sample as if no time had passed. That time stands as a gap; no samples "
                "were lost in it."
            )
            findings.append(Finding("time-gap" if by_s > 0 else "log-clock", "warning", text, start_s=at_s))
    return findings


_RULE = DetectConfig()
#: A wrench with this share of its stamps from the joint states was stamped with them.
_SHARED = 0.9


def condition(
    log: JointLog, config: ConditioningConfig, prismatic: Collection[str] = (), detect: DetectConfig = _RULE
) -> UniformSeries:
    """Put a log onto a uniform time base and differentiate it without delay.

    Position and effort are not filtered here: the detectors' kernels do that. Velocity is low-passed and acceleration
    is its central difference, both zero-phase at ``bandwidth_hz``. Angles are continued over their wraps.

    Args:
        log: as recorded.
        config: filters, gaps and the source of the velocity.
        prismatic: joints whose positions are no angles.
        detect: the rule; what is shorter than its persistence hides no contact.

    Raises:
        NotJudgedError: no stretch without a gap is long enough.
    """
    ends_s, missing, whole = lost_ends_s(log), missing_findings(log), log
    recorded = without_contradictions(with_positions(log))
    log = without_unmeasured(recorded, detect)
    ends_s += lost_ends_s(log)  # frozen positions count as missing
    moved = positions_known(log)
    if not moved.all():
        recorded, log = recorded.samples(moved), log.samples(moved)
    angles = continued_angles(log, prismatic)
    cut, about_cuts = missing_rows(log, angles.position_rad, angles.breaks, detect)
    base = make_timebase(
        log.time_s,
        angles.position_rad,
        cut,
        log.velocity_rad_s,
        lambda period: _bandwidth_hz(config, period),
    )
    segments, period = base.grid, base.period_s
    bandwidth = _bandwidth_hz(config, period)
    position = _to_grid(angles.position_rad, base, smooth=True)
    heat = None if log.temperature_c is None else _to_grid(log.temperature_c, base)
    sensed = None if log.joint_torque_nm is None else _to_grid(log.joint_torque_nm, base)
    logged = None if log.velocity_rad_s is None else _to_grid(log.velocity_rad_s, base)
    effort = None if log.effort is None else _to_grid(log.effort, base)
    motion = choose_velocity(position, logged, segments, period, bandwidth, log.joint_names, config.velocity)
    saturated = np.zeros(position.shape, dtype=bool) if effort is None else saturation(effort, period)
    conflicts = contradictions(recorded.time_s, recorded.joint_names, recorded.position_rad, recorded.effort)
    findings = [*log.findings, *conflicts, *angles.findings, *about_cuts, *base.findings, *motion.findings]
    findings += duplicate_findings(recorded, base.order)
    findings += clock_step_findings(recorded.time_s, angles.position_rad)
    findings += missing
    findings += effort_signal_findings(log, effort, motion.velocity_rad_s, saturated, base.time_s)
    wrench = None
    if log.wrench is not None:
        recorded_rows = covered(segments, base.n)
        wrench, more = wrench_on_grid(_on_clock(log.wrench, log, base), base.time_s, recorded_rows, bandwidth)
        findings += more
    margin = ceil(SETTLED_PERIODS / (bandwidth * period))
    inner = (Span(span.start + margin, max(span.stop - margin, span.start + margin)) for span in segments)
    edge = ~covered(inner, base.n)
    edge.flags.writeable = base.bridged.flags.writeable = False
    saturated.flags.writeable = False
    velocity = frozen(motion.velocity_rad_s)
    return UniformSeries(
        time_s=frozen(base.time_s),
        period_s=period,
        joint_names=log.joint_names,
        position_rad=frozen(position),
        velocity_rad_s=velocity,
        acceleration_rad_s2=frozen(differentiate(velocity, segments, period)),
        effort=None if effort is None else frozen(effort),
        effort_unit=log.effort_unit,
        wrench=None if wrench is None else frozen(wrench),
        segments=segments,
        edge=edge,
        saturated=saturated,
        bandwidth_hz=bandwidth,
        source=log.source,
        findings=tuple(findings),
        raw_velocity_rad_s=frozen(motion.raw_rad_s),
        velocity_lag_s=motion.lag_s,
        off_grid_s=base.skipped_s[-1] + ends_s,
        temperature_c=None if heat is None else frozen(heat),
        annotations=log.annotations,
        phases=log.phases,
        bridged=base.bridged,
        couplings=log.couplings,
        joint_torque_nm=None if sensed is None else frozen(sensed),
        lone=_lone(whole, base),
    )


def _bandwidth_hz(config: ConditioningConfig, period_s: float) -> float:
    """Of the filters: as configured, 20 Hz, or less where the sample rate allows no more."""
    return min(config.bandwidth_hz or default_bandwidth_hz(period_s), 0.4 / period_s)


def _to_grid(values: FloatArray, base: Timebase, smooth: bool = False) -> FloatArray:
    """Bring (m, j) recorded values onto the (n, j) grid; NaN in gaps. Values that lie on it already are not copied.

    ``smooth`` values are differentiated later: what was lost of them is bridged by cubics.
    """
    count = values.shape[0]
    if base.n == count and len(base.raw) == 1 and base.snap[0]:
        whole = picked_rows(base.order)
        if isinstance(whole, slice) and whole == slice(0, count):
            return values
    out = np.full((base.n, values.shape[1]), np.nan, order="F")
    times = base.time_s
    for raw, grid, snap in zip(base.raw, base.grid, base.snap, strict=True):
        rows = values[picked_rows(base.order[raw.slice])]
        if snap and len(raw) == len(grid):
            out[grid.slice] = rows
        elif snap:
            out[grid.slice] = filled(rows, base.places[raw.slice], len(grid), smooth)
        elif len(grid):
            out[grid.slice] = interpolated(times[grid.slice], base.stamps_s[raw.slice], rows)
    return out


def _on_clock(wrench: WrenchSeries, log: JointLog, base: Timebase) -> WrenchSeries:
    """The wrench on the rebuilt clock, where it came with the stamps of the joint states."""
    recorded = log.time_s[base.order]
    if np.array_equal(recorded, base.stamps_s) or not wrench.time_s.size:
        return wrench
    at = np.minimum(np.searchsorted(recorded, wrench.time_s), recorded.size - 1)
    shared = recorded[at] == wrench.time_s
    return (
        replace(wrench, time_s=base.stamps_s[at][shared], wrench=wrench.wrench[shared])
        if shared.mean() > _SHARED
        else wrench
    )


def _continued(time_s: FloatArray, position: FloatArray, velocity: FloatArray) -> FloatArray:
    """(m, j) positions; a missing one is the way that the velocity makes between the known ones beside it."""
    way = np.zeros_like(position)
    steps = 0.5 * (velocity[1:] + velocity[:-1]) * np.diff(time_s)[:, None]
    np.cumsum(np.nan_to_num(steps), axis=0, out=way[1:])
    out = position.copy()
    for j in range(position.shape[1]):
        known = np.isfinite(position[:, j])
        if known.any() and not known.all():
            lost = ~known
            off = np.interp(time_s[lost], time_s[known], (position - way)[known, j])
            out[lost, j] = way[lost, j] + off
    return out


def _lone(log: JointLog, base: Timebase) -> LoneRows | None:
    """Rows of the log as recorded that lie in gaps of the grid; a missing position follows from logged velocity."""
    gap = ~covered(base.grid, base.n)
    if log.effort is None or not gap.any():
        return None
    times = base.time_s
    right = np.clip(np.searchsorted(times, log.time_s), 1, times.size - 1)
    place = right - (log.time_s - times[right - 1] < times[right] - log.time_s)
    alone = gap[place] & (np.abs(times[place] - log.time_s) < base.period_s)
    with np.errstate(invalid="ignore", divide="ignore"):
        step_s, position, velocity = np.diff(log.time_s)[:, None], log.position_rad, log.velocity_rad_s
        if velocity is None:
            velocity = np.gradient(position, log.time_s, axis=0)
        else:
            position = _continued(log.time_s, position, velocity)
        slope = np.pad(np.diff(velocity, axis=0) / step_s, ((1, 1), (0, 0)), mode="edge")
    slopes = np.stack([slope[:-1][alone], slope[1:][alone]])
    return LoneRows(place[alone], *map(frozen, (log.effort[alone], position[alone], velocity[alone], slopes)))


def wrench_on_grid(
    wrench: WrenchSeries, time_s: FloatArray, recorded: BoolArray, bandwidth_hz: float
) -> tuple[FloatArray, list[Finding]]:
    """Interpolate a wrench to the grid, never across a hole that is long against the filter.

    Args:
        wrench: as recorded.
        time_s: (n,) of the grid; recorded: (n,) where joint states were recorded.
        bandwidth_hz: of the filters.

    Returns:
        (n, 6), NaN where it is not known, and what is to be said about that.
    """
    order = usable_order(wrench.time_s)
    stamps, rows = wrench.time_s, wrench.wrench
    if not np.array_equal(order, np.arange(stamps.size)):  # else no table beside the recorded one
        stamps, rows = stamps[order], rows[order]
    picked = _within(stamps, time_s, recorded, bandwidth_hz)
    out = known = interpolated(time_s[picked], stamps, rows)
    if out.shape[0] != time_s.size:
        out = np.full((time_s.size, 6), np.nan, order="F")
        out[picked] = known
    lost = 0 if np.isfinite(out.sum()) else int(np.count_nonzero(recorded & ~np.isfinite(out.sum(axis=1))))
    findings = []
    if lost:
        findings.append(
            Finding(
                "log-wrench",
                "warning",
                f"The wrench is missing in {lost} of {np.count_nonzero(recorded)} samples; they are not judged.",
                where=wrench.topic,
            )
        )
    return out, findings


def _within(stamps: FloatArray, time_s: FloatArray, recorded: BoolArray, bandwidth_hz: float) -> IntArray | slice:
    """Recorded samples between stamps (m,) no further apart than 2.5 of their periods, or a short hole."""
    if stamps.size < 2:
        return slice(0, 0)
    steps = np.diff(stamps)
    period = median_of(steps)
    limit = max(2.5 * period, SEVERAL / bandwidth_hz)
    first, last = stamps[0] - 0.5 * period, stamps[-1] + 0.5 * period
    right = np.clip(np.searchsorted(stamps, time_s), 1, stamps.size - 1)
    inside = (time_s >= first) & (time_s <= last)
    return picked_rows(np.flatnonzero(inside & (steps[right - 1] <= limit) & recorded))
