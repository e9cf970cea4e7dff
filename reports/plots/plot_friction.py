"""Friction points of a joint with the fitted curve and its band."""

from __future__ import annotations

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes

from collaudit.core.data.friction_result import FrictionFit, FrictionPoint
from collaudit.core.friction.friction_model import FrictionModel
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.stats import NORMAL_QUANTILE_975
from collaudit.reports.plots.friction_band import band, curve
from collaudit.reports.plots.svg import CURVE, INK, drawing, figure, inline, quiet_axis

_SAMPLES = 200


def draw_friction(fit: FrictionFit, torque_unit: str, speed_unit: str, name: str, label: str) -> Markup:
    """Points with 95 % bars, the curve over the measured speeds, and its 95 % band when there is one.

    Args:
        fit: with at least one point.
        torque_unit, speed_unit: from :mod:`collaudit.reports.values.words`.
        name: id of the plot, unique in the page.
        label: text for those who cannot see the plot.
    """
    with drawing(name):
        made = figure(4.6, 2.75)
        axes = made.add_axes((0.115, 0.165, 0.865, 0.805))
        fastest = max(point.speed_rad_s for point in fit.points)
        slowest = min(point.speed_rad_s for point in fit.points)
        law = FrictionModel.of(fit)
        if law is not None:
            _draw_curve(axes, fit, law, slowest, fastest)
        for source, shape, face in (("pair", "o", CURVE), ("model", "s", "white")):
            _draw_points(axes, [p for p in fit.points if p.source == source], shape, face)
        axes.set_xlim(0, 1.05 * fastest)
        low, high = axes.get_ylim()
        axes.set_ylim(min(0.0, low), max(0.0, high))
        axes.set_xlabel(f"speed, {speed_unit}")
        axes.set_ylabel(f"friction, {torque_unit}")
        quiet_axis(axes)
        return inline(made, name, label)


def _draw_curve(axes: Axes, fit: FrictionFit, law: FrictionModel, slowest: float, fastest: float) -> None:
    """Solid where speeds were measured, dotted below the slowest."""
    speed = np.linspace(slowest, fastest, _SAMPLES)
    below = np.linspace(0, slowest, 40)
    spread = band(fit, speed)
    if spread is not None:
        axes.fill_between(speed, *spread, facecolor="#c9dcee", edgecolor="none")
    axes.plot(speed, curve(law, speed), color=CURVE, linewidth=1.4)
    axes.plot(below, curve(law, below), color=CURVE, linewidth=1.0, linestyle=(0, (1, 2)))


def _draw_points(axes: Axes, points: list[FrictionPoint], shape: str, face: str) -> None:
    if not points:
        return
    half: FloatArray = np.array([NORMAL_QUANTILE_975 * p.se_nm if np.isfinite(p.se_nm) else 0.0 for p in points])
    axes.errorbar(
        [p.speed_rad_s for p in points],
        [p.friction_nm for p in points],
        yerr=half,
        fmt=shape,
        markersize=4.5,
        markerfacecolor=face,
        markeredgecolor=INK,
        markeredgewidth=0.8,
        ecolor=INK,
        elinewidth=0.8,
        capsize=2,
    )
