"""The arm as it moves, as an animated drawing without a script, and a joint's position over time."""

from __future__ import annotations

import numpy as np
from markupsafe import Markup

from collaudit.core.data.plan_result import JointLimits
from collaudit.core.numeric.arrays import FloatArray
from collaudit.reports.plots.svg import Panel, drawing

_SIDE, _GAP, _WIDE = 300, 40, 1000
_SHOWN_S = 40.0  # a longer motion is shown faster
_GHOSTS = 12


def moving_arm(points_m: FloatArray, duration_s: float) -> Markup:
    """The arm from the side and from above, at one scale; a click on it starts the motion.

    Args:
        points_m: (n, k, 3) joints and tool in the base's axes, evenly spaced in time.
        duration_s: of the motion.
    """
    span = 1.1 * float(max(np.ptp(points_m[..., axis]) for axis in range(3))) or 1.0
    height = 1.1 * _SIDE * float(max(np.ptp(points_m[..., axis]) for axis in (1, 2))) / span
    parts = []
    for view, (x, y) in enumerate(((0, 2), (0, 1))):
        middle = [0.5 * float(points_m[..., axis].min() + points_m[..., axis].max()) for axis in (x, y)]
        left = view * (_SIDE + _GAP)
        u = left + _SIDE * (0.5 + (points_m[..., x] - middle[0]) / span)
        v = 0.5 * height - _SIDE * (points_m[..., y] - middle[1]) / span
        paths = [
            "M" + "L".join(f"{a:.1f} {b:.1f}" for a, b in zip(us, vs, strict=True)) for us, vs in zip(u, v, strict=True)
        ]
        ghosts = "".join(paths[:: max(1, len(paths) // _GHOSTS)])
        shown = min(duration_s, _SHOWN_S)
        parts.append(
            f'<path class="arm" opacity="0.12" fill="none" d="{ghosts}"/><path class="arm" fill="none" d="{paths[0]}">'
            f'<animate attributeName="d" dur="{shown:.1f}s" begin="moving-arm.click"'
            f' values="{";".join(paths)}"/></path>'
            f'<text x="{left}" y="{height + 14:.1f}">{("from the side", "from above")[view]}</text>'
        )
    label = f"The planned motion from the side and from above, {duration_s:.0f} s; a click starts it"
    head = Markup('<svg id="moving-arm" class="plot" viewBox="0 0 {} {:.0f}" role="img" aria-label="{}">')
    body = f'<rect width="{2 * _SIDE + _GAP}" height="{height:.0f}" opacity="0"/>' + "".join(parts)
    return head.format(_WIDE, height + 20, label) + Markup(body) + Markup("</svg>")


def positions_over_time(time_s: FloatArray, q: FloatArray, limits: JointLimits, name: str) -> Markup:
    """One joint's position over the motion, between its limits."""
    low, high = min(limits.low_rad, float(q.min())), max(limits.high_rad, float(q.max()))
    room = 0.05 * (high - low)
    panel = Panel((44, 14, 200, 62), (0.0, float(time_s[-1])), (low - room, high + room))
    panel.y_axis("rad", 3)
    for level in (limits.low_rad, limits.high_rad):
        panel.level(level, "gamma")
    panel.line(time_s, q, "curve")
    return drawing(260, 84, f"position from {q.min():.2f} to {q.max():.2f} rad", [panel], name)
