"""A stick figure of the arm: joints as dots, the tool as a ring, seen from the side and from above."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from markupsafe import Markup

from collaudit.core.data.detection_result import ContactScene
from collaudit.reports.plots.svg import Panel, drawing

_WIDTH, _HEIGHT, _SIDE = 210, 112, 96


def draw_pose(scene: ContactScene, reacted: Sequence[int], name: str, label: str) -> Markup | None:
    """Pose from the side (along the direction the arm reaches in) and from above, at one scale.

    Args:
        scene: where the joints and the tool were.
        reacted: which of the points are joints that alarmed.
        name: id of the drawing, unique in the page.
        label: text for those who cannot see it.

    Returns:
        The drawing; None where there are not two points.
    """
    points = np.array(scene.points_m, dtype=np.float64).reshape(-1, 3)
    if len(points) < 2:
        return None
    reach = points[np.argmax(np.hypot(points[:, 0], points[:, 1]))]
    angle = float(np.arctan2(reach[1], reach[0]))
    along = points[:, 0] * np.cos(angle) + points[:, 1] * np.sin(angle)
    views = ((along, points[:, 2]), (points[:, 0], points[:, 1]))
    span = max(float(np.ptp(x)) for view in views for x in view) * 1.2 or 1.0
    panels = [_view(view, span, left, reacted) for view, left in zip(views, (2, _WIDTH - _SIDE - 2), strict=True)]
    for panel, words in zip(panels, ("from the side", "from above"), strict=True):
        panel.frame.append(f'<text x="{panel.box[0]:g}" y="{_HEIGHT - 2}">{words}</text>')
    return drawing(_WIDTH, _HEIGHT, label, panels, name)


def _view(view: tuple[np.ndarray, np.ndarray], span: float, left: float, reacted: Sequence[int]) -> Panel:
    x, y = view
    middle = [(float(v.min()) + float(v.max())) / 2 for v in view]
    limits = [(m - span / 2, m + span / 2) for m in middle]
    panel = Panel((left, 2, _SIDE, _SIDE), limits[0], limits[1])
    panel.line(x, y, "arm")
    joints = np.arange(len(x) - 1)
    hit = np.isin(joints, list(reacted))
    panel.dots(x[:-1][~hit], y[:-1][~hit], "arm-joint")
    panel.dots(x[:-1][hit], y[:-1][hit], "arm-hit")
    panel.dots(x[-1:], y[-1:], "arm-tool")
    return panel
