"""A bar over the time of a log: how much of every moment of one joint was judged."""

from __future__ import annotations

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from collaudit.core.data.signals import State
from collaudit.reports.plots.downsample import column_shares

_COLUMNS = _WIDTH = 1000
_HEIGHT = 100


def coverage_bar(state: NDArray[np.int8], label: str) -> Markup:
    """One joint's states as stacked shares: judged at the bottom, then standing, not judged, no data.

    Args:
        state: (n,) codes of :class:`State`.
        label: text for those who cannot see the bar.
    """
    gap = state == State.GAP
    judged = state == State.JUDGED
    standing = state == State.FRICTION_INTERVAL
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
