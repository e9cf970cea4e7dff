"""The arm as a stick figure from the side and from above: at a contact, with axes and a scale, and as it moves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from collaudit.core.data.detection_result import ContactScene
from collaudit.core.data.plan_result import JointLimits
from collaudit.core.data.signals import ArmGeometry, arm_at
from collaudit.core.numeric.arrays import FloatArray
from collaudit.reports.plots.svg import Panel, drawing

_WIDTH, _HEIGHT, _SIDE = 210, 112, 96
#: Length of an axis's stroke, as a share of the view.
_AXIS = 0.07
_SCALES_M = (0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0)
#: Of the arm that moves: the side of a view, what lies between the two, and the drawing, pixels.
_MOVING, _GAP, _WIDE = 300, 40, 1000
_SHOWN_S = 40.0  # a longer motion is shown faster
_GHOSTS = 12


@dataclass(frozen=True, slots=True, eq=False)
class DrawnArm:
    """Joints and tool (k + 1, 3) m; the point that each hangs on, -1: the base; axes (k, 3), None where not known."""

    points: FloatArray
    parents: tuple[int, ...]
    axes: FloatArray | None


def drawn_arm(scene: ContactScene, arm: ArmGeometry | None) -> DrawnArm:
    """The arm at a contact; without its kinematics a chain of the points of the scene."""
    position = scene.joint_position_rad
    if arm is None or any(link.joint not in position for link in arm.links if link.joint is not None):
        points = np.array(scene.points_m, dtype=np.float64).reshape(-1, 3)
        return DrawnArm(points, tuple(range(-1, len(points) - 1)), None)
    points, axes = arm_at(arm, position)
    return DrawnArm(points, (*(link.parent for link in arm.links), arm.tool_link), axes)


def draw_pose(arm: DrawnArm, reacted: Sequence[int], possible: Sequence[int], name: str, label: str) -> Markup | None:
    """Pose from the side (along the direction the arm reaches in) and from above, at one scale.

    Args:
        arm: where it is.
        reacted: which of the points are joints that alarmed.
        possible: which of the points move a link on which the contact can be.
        name: id of the drawing, unique in the page.
        label: text for those who cannot see it.

    Returns:
        The drawing; None where there are not two points.
    """
    points = np.vstack([np.zeros(3), arm.points])  # the base first
    if len(points) < 3 or not np.isfinite(points).all():
        return None
    reach = points[np.argmax(np.hypot(points[:, 0], points[:, 1]))]
    angle = float(np.arctan2(reach[1], reach[0]))
    views = (np.array([[np.cos(angle), np.sin(angle), 0], [0, 0, 1]]), np.eye(3)[:2])
    span = max(float(np.ptp(points @ row)) for view in views for row in view) * 1.3 or 1.0
    panels = [
        _view(arm, view, span, left, reacted, possible)
        for view, left in zip(views, (2, _WIDTH - _SIDE - 2), strict=True)
    ]
    for panel, words in zip(panels, ("from the side", "from above"), strict=True):
        panel.frame.append(f'<text x="{panel.box[0]:g}" y="{_HEIGHT - 2}">{words}</text>')
    return drawing(_WIDTH, _HEIGHT, label, panels, name, clip=False)


def _view(
    arm: DrawnArm, view: FloatArray, span: float, left: float, reacted: Sequence[int], possible: Sequence[int]
) -> Panel:
    x, y = view @ np.vstack([arm.points, np.zeros(3)]).T  # the base last: -1 of the parents
    middle = [(float(v.min()) + float(v.max())) / 2 for v in (x, y)]
    limits = [(m - span / 2, m + span / 2) for m in middle]
    panel = Panel((left, 2, _SIDE, _SIDE), limits[0], limits[1])
    panel.line(x[-1] + span * np.array([-0.08, 0.08]), np.repeat(y[-1], 2), "arm-base")
    ends = np.column_stack([arm.parents, np.arange(len(x) - 1)])
    shaded = ends[np.isin(ends[:, 0], list(possible))]  # a stroke is of the link that its inner end moves
    _strokes(panel, x[shaded], y[shaded], "arm-possible")
    _strokes(panel, x[ends], y[ends], "arm")
    if arm.axes is not None:
        u, v = _AXIS * span * (view @ arm.axes.T)[:, :, None] * np.array([-1.0, 1.0])
        _strokes(panel, x[:-2, None] + u, y[:-2, None] + v, "arm-axis")
    joints = np.arange(len(x) - 2)
    hit = np.isin(joints, list(reacted))
    panel.dots(x[:-2][~hit], y[:-2][~hit], "arm-joint")
    panel.dots(x[:-2][hit], y[:-2][hit], "arm-hit")
    panel.dots(x[-2:-1], y[-2:-1], "arm-tool")
    scale = max((s for s in _SCALES_M if s <= 0.4 * span), default=_SCALES_M[0])
    start, low = limits[0][0] + 0.04 * span, limits[1][0] + 0.03 * span
    panel.line(np.array([start, start + scale]), np.array([low, low]), "arm-scale")
    right, level = float(panel.px(start + scale)) + 4.0, float(panel.py(low)) + 3.0
    panel.frame.append(f'<text class="tiny" x="{right:.0f}" y="{level:.0f}">{scale:g} m</text>')
    return panel


def _strokes(panel: Panel, x: FloatArray, y: FloatArray, kind: str) -> None:
    """Lines (n, 2) that do not hang together."""
    gap = np.full((len(x), 1), np.nan)
    panel.line(np.hstack([x, gap]).ravel(), np.hstack([y, gap]).ravel(), kind)


def moving_arm(points_m: FloatArray, duration_s: float) -> Markup:
    """The arm from the side and from above, at one scale; a click on it starts the motion.

    Args:
        points_m: (n, k, 3) joints and tool in the base's axes, evenly spaced in time.
        duration_s: of the motion.
    """
    span = 1.1 * float(max(np.ptp(points_m[..., axis]) for axis in range(3))) or 1.0
    height = 1.1 * _MOVING * float(max(np.ptp(points_m[..., axis]) for axis in (1, 2))) / span
    parts = []
    for view, (x, y) in enumerate(((0, 2), (0, 1))):
        middle = [0.5 * float(points_m[..., axis].min() + points_m[..., axis].max()) for axis in (x, y)]
        left = view * (_MOVING + _GAP)
        u = left + _MOVING * (0.5 + (points_m[..., x] - middle[0]) / span)
        v = 0.5 * height - _MOVING * (points_m[..., y] - middle[1]) / span
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
    body = f'<rect width="{2 * _MOVING + _GAP}" height="{height:.0f}" opacity="0"/>' + "".join(parts)
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
