"""One joint's residual against its speed and against its position: what friction and model have not explained."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes

from collaudit.core.data.signals import Signals, State
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.reports.plots.svg import CURVE, INK, MUTED, drawing, figure, inline, quiet_axis

_COLUMNS = 160
_LEAST = 5  # samples a column's spread is read from


def draw_against(signals: Signals, joint: str, unit: str, prismatic: bool, name: str, label: str) -> Markup | None:
    """Median, middle 90 % and extremes of the judged residual in columns of speed and of position.

    Args:
        signals: of the audit.
        joint: one of them.
        unit: of the joint's torque.
        prismatic: whether it slides: m in place of rad.
        name: id of the plot, unique in the page.
        label: text for those who cannot see the plot.

    Returns:
        The drawing, or None where nothing was judged.
    """
    k = signals.joint_names.index(joint)
    residual = signals.residual_nm[:, k]
    judged = np.asarray((signals.state[:, k] == State.JUDGED) & np.isfinite(residual))
    if np.count_nonzero(judged) < 10 * _LEAST:
        return None
    length = "m" if prismatic else "rad"
    with drawing(name):
        made = figure(10.4, 2.1)
        left = made.add_axes((0.058, 0.2, 0.44, 0.76))
        right = made.add_axes((0.548, 0.2, 0.446, 0.76))
        _columns(left, signals.velocity_rad_s[:, k], residual, judged)
        left.set_xlabel(f"speed, {length}/s", labelpad=1.5)
        left.set_ylabel(f"residual, {unit}")
        _columns(right, signals.position_rad[:, k], residual, judged)
        right.set_xlabel(f"position, {length}", labelpad=1.5)
        low, high = left.get_ylim()
        right.set_ylim(low, high)
        right.set_yticklabels([])
        return inline(made, name, label)


def _columns(axes: Axes, x: FloatArray, residual: FloatArray, judged: BoolArray) -> None:
    """Extremes in grey, 5 to 95 % in blue, the median as a line; nothing beyond the extremes exists."""
    x, y = x[judged].astype(np.float32).astype(np.float64), residual[judged]  # as a run's file keeps them
    edges = np.linspace(float(x.min()), float(x.max()) + 1e-12, _COLUMNS + 1)
    order = np.argsort(x, kind="stable")
    x, y = x[order], y[order]
    bounds = np.searchsorted(x, edges)
    at, spread = [], []
    for a, b in pairwise(bounds):
        if b - a >= _LEAST:
            at.append(float(x[a:b].mean()))
            spread.append(np.quantile(y[a:b], [0.0, 0.05, 0.5, 0.95, 1.0]))
        elif b > a:
            at.append(float(x[a:b].mean()))
            spread.append(np.array([y[a:b].min(), np.nan, np.nan, np.nan, y[a:b].max()]))
        elif at and np.isfinite(at[-1]):  # no line across what was never visited
            at.append(np.nan)
            spread.append(np.full(5, np.nan))
    place, part = np.array(at), np.array(spread)
    axes.vlines(place, part[:, 0], part[:, 4], color=MUTED, linewidth=0.7, alpha=0.6)
    axes.vlines(place, part[:, 1], part[:, 3], color=CURVE, linewidth=1.5, alpha=0.55)
    axes.plot(place, part[:, 2], color=INK, linewidth=0.9)
    axes.axhline(0.0, color=INK, linewidth=0.5)
    quiet_axis(axes)
