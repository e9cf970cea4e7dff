"""A bar over the time of a log: how much of every moment of one joint a contact was detectable in."""

from __future__ import annotations

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from collaudit.core.data.signals import State
from collaudit.core.numeric.arrays import BoolArray
from collaudit.reports.plots.downsample import column_shares
from collaudit.reports.plots.joint_trace import JointTrace

_COLUMNS = _WIDTH = 1000
_HEIGHT = 100


def detectable_samples(trace: JointTrace, observable_nm: float | None) -> BoolArray:
    """(n,) where a torque of the size asked for would have alarmed.

    Where friction is an interval that takes its width beyond γ, for the torque may act against it; where the width is
    not known, and without a size asked for, only what is judged above γ counts.
    """
    if observable_nm is None or trace.least_nm is None or trace.most_nm is None or not np.isfinite(trace.gamma_nm):
        return trace.judged
    narrow = trace.most_nm - trace.least_nm + trace.gamma_nm <= observable_nm
    return np.asarray(trace.judged | (trace.standing & narrow))


def coverage_bar(trace: JointTrace, observable_nm: float | None, label: str) -> Markup:
    """One joint's time as stacked shares: detectable at the bottom, then hidden by friction, not judged, no data.

    Args:
        trace: of the joint.
        observable_nm: the torque asked to be noticeable; None where none is.
        label: text for those who cannot see the bar.
    """
    state = trace.state
    gap = state == State.GAP
    judged = detectable_samples(trace, observable_nm)
    standing = trace.standing & ~judged
    parts = {"judged": judged, "standing": standing, "out": ~(judged | standing | gap), "gap": gap}
    floor = np.zeros(min(_COLUMNS, len(state)))
    columns = len(floor)
    shapes = Markup()
    for kind, mask in parts.items():
        top = floor + column_shares(mask, _COLUMNS) if columns else floor
        path = _path(np.rint(_HEIGHT * floor).astype(int), np.rint(_HEIGHT * top).astype(int))
        if path:
            shapes += Markup('<path class="{}" d="{}"/>').format(kind, path)
        floor = top
    return Markup(
        '<svg class="bar" viewBox="0 0 {} {}" preserveAspectRatio="none" role="img" aria-label="{}">{}</svg>'
    ).format(_WIDTH, _HEIGHT, label, shapes)


def _path(floor: NDArray[np.int_], top: NDArray[np.int_]) -> str:
    """Rectangles between two step lines, neighbours of equal height joined."""
    if not len(floor):
        return ""
    x = np.rint(np.linspace(0, _WIDTH, len(floor) + 1)).astype(int)
    changes = np.flatnonzero((np.diff(floor) != 0) | (np.diff(top) != 0)) + 1
    starts = np.concatenate(([0], changes))
    stops = np.concatenate((changes, [len(floor)]))
    return "".join(
        f"M{x[a]} {_HEIGHT - top[a]}H{x[b]}V{_HEIGHT - floor[a]}H{x[a]}Z"
        for a, b in zip(starts.tolist(), stops.tolist(), strict=True)
        if top[a] > floor[a]
    )
