"""A close look at one collision or near miss."""

from __future__ import annotations

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes

from collaudit.core.data.audit_result import Collision, NearMiss, RuleFacts
from collaudit.core.data.signals import Signals
from collaudit.reports.plots.downsample import thin
from collaudit.reports.plots.plot_residual import draw_residual, draw_shading, draw_threshold, set_height, trace
from collaudit.reports.plots.svg import INK, LIMIT, MODEL, ONSET, drawing, figure, inline, quiet_axis

_POINTS = 1400
_LEAST_MARGIN_S = 0.25
_LEAST_MARGIN_SAMPLES = 25


def draw_event(
    signals: Signals, rule: RuleFacts, event: Collision | NearMiss, unit: str, name: str, label: str
) -> tuple[Markup, str | None]:
    """Residual ± γ around an event, and below it the measured and the modelled torque.

    Args:
        signals: of the whole log.
        rule: as applied.
        event: the event; its joint is one of ``signals``.
        unit: of the joint's torque, from :func:`collaudit.reports.values.words.torque_unit`.
        name: id of the plot, unique in the page.
        label: text for those who cannot see the plot.

    Returns:
        The drawing, and a note on what its axis leaves out, if anything.
    """
    column = signals.joint_names.index(event.joint)
    window = _window(signals, event)
    shown = trace(signals, column, window)
    with drawing(name):
        made = figure(5.3, 3.05)
        upper = made.add_axes((0.105, 0.44, 0.875, 0.49))
        lower = made.add_axes((0.105, 0.135, 0.875, 0.265), sharex=upper)
        draw_shading(upper, shown)
        draw_threshold(upper, event.gamma_nm, _near_share(event, rule))
        draw_residual(upper, shown, _POINTS)
        _mark_times(upper, event)
        note = set_height(upper, shown, event.gamma_nm, (event.peak_nm,))
        upper.set_ylabel(f"residual, {unit}")
        upper.tick_params(labelbottom=False)
        _draw_torques(lower, signals, column, window, unit)
        if len(shown.time_s) > 1:
            upper.set_xlim(shown.time_s[0], shown.time_s[-1])
        for axes in (upper, lower):
            quiet_axis(axes)
        return inline(made, name, label), note


def _window(signals: Signals, event: Collision | NearMiss) -> slice:
    """Samples around the event: at least 0.25 s or 25 samples, or its own length, on either side."""
    time_s = signals.time_s
    period = float(time_s[1] - time_s[0]) if len(time_s) > 1 else 1.0
    margin = max(_LEAST_MARGIN_S, _LEAST_MARGIN_SAMPLES * period, event.duration_s)
    start = int(np.searchsorted(time_s, event.onset_s - margin))
    stop = int(np.searchsorted(time_s, event.onset_s + event.duration_s + margin, side="right"))
    start = min(start, max(0, len(time_s) - 2))
    return slice(start, max(stop, start + 2))


def _near_share(event: Collision | NearMiss, rule: RuleFacts) -> float | None:
    """The near-miss level is drawn where it is what was exceeded."""
    if isinstance(event, NearMiss) and event.kind == "amplitude":
        return rule.near_miss_amplitude
    return None


def _mark_times(axes: Axes, event: Collision | NearMiss) -> None:
    second = (
        (event.detected_s, "detected", LIMIT)
        if isinstance(event, Collision)
        else (event.onset_s + event.duration_s, "end", ONSET)
    )
    for (time_s, text, colour), side in (((event.onset_s, "onset", ONSET), "right"), (second, "left")):
        axes.axvline(time_s, color=colour, linewidth=1.0, linestyle="-" if side == "right" else (0, (6, 1.5)))
        axes.annotate(
            text,
            (time_s, 1.0),
            xycoords=("data", "axes fraction"),
            xytext=(-3 if side == "right" else 3, 2),
            textcoords="offset points",
            ha=side,
            va="bottom",
            color=colour,
            fontsize=8.5,
        )


def _draw_torques(axes: Axes, signals: Signals, column: int, window: slice, unit: str) -> None:
    """Measured and modelled torque, in the 7 digits that ``signals.parquet`` keeps of them."""
    for values, colour, style in (
        (signals.measured_nm, INK, "-"),
        (signals.model_nm, MODEL, (0, (4, 1.5))),
    ):
        kept = values[window, column].astype(np.float32).astype(np.float64)
        time_s, curve = thin(signals.time_s[window], kept, _POINTS)
        axes.plot(time_s, curve, color=colour, linestyle=style, linewidth=0.9)
    axes.set_ylabel(f"torque, {unit}")
    axes.set_xlabel("time, s")
    axes.locator_params(axis="y", nbins=4)
