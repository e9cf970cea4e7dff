"""The drawn study of a rule: outlines cover exactly the cells of their region, planes show each rule its shade."""

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
from collaudit.reports.plots.plane_map import plane_map, region_outline
from collaudit.reports.sections.study_sections import study_sections

_SEGMENT = re.compile(r"([mhvz])(-?\d+)?(?: ?(-?\d+))?")


def covered(path: str, x: float, y: float) -> bool:
    """Whether the even-odd rule fills a point: borders crossed by a ray to the right, counted."""
    at, start, crossed = (0, 0), (0, 0), 0
    for kind, first, second in _SEGMENT.findall(path):
        last = at
        if kind == "m":
            at = start = (at[0] + int(first), at[1] + int(second))
            continue
        at = start if kind == "z" else (at[0] + int(first), at[1]) if kind == "h" else (at[0], at[1] + int(first))
        crossed += at[0] == last[0] > x and min(at[1], last[1]) < y < max(at[1], last[1])
    return bool(crossed % 2)


@given(arrays(np.bool_, st.tuples(st.integers(1, 6), st.integers(1, 6))))
@settings(max_examples=60, deadline=None)
def test_an_outline_covers_the_marked_cells_and_no_other(marked: np.ndarray) -> None:
    rows, columns = marked.shape
    path = region_outline(marked, [3.0 + 4 * k for k in range(columns + 1)], [90.0 - 5 * k for k in range(rows + 1)])
    shown = [[covered(path, 5.0 + 4 * c, 87.5 - 5 * r) for c in range(columns)] for r in range(rows)]
    assert shown == marked.tolist()


def shades(drawn: str, x: float, y: float) -> str:
    """The colour seen at a point: the last of the shades drawn there."""
    layers = re.findall(r'<path fill="(#\w+)" fill-rule="evenodd" d="([^"]*)"/>', drawn)
    return [colour for colour, path in layers if covered(path, x, y)][-1]


def test_a_plane_shows_few_alarms_pale_and_what_notices_nothing_grey() -> None:
    drawn = str(plane_map(studies.plane(), 0.002, "<label>"))
    assert shades(drawn, 50.5, 21.5) == "#f4f7fa", "the highest threshold: no alarm"
    assert shades(drawn, 50.5, 228.5) == "#0b3f6e", "the lowest at one sample: thousands an hour"
    assert shades(drawn, 455.5, 228.5) == "#0d4f3c" and shades(drawn, 820.5, 21.5) == "#c9c9c9"
    assert drawn.count("<title>γ") == 4, "the set and the recommended rule, on both panels"
    assert "&lt;label&gt;" in drawn and "<label>" not in drawn
    nothing = str(plane_map(replace(studies.plane(), clean_hours=0.0), 0.002, ""))
    assert shades(nothing, 50.5, 228.5) == "#c9c9c9", "no clean time: no rate"


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
