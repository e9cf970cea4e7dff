"""The wrench on the grid of the joint states."""

from __future__ import annotations

import numpy as np

from collaudit.core.conditioning.lost_samples import SEVERAL, interpolated, picked_rows
from collaudit.core.data.joint_log import WrenchSeries
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.stats import median_of
from collaudit.core.numeric.tables import table


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
    stamps, rows = _ascending(wrench)
    picked = _within(stamps, time_s, recorded, bandwidth_hz)
    whole = isinstance(picked, slice) and picked == slice(0, time_s.size)
    out = known = interpolated(time_s[picked], stamps, rows)
    if not whole:
        out = table(time_s.size, 6)
        out[...] = np.nan
        out[picked] = known
    lost = 0 if np.isfinite(out.sum()) else int(np.count_nonzero(recorded & ~np.isfinite(out.sum(axis=1))))
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


def _within(stamps: FloatArray, time_s: FloatArray, recorded: BoolArray, bandwidth_hz: float) -> IntArray | slice:
    """Recorded samples between stamps (m,) no further apart than 2.5 of their periods, or a short hole."""
    if stamps.size < 2:
        return slice(0, 0)
    steps = np.diff(stamps)
    period = median_of(steps)
    limit = max(2.5 * period, SEVERAL / bandwidth_hz)
    first, last = stamps[0] - 0.5 * period, stamps[-1] + 0.5 * period
    if steps.max() <= limit and recorded.all():
        return slice(int(np.searchsorted(time_s, first, "left")), int(np.searchsorted(time_s, last, "right")))
    right = np.clip(np.searchsorted(stamps, time_s), 1, stamps.size - 1)
    inside = (time_s >= first) & (time_s <= last)
    return picked_rows(np.flatnonzero(inside & (steps[right - 1] <= limit) & recorded))


def _ascending(wrench: WrenchSeries) -> tuple[FloatArray, FloatArray]:
    """Stamps (m,) in ascending order, each once and finite, and their rows (m, 6)."""
    if bool((np.diff(wrench.time_s) > 0).all()) and np.isfinite(wrench.time_s.sum()):
        return wrench.time_s, wrench.wrench
    keep = np.isfinite(wrench.time_s)
    order = np.flatnonzero(keep)[np.argsort(wrench.time_s[keep], kind="stable")]
    stamps = wrench.time_s[order]
    fresh = np.concatenate(([True], np.diff(stamps) > 0)) if stamps.size else np.zeros(0, dtype=bool)
    return stamps[fresh], wrench.wrench[order[fresh]]
