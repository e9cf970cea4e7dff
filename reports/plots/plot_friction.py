"""Friction points of a joint with the fitted curve and its band."""

from __future__ import annotations

import numpy as np
from markupsafe import Markup

from collaudit.core.data.friction_result import FrictionFit
from collaudit.core.friction.friction_model import FrictionModel, half_width
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.stats import NORMAL_QUANTILE_975
from collaudit.reports.plots.svg import Panel, drawing

_WIDTH, _HEIGHT = 240, 126
_SAMPLES = 48


def draw_friction(fit: FrictionFit, torque_unit: str, speed_unit: str, name: str, label: str) -> Markup:
    """Points with 95 % bars, the curve over the measured speeds, and its 95 % band when there is one.

    Args:
        fit: with at least one point.
        torque_unit, speed_unit: from :mod:`collaudit.reports.values.words`.
        name: id of the drawing, unique in the page.
        label: text for those who cannot see it.
    """
    speeds = np.array([point.speed_rad_s for point in fit.points])
    values = np.array([point.friction_nm for point in fit.points])
    errors = np.array([point.se_nm for point in fit.points])
    half = NORMAL_QUANTILE_975 * np.where(np.isfinite(errors), errors, 0.0)
    pairs = np.array([point.source == "pair" for point in fit.points])
    law = FrictionModel.of(fit)
    slowest, fastest = float(speeds.min()), float(speeds.max())
    moving, resting = np.linspace(slowest, fastest, _SAMPLES), np.linspace(0, slowest, 20)
    seen: list[FloatArray] = [values - half, values + half]
    spread = None if law is None else band(fit, moving)
    if law is not None:
        seen += [curve(law, moving), curve(law, resting)]
    low, high = (float(pick([pick(part) for part in seen])) for pick in (np.min, np.max))
    panel = Panel(
        (34, 18, _WIDTH - 42, _HEIGHT - 52), (0.0, 1.05 * fastest), (min(0.0, 1.08 * low), max(0.0, 1.08 * high))
    )
    panel.y_axis(f"friction, {torque_unit}")
    panel.x_axis(f"speed, {speed_unit}", 3)
    if law is not None:
        if spread is not None:
            panel.area(moving, *spread, "band")
        panel.line(moving, curve(law, moving), "curve")
        panel.line(resting, curve(law, resting), "beyond")
    panel.bars(speeds, values - half, values + half, "error-bar")
    panel.dots(speeds[pairs], values[pairs], "dot")
    panel.dots(speeds[~pairs], values[~pairs], "dot")
    panel.dots(speeds[~pairs], values[~pairs], "dot-hole")
    return drawing(_WIDTH, _HEIGHT, label, [panel], name)


def curve(law: FrictionModel, speed: FloatArray) -> FloatArray:
    """Friction in motion at speeds v ≥ 0; at 0 its limit from above."""
    return law.torque(np.maximum(speed, 1e-12))


def band(fit: FrictionFit, speed: FloatArray) -> tuple[FloatArray, FloatArray] | None:
    """Pointwise 95 % band of the curve, to first order in the parameters (delta method).

    Args:
        fit: the fit; its covariance is in the order of its parameters.
        speed: (n,) speeds, positive.

    Returns:
        Lower and upper edge (n,), or None when the fit has no curve or no covariance.
    """
    law = FrictionModel.of(fit)
    if law is None or law.spread is None:
        return None
    half = half_width(law, np.maximum(speed, 1e-12))
    middle = curve(law, speed)
    return middle - half, middle + half
