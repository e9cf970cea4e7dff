"""A close look at one contact: all joints on one time axis, the joint that stands out, the wrist sensor."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from markupsafe import Markup

from collaudit.core.data.detection_result import Contact
from collaudit.core.data.signals import State
from collaudit.core.numeric.arrays import FloatArray, IntArray
from collaudit.reports.plots.joint_trace import JointTrace, thin
from collaudit.reports.plots.svg import Panel, drawing
from collaudit.reports.values.first_words import contact_limits

_WIDTH = 560
_LEFT, _RIGHT = 46, 8
_POINTS = 40
_OTHER_POINTS = 12


def contact_window(trace: JointTrace, contact: Contact) -> JointTrace | None:
    """One joint around one contact; None where there are not two samples of it."""
    start, stop = contact_limits(contact, trace.period_s)
    a, b = (int(k) for k in np.searchsorted(trace.time_s, [start, stop]))
    a = min(a, max(0, len(trace.time_s) - 2))
    window = trace.part(a, max(b, a + 2))
    return window if len(window.time_s) > 1 else None


def model_range(trace: JointTrace, part: slice | IntArray) -> tuple[FloatArray, FloatArray]:
    """Least and greatest modelled torque: a value in motion, a range where friction is an interval."""
    measured, residual = trace.measured_nm[part].astype(np.float64), trace.residual_nm[part]
    if trace.least_nm is None or trace.most_nm is None:
        value = np.where(trace.state[part] == State.FRICTION_INTERVAL, np.nan, measured - residual)
        return value, value
    open_ = np.isfinite(trace.least_nm[part])
    least = np.where(open_, measured - trace.most_nm[part], measured - residual)
    return least, np.where(open_, measured - trace.least_nm[part], measured - residual)


def draw_contact(
    windows: Sequence[JointTrace],
    contact: Contact,
    worst: str,
    unit: str,
    force: tuple[FloatArray, FloatArray] | None,
    name: str,
    label: str,
) -> Markup:
    """Residual over γ of every joint, measured and modelled torque of one, and the tool's force.

    Args:
        windows: of the joints, as :func:`contact_window` cuts them.
        contact: the contact.
        worst: joint whose torque is drawn.
        unit: of its torque.
        force: time and size (k,) of the force at the wrist sensor; None without one.
        name: id of the drawing, unique in the page.
        label: text for those who cannot see it.
    """
    wide = _WIDTH - _LEFT - _RIGHT
    x = (float(min(w.time_s[0] for w in windows)), float(max(w.time_s[-1] for w in windows)))
    panels = [_ratios(windows, contact, (_LEFT, 20, wide, 70), x)]
    torque = next((w for w in windows if w.joint == worst), None)
    if torque is not None:
        panels.append(_torques(torque, unit, (_LEFT, 112, wide, 46), x))
    if force is not None:
        panels.append(_force(force, (_LEFT, 20 + 92 + 68 * (len(panels) - 1), wide, 28), x))
    panels[-1].x_axis("time, s")
    bottom = round(panels[-1].box[1] + panels[-1].box[3])
    return drawing(_WIDTH, bottom + 34, label, panels, name)


def _ratios(windows: Sequence[JointTrace], contact: Contact, box: tuple[float, ...], x: tuple[float, float]) -> Panel:
    drawn = []
    for window in sorted(windows, key=lambda w: w.joint in contact.joints):
        kind, points = ("curve", _POINTS) if window.joint in contact.joints else ("curve-other", _OTHER_POINTS)
        known = np.where(window.judged | window.standing, window.residual_nm / window.gamma_nm, np.nan)
        drawn.append((*thin(window.time_s, known, points), kind))
    peak = max((float(np.nanmax(np.abs(ratio))) for _, ratio, _ in drawn if np.isfinite(ratio).any()), default=1.0)
    panel = Panel((box[0], box[1], box[2], box[3]), x, (-1.08 * max(peak, 1.3), 1.08 * max(peak, 1.3)))
    panel.y_axis("residual ÷ γ, all joints")
    panel.shade(np.array([contact.onset_s]), np.array([contact.end_s]), "shade-contact")
    for level in (-1.0, 1.0):
        panel.level(level, "gamma")
    for time_s, ratio, kind in drawn:
        panel.line(time_s, ratio, kind)
    panel.moments([contact.onset_s], "onset")
    panel.moments([contact.detected_s], "detected")
    return panel


def _torques(window: JointTrace, unit: str, box: tuple[float, ...], x: tuple[float, float]) -> Panel:
    some = slice(None, None, max(1, len(window.time_s) // _POINTS))
    time_s, measured = window.time_s[some], window.measured_nm[some].astype(np.float64)
    least, most = model_range(window, some)
    known = np.concatenate([measured, least, most])
    known = known[np.isfinite(known)]
    low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 1.0)
    room = 0.08 * (high - low)
    panel = Panel((box[0], box[1], box[2], box[3]), x, (low - room, high + room))
    panel.y_axis(f"torque, {unit}", 3)
    panel.area(time_s, np.where(most > least, least, np.nan), most, "model-range")
    panel.line(time_s, np.where(least == most, least, np.nan), "model")
    panel.line(time_s, measured, "measured")
    return panel


def _force(force: tuple[FloatArray, FloatArray], box: tuple[float, ...], x: tuple[float, float]) -> Panel:
    time_s, newtons = force
    a, b = np.searchsorted(time_s, x)
    part = slice(int(a), int(b), max(1, int(b - a) // _POINTS))
    shown = newtons[part]
    top = float(np.nanmax(shown)) if np.isfinite(shown).any() else 1.0
    panel = Panel((box[0], box[1], box[2], box[3]), x, (0.0, 1.1 * top or 1.0))
    panel.y_axis("wrist sensor, N", 2)
    panel.line(time_s[part], shown, "measured")
    return panel
