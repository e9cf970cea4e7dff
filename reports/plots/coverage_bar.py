"""A bar over the time of a log: how much of every moment of one joint was judged."""

from __future__ import annotations

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from collaudit.core.data.signals import State
from collaudit.reports.plots.downsample import column_edges, column_shares
from collaudit.reports.plots.joint_trace import JointTrace

_COLUMNS = _WIDTH = 1000
_HEIGHT = 100


def coverage_bar(trace: JointTrace, label: str) -> Markup:
    """One joint's time as stacked shares: judged at the bottom, then friction known as a range, not judged, no data.

    Args:
        trace: of the joint.
        label: text for those who cannot see the bar.
    """
    gap, judged, standing = trace.state == State.GAP, trace.judged, trace.standing
    parts = {"judged": judged, "standing": standing, "out": ~(judged | standing | gap), "gap": gap}
    edges = column_edges(len(trace.state), _COLUMNS)
    top = np.zeros(len(edges) - 1)
    shapes: list[Markup] = []
    for kind, mask in parts.items():
        share = column_shares(mask, edges)
        top = top + share
        if share.any():
            path = _path(np.rint(_HEIGHT * top).astype(int))
            shapes.insert(0, Markup('<path class="{}" d="{}"/>').format(kind, path))
    return Markup(
        '<svg class="bar" viewBox="0 0 {} {}" preserveAspectRatio="none" role="img" aria-label="{}">{}</svg>'
    ).format(_WIDTH, _HEIGHT, label, Markup().join(shapes))


def _path(top: NDArray[np.int_]) -> str:
    """All below a step line, as steps; what is drawn after it covers what is not its own."""
    x = np.rint(np.linspace(0, _WIDTH, len(top) + 1)).astype(int)
    starts = np.concatenate(([0], np.flatnonzero(np.diff(top)) + 1))
    across = np.diff(np.append(x[starts], _WIDTH)).tolist()
    up = np.diff(top[starts], prepend=0).tolist()
    return f"M0 {_HEIGHT}" + "".join(f"v{-rise}h{run}" for rise, run in zip(up, across, strict=True)) + f"V{_HEIGHT}z"
