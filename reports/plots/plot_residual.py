"""One joint over the whole log: its residual, every extreme of every pixel column, and how much of it was judged."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from collaudit.core.data.audit_result import Collision, NearMiss
from collaudit.core.data.signals import State
from collaudit.core.numeric.runs import run_bounds
from collaudit.reports.plots.downsample import column_edges, column_extremes, column_shares
from collaudit.reports.plots.joint_trace import JointTrace
from collaudit.reports.plots.svg import Panel, drawing

_WIDTH, _HEIGHT = 1000, 84
_COLUMNS = 200
_BAR_HEIGHT = 100


def draw_overview(
    trace: JointTrace, alarms: Sequence[Collision], near_misses: Sequence[NearMiss], name: str, label: str
) -> tuple[Markup, float, str | None]:
    """Residual, ±γ, events and what was not judged, without any text.

    Args:
        trace: of the joint, one sample at least.
        alarms, near_misses: of this joint.
        name: id of the drawing, unique in the page.
        label: text for those who cannot see it.

    Returns:
        The drawing, the torque its upper and lower edge stand for, and a note on what these leave out, if anything.
    """
    out = ~(trace.judged | trace.standing)
    kinds = ((out, "curve-out"), (trace.standing, "curve-standing"), (trace.judged, "curve"))
    edges = column_edges(len(trace.time_s), _COLUMNS)
    borders = np.append(trace.time_s, trace.time_s[-1] + trace.period_s)[edges]
    extremes = [column_extremes(trace.residual_nm, mask, edges) for mask, _ in kinds]
    largest = [float(np.nanmax(np.abs(sides), initial=0.0)) for sides in extremes]
    peaks = [a.peak_nm for a in alarms] + [m.peak_nm for m in near_misses]
    height, beyond = _height(trace, peaks, max(largest[1:]), largest[0])
    panel = Panel((0, 0, _WIDTH, _HEIGHT), (min(0.0, trace.time_s[0]), trace.time_s[-1]), (-height, height))
    for mask, kind in ((trace.standing, "shade-standing"), (out, "shade-out")):
        starts, stops = run_bounds(column_shares(mask, edges) >= 0.5)
        panel.shade(borders[starts], borders[stops], kind)
    middle = trace.time_s[(edges[:-1] + edges[1:]) // 2]
    for (low, high), (_, kind) in zip(extremes, kinds, strict=True):
        panel.columns(middle, low, high, kind)
    if np.isfinite(trace.gamma_nm):
        for sign in (-1, 1):
            panel.level(sign * trace.gamma_nm, "gamma")
    for events, kind in ((near_misses, "mark-near"), (alarms, "mark-alarm")):
        panel.moments([event.onset_s for event in events], kind)
    return drawing(_WIDTH, _HEIGHT, label, [panel], name, "plot stretch"), height, beyond


def _height(trace: JointTrace, peaks_nm: Sequence[float], judged: float, largest: float) -> tuple[float, str | None]:
    """What the axis must show: all that was judged, ±γ, every event; the rest when it is not far more.

    Args:
        trace: of the joint.
        peaks_nm: of its events.
        judged, largest: the largest residual that was judged, and that was not.
    """
    wanted = [1.12 * abs(peak) for peak in peaks_nm] + [1.12 * judged]
    wanted += [1.3 * trace.gamma_nm] if np.isfinite(trace.gamma_nm) else []
    height = max(wanted) or 1.12 * largest or 1.0
    if 1.12 * largest <= 2 * height:
        return max(height, 1.12 * largest), None
    out = ~(trace.judged | trace.standing)
    beyond = int(np.count_nonzero(np.abs(trace.residual_nm[out]) > height))
    return height, f"{beyond} samples that were not judged lie outside the axis, the largest at {largest:.4g}"


def coverage_bar(trace: JointTrace, label: str) -> Markup:
    """One joint's time as stacked shares: judged at the bottom, then friction known as a range, not judged, no data.

    Args:
        trace: of the joint.
        label: text for those who cannot see the bar.
    """
    gap, judged, standing = trace.state == State.GAP, trace.judged, trace.standing
    parts = {"judged": judged, "standing": standing, "out": ~(judged | standing | gap), "gap": gap}
    edges = column_edges(len(trace.state), _WIDTH)
    top = np.zeros(len(edges) - 1)
    shapes: list[Markup] = []
    for kind, mask in parts.items():
        share = column_shares(mask, edges)
        top = top + share
        if share.any():
            path = _path(np.rint(_BAR_HEIGHT * top).astype(int))
            shapes.insert(0, Markup('<path class="{}" d="{}"/>').format(kind, path))
    return Markup(
        '<svg class="bar" viewBox="0 0 {} {}" preserveAspectRatio="none" role="img" aria-label="{}">{}</svg>'
    ).format(_WIDTH, _BAR_HEIGHT, label, Markup().join(shapes))


def _path(top: NDArray[np.int_]) -> str:
    """All below a step line, as steps; what is drawn after it covers what is not its own."""
    x = np.rint(np.linspace(0, _WIDTH, len(top) + 1)).astype(int)
    starts = np.concatenate(([0], np.flatnonzero(np.diff(top)) + 1))
    across = np.diff(np.append(x[starts], _WIDTH)).tolist()
    up = np.diff(top[starts], prepend=0).tolist()
    steps = "".join(f"v{-rise}h{run}" for rise, run in zip(up, across, strict=True))
    return f"M0 {_BAR_HEIGHT}{steps}V{_BAR_HEIGHT}z"
