"""Drawn planes: strokes cover exactly the cells of their region, and each rule has its shade."""

from __future__ import annotations

import re

import numpy as np
import samples
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from collaudit.core.recommend.joint_thresholds import AlarmPlane
from collaudit.reports.page.html import html_text
from collaudit.reports.page.matter_pages import plane_plot
from collaudit.reports.plots.svg import Panel

_STROKE = re.compile(r"M(\d+) ([\d.]+)H(\d+)")


def covered(path: str, width: float, x: float, y: float) -> bool:
    """Whether a stroke of this width lies on a point."""
    strokes = [(int(left), float(at), int(right)) for left, at, right in _STROKE.findall(path)]
    return any(left < x < right and abs(y - at) < width / 2 for left, at, right in strokes)


@given(arrays(np.bool_, st.tuples(st.integers(1, 6), st.integers(1, 6))))
@settings(max_examples=60, deadline=None)
def test_strokes_cover_the_marked_cells_and_no_other(marked: np.ndarray) -> None:
    rows, columns = marked.shape
    panel = Panel((3.0, 2.0, 4.0 * columns, 5.0 * rows), (0.0, columns), (0.0, rows))
    panel.cells(marked, np.arange(columns + 1.0), np.arange(rows + 1.0), "red")
    path = "".join(panel.marks)
    for share in (0.1, 2.5, 4.9):
        top = 2.0 + 5.0 * rows
        shown = [[covered(path, 5.0, 5.0 + 4 * c, top - 5 * r - share) for c in range(columns)] for r in range(rows)]
        assert shown == marked.tolist()


def shade(drawn: str, x: float, y: float) -> str:
    """The colour seen at a point, the only one drawn there."""
    layers = re.findall(r'<path class="cells" stroke="(#\w+)" stroke-width="([\d.]+)" d="([^"]*)"/>', drawn)
    [colour] = [colour for colour, width, path in layers if covered(path, float(width), x, y)]
    return colour


def test_a_plane_is_darker_where_more_alarms_are() -> None:
    gammas = tuple(0.25 * 2.0 ** (k / 2) for k in range(9))
    alarms = (*((200 // (1 + row), 3, 1, 0, 0) for row in range(8)), (0, 0, 0, 0, 0))
    plane = AlarmPlane(gammas, (0.01, 0.02, 0.04, 0.08, 0.16), 3600.0, alarms, 1.0, 1.4)
    drawn = str(plane_plot(plane, "<label>"))
    assert shade(drawn, 50.5, 21.5) == "#f4f7fa", "the highest threshold: no alarm"
    assert shade(drawn, 50.5, 230.5) == "#0b3f6e", "the lowest threshold and shortest persistence: most of them"
    assert drawn.count('class="gamma"') == drawn.count('class="rule"') == 1, "the set and the recommended threshold"
    assert "&lt;label&gt;" in drawn and "<label>" not in drawn


def test_the_page_says_once_what_holds_for_several_joints() -> None:
    text = html_text([samples.busy(3)])
    assert text.count("a quarter of its threshold") == 6, "once for each of six kinds, not for each joint"
    assert "shoulder_pan, shoulder_lift, elbow, wrist_1, wrist_2, wrist_3: " in text
