"""One signal of two recordings, or of two cycles of one, on one plot: each contact and the same place in the other."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, floor

import numpy as np
from markupsafe import Markup

from collaudit.core.data.audit_result import Audit
from collaudit.core.data.signals import Signals
from collaudit.core.numeric.arrays import FloatArray, nearest_stretch
from collaudit.reports.page.environment import environment
from collaudit.reports.plots.joint_trace import thin
from collaudit.reports.plots.svg import Panel, drawing
from collaudit.reports.values.contact_alarms import strongest
from collaudit.reports.values.visible_text import visible

#: Signals that can be laid over each other: field of the signals and unit.
SIGNALS = {
    "residual": ("residual_nm", "N·m"),
    "measured": ("measured_nm", "N·m"),
    "model": ("model_nm", "N·m"),
    "position": ("position_rad", "rad"),
    "velocity": ("velocity_rad_s", "rad/s"),
}
#: Around a contact, s; step of the comparison, s; joints further apart on average are at another place, rad.
_AROUND_S, _STEP_S, _NEAR_RAD = 1.5, 0.02, 0.1
_MOST_CONTACTS, _POINTS = 8, 600
_WIDTH, _HEIGHT = 640, 200


@dataclass(frozen=True, slots=True)
class Overlay:
    """One plot.

    Attributes:
        title: what is shown.
        text: where the other recording was at the same place, and how near.
        plot: the drawing.
    """

    title: str
    text: str
    plot: Markup


def overlay_page(first: Audit, other: Audit, signal: str) -> str:
    """The page as text: the contacts of the first recording, each over the same place in the other.

    Args:
        first: the recording with contacts; of one without any, the whole of every joint, from both starts.
        other: the one that is laid over it, which may be the same: then another cycle of it.
        signal: out of ``SIGNALS``.
    """
    contacts = strongest(first.result, _MOST_CONTACTS)
    drawn = [_of_contact(first, other, signal, number) for number in sorted(contacts)]
    if not drawn:
        end = float(first.signals.time_s[-1])
        drawn = [
            _drawn(first, other, signal, joint, (0.0, end), 0.0, joint, "from both starts")
            for joint in first.signals.joint_names
        ]
    logs = [audit.result.log for audit in (first, other)]
    names = [visible(f"{log.name}, {(log.start or 'date not known')[:16].replace('T', ' ')}") for log in logs]
    return environment().get_template("overlay.html.j2").render(overlays=drawn, names=names, signal=signal)


def _of_contact(first: Audit, other: Audit, signal: str, number: int) -> Overlay:
    contact = first.result.contacts[number - 1]
    joint = max(contact.peak_nm, key=contact.peak_nm.__getitem__, default=contact.joints[0])
    span = contact.onset_s - _AROUND_S, contact.end_s + _AROUND_S
    title = f"Contact {number} at {contact.onset_s:.2f} s, {joint}"
    found = _same_place(first, other, span)
    if found is None or found[1] > _NEAR_RAD:
        apart = "" if found is None else f"; the nearest is {found[1]:.2f} rad away"
        return _drawn(first, other, signal, joint, span, None, title, f"the other does not come to this place{apart}")
    later = found[0] - span[0]
    text = f"the other from {found[0]:.2f} s on, its joints {found[1]:.3f} rad away"
    return _drawn(first, other, signal, joint, span, later, title, text)


def _same_place(first: Audit, other: Audit, span: tuple[float, float]) -> tuple[float, float] | None:
    """When the other moves as the first does in a span, s, and how far apart they are, rad."""
    own = _steps(max(span[0], float(first.signals.time_s[0])), span[1])
    whole = _steps(float(other.signals.time_s[0]), float(other.signals.time_s[-1]))
    short, long = _positions(first.signals, own), _positions(other.signals, whole)
    allowed = None
    if first.result.log.sha256 == other.result.log.sha256:
        starts = whole[: max(whole.size - own.size + 1, 0)]
        allowed = np.abs(starts - own[0]) > span[1] - span[0]
    found = None if not np.isfinite(short).all() else nearest_stretch(short, long, allowed)
    return None if found is None else (float(whole[found[0]] - own[0] + span[0]), found[1])


def _steps(start: float, end: float) -> FloatArray:
    """Times at whole steps: of two recordings of one motion from one start, the same ones."""
    return _STEP_S * np.arange(ceil(start / _STEP_S), floor(end / _STEP_S), dtype=np.float64)


def _positions(signals: Signals, at: FloatArray) -> FloatArray:
    """(n, j) positions at these times."""
    columns = signals.position_rad.T
    return np.stack([np.interp(at, signals.time_s, column) for column in columns], axis=1)


def _drawn(
    first: Audit,
    other: Audit,
    signal: str,
    joint: str,
    span: tuple[float, float],
    later: float | None,
    title: str,
    text: str,
) -> Overlay:
    """The first recording's signal, and over it the other's ``later`` seconds later; None: without it."""
    field, unit = SIGNALS[signal]
    curves = [_curve(first.signals, field, joint, span, 0.0)]
    if later is not None and joint in other.signals.joint_names:
        curves.append(_curve(other.signals, field, joint, span, later))
    values = np.concatenate([y[np.isfinite(y)] for _, y in curves])
    low, high = (float(values.min()), float(values.max())) if values.size else (0.0, 1.0)
    room = 0.05 * (high - low)
    panel = Panel((52, 20, _WIDTH - 62, _HEIGHT - 56), span, (low - room, high + room))
    panel.y_axis(unit)
    panel.x_axis("time, s")
    for (x, y), kind in zip(curves, ("curve", "model"), strict=False):
        panel.line(x, y, kind)
    label = visible(f"{signal} of {joint}: {title}; {text}")
    plot = drawing(_WIDTH, _HEIGHT, label, [panel], f"o{round(1e3 * span[0])}-{first.signals.joint_names.index(joint)}")
    return Overlay(visible(title), text, plot)


def _curve(
    signals: Signals, field: str, joint: str, span: tuple[float, float], later: float
) -> tuple[FloatArray, FloatArray]:
    """Times on the first recording's clock, and values."""
    inside = (signals.time_s >= span[0] + later) & (signals.time_s <= span[1] + later)
    values = getattr(signals, field)[inside, signals.joint_names.index(joint)]
    return thin(signals.time_s[inside] - later, values.astype(np.float64), _POINTS)
