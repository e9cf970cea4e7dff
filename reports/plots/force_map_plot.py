"""The smallest noticeable force at the tool over the space it was driven through, from above and from the side.

Cells behind each other are one square of the drawing; it shows the one that needs the most force, as a shade and,
where the squares are large enough, as a number.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import inf, log

import numpy as np
from markupsafe import Markup

from collaudit.core.data.rule_study_result import ForceMap
from collaudit.reports.plots.svg import Panel, drawing
from collaudit.reports.values.numbers import significant

_SIZE, _LEFT, _TOP, _BOTTOM, _GAP, _KEY = 300.0, 46.0, 20.0, 36.0, 20.0, 120.0
#: From little force to much; grey where the limit of the map is not reached by most directions.
_SHADES = ("#0d4f3c", "#2a6f57", "#4c8f75", "#74ae95", "#a0cbb6", "#cde5d9", "#eef7f2")
_BLIND, _EDGE = "#c9c9c9", "#7d8a86"
#: Shades that dark numbers are read on, and the edge of a square that a number fits into, pixels.
_PALE = (*_SHADES[3:], _BLIND)
_NUMBERED = 22.0
#: Drawn axis upwards of each panel, and what it is called; across is always x.
_PANELS = ((1, "from above: y, m"), (2, "from the side: z, m"))


def force_map_plot(found: ForceMap, label: str) -> Markup:
    """Two panels and a key.

    Args:
        found: of one log.
        label: for those who cannot see the drawing; any text.

    Returns:
        The drawing; empty without cells.
    """
    if not found.cells:
        return Markup()
    known = [cell.force_n for cell in found.cells if cell.force_n is not None]
    limits = (min(known), max(known)) if known else (1.0, 1.0)
    second = _LEFT + _SIZE + _GAP
    panels = [_panel(found, *_PANELS[0], _LEFT, limits), _panel(found, *_PANELS[1], second + _LEFT, limits)]
    panels[-1].marks += _key(limits, 2 * second)
    return drawing(
        round(2 * second + _KEY), round(_TOP + _SIZE + _BOTTOM), label, panels, "", "plot forces", clip=False
    )


def _panel(found: ForceMap, upwards: int, words: str, left: float, limits: tuple[float, float]) -> Panel:
    """The greatest force of the cells behind each other, as squares by shade and numbers."""
    worst: dict[tuple[float, float], float] = {}
    for cell in found.cells:
        place = (cell.centre_m[0], cell.centre_m[upwards])
        worst[place] = max(worst.get(place, 0.0), inf if cell.force_n is None else cell.force_n)
    low = np.min(list(worst), axis=0) - found.cell_m / 2
    extent = float(np.max(np.max(list(worst), axis=0) + found.cell_m / 2 - low))
    panel = Panel((left, _TOP, _SIZE, _SIZE), (low[0], low[0] + extent), (low[1], low[1] + extent))
    panel.y_axis(words)
    panel.x_axis("x, m")
    edge = _SIZE * found.cell_m / extent
    squares: dict[str, str] = {}
    numbers = ""
    for (x, y), force in sorted(worst.items()):
        across, down, shade = float(panel.px(x)), float(panel.py(y)), _shade(force, limits)
        square = f"M{across - edge / 2:.1f} {down - edge / 2:.1f}h{edge:.1f}v{edge:.1f}h-{edge:.1f}z"
        squares[shade] = squares.get(shade, "") + square
        if edge >= _NUMBERED:
            pale = ' class="on-pale"' if shade in _PALE else ""
            number = "–" if force == inf else significant(force, 2)
            numbers += f'<text{pale} x="{across:.0f}" y="{down + 4:.0f}">{number}</text>'
    for shade, path in squares.items():
        panel.marks.append(f'<path fill="{shade}" stroke="{_EDGE}" stroke-width=".5" d="{path}"/>')
    panel.marks.append(f'<g class="numbers" text-anchor="middle">{numbers}</g>')
    return panel


def _shade(force: float, limits: tuple[float, float]) -> str:
    if force == inf:
        return _BLIND
    share = log(force / limits[0]) / (log(limits[1] / limits[0]) or 1.0)
    return _SHADES[min(len(_SHADES) - 1, max(0, int(share * len(_SHADES))))]


def _key(limits: tuple[float, float], left: float) -> Iterator[str]:
    """Which shade is which force, N."""
    yield f'<text x="{left:.0f}" y="13">needs up to, N</text>'
    ratio = limits[1] / limits[0]
    rows = [(s, significant(limits[0] * ratio ** ((k + 1) / len(_SHADES)), 2)) for k, s in enumerate(_SHADES)]
    for k, (shade, words) in enumerate([*rows, (_BLIND, "blind")]):
        y = _TOP + 20 * k
        yield f'<rect x="{left:.0f}" y="{y:.0f}" width="16" height="16" fill="{shade}" stroke="{_EDGE}"/>'
        yield f'<text x="{left + 22:.0f}" y="{y + 12:.0f}">{words}</text>'
