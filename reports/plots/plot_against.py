"""One joint's residual against its speed and against its position: what friction and model have not explained."""

from __future__ import annotations

import numpy as np
from markupsafe import Markup

from collaudit.core.data.signals import State
from collaudit.core.numeric.arrays import FloatArray
from collaudit.reports.plots.joint_trace import JointTrace
from collaudit.reports.plots.svg import Panel, drawing

_COLUMNS = 24
_LEAST = 5  # samples a column's spread is read from
_MOST = 50_000
_SHARES = (0.0, 0.05, 0.5, 0.95, 1.0)
_WIDTH, _HEIGHT = 780, 150


def draw_against(trace: JointTrace, unit: str, prismatic: bool, name: str, label: str) -> Markup | None:
    """Median, middle 90 % and extremes of the judged residual in columns of speed and of position.

    Of a long log fifty thousand samples, evenly spread, stand for all.

    Args:
        trace: of the joint.
        unit: of its torque.
        prismatic: whether it slides: m in place of rad.
        name: id of the drawing, unique in the page.
        label: text for those who cannot see it.

    Returns:
        The drawing, or None where nothing was judged.
    """
    rows = np.arange(0, len(trace.time_s), max(1, len(trace.time_s) // _MOST))
    signals = (trace.residual_nm, trace.velocity_rad_s, trace.position_rad)
    known = trace.state[rows] == State.JUDGED
    for signal in signals:
        known &= np.isfinite(signal[rows])
    rows = rows[known]
    if rows.size < 10 * _LEAST:
        return None
    residual, length = trace.residual_nm[rows], "m" if prismatic else "rad"
    limit = (min(0.0, 1.05 * float(residual.min())), max(0.0, 1.05 * float(residual.max())))
    panels = []
    for left, x, words in (
        (46, trace.velocity_rad_s, f"speed, {length}/s"),
        (426, trace.position_rad, f"position, {length}"),
    ):
        values = x[rows].astype(np.float64)
        panel = Panel((left, 18, 346, _HEIGHT - 52), (float(values.min()), float(values.max())), limit)
        panel.y_axis(f"residual, {unit}")
        panel.x_axis(words, 5)
        panel.level(0.0, "zero")
        _columns(panel, values, residual)
        panels.append(panel)
    return drawing(_WIDTH, _HEIGHT, label, panels, name)


def _columns(panel: Panel, x: FloatArray, residual: FloatArray) -> None:
    """Extremes, 5 to 95 % and the median; nothing is drawn across what was never visited."""
    edges = np.linspace(float(x.min()), float(x.max()) + 1e-12, _COLUMNS + 1)
    column = np.minimum(np.searchsorted(edges, x, side="right") - 1, _COLUMNS - 1)
    part = np.full((_COLUMNS, 5), np.nan)
    for k in range(_COLUMNS):
        inside = residual[column == k]
        if inside.size:
            part[k] = np.quantile(inside, _SHARES, method="nearest")
        if inside.size < _LEAST:
            part[k, 1:4] = np.nan
    at = (edges[:-1] + edges[1:]) / 2
    panel.columns(at, part[:, 0], part[:, 4], "curve-out")
    panel.columns(at, part[:, 1], part[:, 3], "middle")
    panel.line(at, part[:, 2], "measured")
