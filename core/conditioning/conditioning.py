"""Conditioning: recorded joint signals onto a uniform time base, with gaps kept as gaps."""

from __future__ import annotations

from collections.abc import Collection
from math import ceil

import numpy as np

from collaudit.core.conditioning.effort_signal import effort_signal_findings, saturation
from collaudit.core.conditioning.stalled_logger import without_stalls
from collaudit.core.conditioning.stuck_signals import without_stuck
from collaudit.core.conditioning.timebase import Timebase, make_timebase
from collaudit.core.conditioning.velocity_choice import choose_velocity
from collaudit.core.conditioning.wrapped_angles import continued_angles
from collaudit.core.config.schema import ConditioningConfig
from collaudit.core.data.joint_log import JointLog, WrenchSeries
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray, frozen
from collaudit.core.numeric.filters import default_bandwidth_hz
from collaudit.core.numeric.parallel import ordered_map


def condition(log: JointLog, config: ConditioningConfig, prismatic: Collection[str] = ()) -> UniformSeries:
    """Put a log onto a uniform time base and differentiate it without delay.

    Position and effort are not filtered here: the detectors' kernels do that. Velocity is low-passed and acceleration
    is its central difference, both zero-phase at ``bandwidth_hz``. Angles are continued over their wraps.

    Args:
        log: as recorded.
        config: filters, gaps and the source of the velocity.
        prismatic: joints whose positions are no angles.

    Raises:
        NotJudgedError: no stretch without a gap is long enough.
    """
    recorded = without_stalls(log)
    log = without_stuck(recorded)
    angles = continued_angles(log, prismatic)
    base = make_timebase(log.time_s, angles.position_rad, config.gap_factor, angles.breaks)
    segments, period = base.grid, base.period_s
    bandwidth = min(config.bandwidth_hz or default_bandwidth_hz(period), 0.4 / period)
    position = _to_grid(angles.position_rad, base)
    heat = None if log.temperature_c is None else _to_grid(log.temperature_c, base)
    logged = None if log.velocity_rad_s is None else _to_grid(log.velocity_rad_s, base)
    effort = None if log.effort is None else _to_grid(log.effort, base)
    motion = choose_velocity(position, logged, segments, period, bandwidth, log.joint_names, config.velocity)
    saturated = np.zeros(position.shape, dtype=bool, order="F") if effort is None else saturation(effort, period)
    findings = [*log.findings, *angles.findings, *base.findings, *motion.findings]
    findings += _missing_findings(recorded, base)
    findings += effort_signal_findings(log, effort, motion.velocity_rad_s, saturated, base.time_s)
    wrench = None
    if log.wrench is not None:
        wrench, more = _wrench_on_grid(log.wrench, base.time_s, segments_mask(base))
        findings += more
    edge = np.ones(base.n, dtype=bool)
    margin = ceil(0.5 / (bandwidth * period))
    for span in segments:
        edge[span.start + margin : max(span.stop - margin, span.start + margin)] = False
    edge.flags.writeable = False
    saturated.flags.writeable = False
    return UniformSeries(
        time_s=frozen(base.time_s),
        period_s=period,
        joint_names=log.joint_names,
        position_rad=frozen(position),
        velocity_rad_s=frozen(motion.velocity_rad_s),
        acceleration_rad_s2=frozen(motion.acceleration_rad_s2),
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
        temperature_c=None if heat is None else frozen(heat),
        annotations=log.annotations,
        phases=log.phases,
    )


def segments_mask(base: Timebase) -> BoolArray:
    """(n,) True where the grid has recorded samples."""
    mask = np.zeros(base.n, dtype=bool)
    for span in base.grid:
        mask[span.slice] = True
    return mask


def _to_grid(values: FloatArray, base: Timebase) -> FloatArray:
    """Bring (m, j) recorded values onto the (n, j) grid; NaN in gaps. Values that lie on it already are not copied."""
    count = values.shape[0]
    if base.n == count and len(base.raw) == 1 and base.snap[0]:
        whole = _picked(base.order)
        if isinstance(whole, slice) and whole == slice(0, count):
            return values
    out = np.full((base.n, values.shape[1]), np.nan, order="F")
    times = base.time_s
    for raw, grid, snap in zip(base.raw, base.grid, base.snap, strict=True):
        rows = values[_picked(base.order[raw.slice])]
        if snap:
            out[grid.slice] = rows
        elif len(grid):
            for j in range(values.shape[1]):
                out[grid.slice, j] = np.interp(times[grid.slice], base.stamps_s[raw.slice], rows[:, j])
    return out


