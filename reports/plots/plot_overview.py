"""One joint's residual over the whole log."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes

from collaudit.core.data.audit_result import AuditResult, Collision, NearMiss
from collaudit.core.data.signals import Signals
from collaudit.reports.plots.plot_residual import (
    Trace,
    draw_residual,
    draw_shading,
    draw_threshold,
    set_height,
    trace,
)
from collaudit.reports.plots.svg import LIMIT, NEAR, drawing, figure, inline, quiet_axis

_POINTS = 2000


def draw_overview(
    result: AuditResult, signals: Signals, joint: str, unit: str, name: str, label: str
) -> tuple[Markup, str | None]:
    """Residual, ±γ, events and what was not judged, over the whole log.

    Args:
        result: the audit's result.
        signals: its signals.
        joint: one of ``signals``.
        unit: of the joint's torque, from :func:`collaudit.reports.values.words.torque_unit`.
        name: id of the plot, unique in the page.
        label: text for those who cannot see the plot.

    Returns:
        The drawing, and a note on what its axis leaves out, if anything.
    """
    column = signals.joint_names.index(joint)
    gamma = float(signals.gamma_nm[column])
    shown = trace(signals, column)
    collisions = [event for event in result.collisions if event.joint == joint]
    near_misses = [event for event in result.near_misses if event.joint == joint]
    with drawing(name):
        made = figure(10.4, 1.65)
        axes = made.add_axes((0.058, 0.245, 0.936, 0.715))
        draw_shading(axes, shown)
        draw_threshold(axes, gamma)
        draw_residual(axes, shown, _POINTS)
        peaks = (*(c.peak_nm for c in collisions), *(m.peak_nm for m in near_misses))
        note = set_height(axes, shown, gamma, peaks)
        _mark(axes, shown, near_misses, "D", NEAR, "white", 20)
        _mark(axes, shown, collisions, "v", LIMIT, LIMIT, 34)
        if len(shown.time_s) > 1:
            axes.set_xlim(0.0 if shown.time_s[0] >= 0 else shown.time_s[0], shown.time_s[-1])
        axes.set_ylabel(f"residual, {unit}")
        axes.set_xlabel("time, s", labelpad=1.5)
        axes.locator_params(axis="y", nbins=5)
        quiet_axis(axes)
        return inline(made, name, label), note


def _mark(
    axes: Axes, shown: Trace, events: Sequence[Collision | NearMiss], shape: str, edge: str, face: str, size: float
) -> None:
    """A mark at the peak of each event."""
    if events:
        times = np.array([_peak_time(shown, event) for event in events])
        peaks = np.array([event.peak_nm for event in events])
        axes.scatter(times, peaks, s=size, marker=shape, facecolor=face, edgecolor=edge, linewidth=1.1, zorder=5)


def _peak_time(shown: Trace, event: Collision | NearMiss) -> float:
    """When the residual comes closest to the event's peak; its onset where the signals do not tell."""
    start = int(np.searchsorted(shown.time_s, event.onset_s - shown.period_s / 2))
    stop = int(np.searchsorted(shown.time_s, event.onset_s + event.duration_s + shown.period_s / 2))
    away = np.abs(shown.residual_nm[start:stop] - event.peak_nm)
    if not np.isfinite(away).any():
        return event.onset_s
    return float(shown.time_s[start + int(np.nanargmin(away))])
