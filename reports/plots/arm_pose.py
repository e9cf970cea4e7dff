"""The arm as a stick figure from the side and from above: joints with their axes, the base, the tool, a scale."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from collaudit.core.data.arm_geometry import ArmGeometry, arm_at
from collaudit.core.data.detection_result import ContactScene
from collaudit.core.numeric.arrays import FloatArray
from collaudit.reports.plots.svg import Panel, drawing

_WIDTH, _HEIGHT, _SIDE = 210, 112, 96
#: Length of an axis's stroke, as a share of the view.
_AXIS = 0.07
_SCALES_M = (0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0)


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


def draw_pose(arm: DrawnArm, reacted: Sequence[int], name: str, label: str) -> Markup | None:
    """Pose from the side (along the direction the arm reaches in) and from above, at one scale.

    Args:
        arm: where it is.
        reacted: which of the points are joints that alarmed.
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
    panels = [_view(arm, view, span, left, reacted) for view, left in zip(views, (2, _WIDTH - _SIDE - 2), strict=True)]
    for panel, words in zip(panels, ("from the side", "from above"), strict=True):
        panel.frame.append(f'<text x="{panel.box[0]:g}" y="{_HEIGHT - 2}">{words}</text>')
    return drawing(_WIDTH, _HEIGHT, label, panels, name, clip=False)


def _view(arm: DrawnArm, view: FloatArray, span: float, left: float, reacted: Sequence[int]) -> Panel:
    x, y = view @ np.vstack([arm.points, np.zeros(3)]).T  # the base last: -1 of the parents
    middle = [(float(v.min()) + float(v.max())) / 2 for v in (x, y)]
    limits = [(m - span / 2, m + span / 2) for m in middle]
    panel = Panel((left, 2, _SIDE, _SIDE), limits[0], limits[1])
    panel.line(x[-1] + span * np.array([-0.08, 0.08]), np.repeat(y[-1], 2), "arm-base")
    ends = np.column_stack([arm.parents, np.arange(len(x) - 1)])
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