def _picked(order: IntArray) -> IntArray | slice:
    """Indices of consecutive samples as a slice, which copies nothing."""
    first = int(order[0]) if order.size else 0
    whole = order.size and int(order[-1]) == first + order.size - 1 and bool((np.diff(order) == 1).all())
    return slice(first, first + order.size) if whole else order


def _missing_findings(log: JointLog, base: Timebase) -> list[Finding]:
    findings = []
    for name, values in (("position", log.position_rad), ("effort", log.effort)):
        if values is None or np.isfinite(values.sum()):
            continue
        rows = values[base.order]
        for j, joint in enumerate(log.joint_names):
            bad = int(np.count_nonzero(~np.isfinite(rows[:, j])))
            if bad:
                findings.append(
                    Finding(
                        "log-nan",
                        "warning",
                        f"{bad} of {rows.shape[0]} {name} values of joint '{joint}' are missing or not a number.",
                        joint=joint,
                    )
                )
    return findings


def _wrench_on_grid(wrench: WrenchSeries, time_s: FloatArray, recorded: BoolArray) -> tuple[FloatArray, list[Finding]]:
    """Interpolate a wrench to the grid, never across a step longer than 2.5 of its own periods."""
    stamps, rows = _ascending(wrench)
    out = np.empty((time_s.size, 6), order="F")
    picked = _within(stamps, time_s, recorded)
    whole = isinstance(picked, slice) and picked == slice(0, time_s.size)

    def one(c: int) -> bool:
        if not whole:
            out[:, c] = np.nan
        if stamps.size >= 2:
            out[picked, c] = np.interp(time_s[picked], stamps, rows[:, c])
        return bool(np.isfinite(out[:, c].sum()))

    known = list(ordered_map(one, range(6)))
    lost = 0 if all(known) else int(np.count_nonzero(recorded & ~np.isfinite(out.sum(axis=1))))
    findings = []
    if lost:
        findings.append(
            Finding(
                "log-wrench-partial",
                "warning",
                f"The wrench is missing in {lost} of {np.count_nonzero(recorded)} samples; they are not judged.",
                where=wrench.topic,
            )
        )
    return out, findings


def _within(stamps: FloatArray, time_s: FloatArray, recorded: BoolArray) -> IntArray | slice:
    """Recorded samples between stamps (m,) that are no further apart than 2.5 of their periods."""
    if stamps.size < 2:
        return slice(0, 0)
    steps = np.diff(stamps)
    period = float(np.median(steps))
    first, last = stamps[0] - 0.5 * period, stamps[-1] + 0.5 * period
    if steps.max() <= 2.5 * period and recorded.all():
        return slice(int(np.searchsorted(time_s, first, "left")), int(np.searchsorted(time_s, last, "right")))
    right = np.clip(np.searchsorted(stamps, time_s), 1, stamps.size - 1)
    inside = (time_s >= first) & (time_s <= last)
    return _picked(np.flatnonzero(inside & (steps[right - 1] <= 2.5 * period) & recorded))


def _ascending(wrench: WrenchSeries) -> tuple[FloatArray, FloatArray]:
    """Stamps (m,) in ascending order, each once and finite, and their rows (m, 6)."""
    if bool((np.diff(wrench.time_s) > 0).all()) and np.isfinite(wrench.time_s.sum()):
        return wrench.time_s, wrench.wrench
    keep = np.isfinite(wrench.time_s)
    order = np.flatnonzero(keep)[np.argsort(wrench.time_s[keep], kind="stable")]
    stamps = wrench.time_s[order]
    fresh = np.concatenate(([True], np.diff(stamps) > 0)) if stamps.size else np.zeros(0, dtype=bool)
    return stamps[fresh], wrench.wrench[order[fresh]]
