"""The drawn study of a rule: strokes cover exactly the cells of their region, planes show each rule its shade."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import samples
import studies
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from collaudit.reports.page.html import html_text
from collaudit.reports.plots.study_maps import plane_map
from collaudit.reports.plots.svg import Panel
from collaudit.reports.sections.study_sections import study_sections

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


def shades(drawn: str, x: float, y: float) -> str:
    """The colour seen at a point, the only one drawn there."""
    layers = re.findall(r'<path class="cells" stroke="(#\w+)" stroke-width="([\d.]+)" d="([^"]*)"/>', drawn)
    [colour] = [colour for colour, width, path in layers if covered(path, float(width), x, y)]
    return colour


def test_a_plane_shows_few_alarms_pale_and_what_notices_nothing_grey() -> None:
    drawn = str(plane_map(studies.plane(), 0.002, "<label>"))
    assert shades(drawn, 50.5, 21.5) == "#f4f7fa", "the highest threshold: no alarm"
    assert shades(drawn, 50.5, 222.5) == "#0b3f6e", "the lowest at one sample: thousands an hour"
    assert shades(drawn, 497.5, 222.5) == "#0d4f3c" and shades(drawn, 862.5, 21.5) == "#c9c9c9"
    assert drawn.count("<title>γ") == 4, "the set and the recommended rule, on both panels"
    assert "&lt;label&gt;" in drawn and "<label>" not in drawn
    nothing = str(plane_map(replace(studies.plane(), clean_hours=0.0), 0.002, ""))
    assert shades(nothing, 50.5, 222.5) == "#c9c9c9", "no clean time: no rate"


def test_places_have_a_row_for_each_measure_and_a_column_for_each_shape() -> None:
    tables = [one for one in study_sections(studies.study(samples.JOINTS)) if one.title.startswith("By place")]
    assert ["configured" in tables[0].title, "recommended" in tables[1].title] == [True, True]
    assert tables[0].columns == ("where", "noticed", *studies.SHAPES)
    assert tables[0].rows[0] == ("moving", "half at N", *5 * ("23.0 (18.4 to 39.1)",))
    assert [row[0] for row in tables[0].rows[::3]] == [
        "moving", "standing", *(f"end of {joint}" for joint in samples.JOINTS), "tool"
    ]  # fmt: skip


def test_planes_are_drawn_on_the_page_of_one_log_only() -> None:
    audit = replace(samples.failed(2000), study=studies.study(samples.JOINTS))
    alone, both = html_text([audit]), html_text([audit, audit])
    assert alone.count('class="plot plane"') == len(samples.JOINTS) and 'class="plot plane"' not in both
    assert both.count("are drawn on the page of this log alone") == 2


def test_the_page_says_once_what_holds_for_several_joints() -> None:
    text = html_text([samples.busy(3)])
    assert text.count("a quarter of its threshold") == 6, "once for each of six kinds, not for each joint"
    assert "shoulder_pan, shoulder_lift, elbow, wrist_1, wrist_2, wrist_3: " in text
