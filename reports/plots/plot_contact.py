"""A close look at one contact: all joints on one time axis, the joint that stands out, the wrist sensor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from collaudit.core.data.detection_result import Contact
from collaudit.core.data.signals import State
from collaudit.core.numeric.arrays import FloatArray, IntArray
from collaudit.reports.plots.joint_trace import JointTrace, thin
from collaudit.reports.plots.svg import Panel, drawing
from collaudit.reports.values.contact_alarms import contact_limits

_WIDTH = 560
_LEFT, _RIGHT = 46, 8
_POINTS = 40
_OTHER_POINTS = 12


@dataclass(frozen=True, slots=True, eq=False)
class ContactWindow:
    """What one joint shows around one contact.

    Attributes:
        time_s, ratio: (k,) residual over its threshold where it was judged, NaN elsewhere.
        reacted: whether the joint alarmed.
        torque_time_s, measured_nm, least_nm, most_nm: (k,) measured torque, and the range of the modelled one.
    """

    joint: str
    time_s: FloatArray
    ratio: FloatArray
    reacted: bool
    torque_time_s: FloatArray
    measured_nm: FloatArray
    least_nm: FloatArray
    most_nm: FloatArray


def contact_window(trace: JointTrace, contact: Contact) -> ContactWindow | None:
    """One joint around one contact; None where there are not two samples of it."""
    start, stop = contact_limits(contact, trace.period_s)
    a, b = (int(k) for k in np.searchsorted(trace.time_s, [start, stop]))
    a = min(a, max(0, len(trace.time_s) - 2))
    part = slice(a, max(b, a + 2))
    if len(trace.time_s[part]) < 2:
        return None
    state, residual = trace.state[part], trace.residual_nm[part]
    judged = (state == State.JUDGED) | (state == State.FRICTION_INTERVAL)
    reacted = trace.joint in contact.joints
    points = _POINTS if reacted else _OTHER_POINTS
    time_s, ratio = thin(trace.time_s[part], np.where(judged, residual / trace.gamma_nm[part], np.nan), points)
    step = max(1, len(residual) // _POINTS)
    least, most = model_range(trace, part)
    measured = trace.measured_nm[part][::step].astype(np.float64)
    times = trace.time_s[part][::step]
    return ContactWindow(trace.joint, time_s, ratio, reacted, times, measured, least[::step], most[::step])


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
    windows: Sequence[ContactWindow],
    contact: Contact,
    worst: str,
    unit: str,
    force: tuple[FloatArray, FloatArray] | None,
    name: str,
    label: str,
) -> Markup:
    """Residual over γ of every joint, measured and modelled torque of one, and the tool's force.

    Args:
        windows: of the joints.
        contact: the contact.
        worst: joint whose torque is drawn.
        unit: of its torque.
        force: time and size (k,) of the force at the wrist sensor; None without one.
        name: id of the drawing, unique in the page.
        label: text for those who cannot see it.
    """
    wide = _WIDTH - _LEFT - _RIGHT
    x = (float(min(w.torque_time_s[0] for w in windows)), float(max(w.torque_time_s[-1] for w in windows)))
    panels = [_ratios(windows, contact, (_LEFT, 20, wide, 70), x)]
    torque = next((w for w in windows if w.joint == worst), None)
    if torque is not None:
        panels.append(_torques(torque, unit, (_LEFT, 112, wide, 46), x))
    if force is not None:
        panels.append(_force(force, (_LEFT, 20 + 92 + 68 * (len(panels) - 1), wide, 28), x))
    panels[-1].x_axis("time, s")
    bottom = round(panels[-1].box[1] + panels[-1].box[3])
    return drawing(_WIDTH, bottom + 34, label, panels, name)


def _ratios(
    windows: Sequence[ContactWindow], contact: Contact, box: tuple[float, ...], x: tuple[float, float]
) -> Panel:
    peak = max((float(np.nanmax(np.abs(w.ratio))) for w in windows if np.isfinite(w.ratio).any()), default=1.0)
    panel = Panel((box[0], box[1], box[2], box[3]), x, (-1.08 * max(peak, 1.3), 1.08 * max(peak, 1.3)))
    panel.y_axis("residual ÷ γ, all joints")
    panel.shade(np.array([contact.onset_s]), np.array([contact.end_s]), "shade-contact")
    for level in (-1.0, 1.0):
        panel.level(level, "gamma")
    for window in sorted(windows, key=lambda w: w.reacted):
        panel.line(window.time_s, window.ratio, "curve" if window.reacted else "curve-other")
    panel.moments([contact.onset_s], "onset")
    panel.moments([contact.detected_s], "detected")
    return panel


def _torques(window: ContactWindow, unit: str, box: tuple[float, ...], x: tuple[float, float]) -> Panel:
    known = np.concatenate([window.measured_nm, window.least_nm, window.most_nm])
    known = known[np.isfinite(known)]
    low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 1.0)
    room = 0.08 * (high - low)
    panel = Panel((box[0], box[1], box[2], box[3]), x, (low - room, high + room))
    panel.y_axis(f"torque, {unit}", 3)
    value = np.where(window.least_nm == window.most_nm, window.least_nm, np.nan)
    wide = window.most_nm > window.least_nm
    panel.area(window.torque_time_s, np.where(wide, window.least_nm, np.nan), window.most_nm, "model-range")
    panel.line(window.torque_time_s, value, "model")
    panel.line(window.torque_time_s, window.measured_nm, "measured")
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
