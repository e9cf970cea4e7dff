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
    top = np.zeros(min(_COLUMNS, len(state)))
    shapes: list[Markup] = []
    for kind, mask in parts.items():
        share = column_shares(mask, _COLUMNS) if len(top) else top
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
