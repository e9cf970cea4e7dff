"""The smallest noticeable force at the tool over the space it was driven through, from above and from the side.

Cells behind each other are one square of the drawing; it shows the one that needs the most force, as a shade and,
where the squares are large enough, as a number.
"""

from __future__ import annotations

from math import inf, log

from markupsafe import Markup

from collaudit.core.data.rule_study_result import ForceCell, ForceMap
from collaudit.reports.values.numbers import significant

_SIZE, _LEFT, _TOP, _BOTTOM, _GAP, _KEY = 300.0, 46.0, 20.0, 36.0, 40.0, 120.0
#: From little force to much; grey where the limit of the map is not reached by most directions.
_SHADES = ("#0d4f3c", "#2a6f57", "#4c8f75", "#74ae95", "#a0cbb6", "#cde5d9", "#eef7f2")
_BLIND, _EDGE = "#c9c9c9", "#7d8a86"
#: Shades that dark numbers are read on, and the edge of a square that a number fits into, pixels.
_PALE = (*_SHADES[3:], _BLIND)
_NUMBERED = 22.0
#: Drawn axes of each panel: across, upwards; and its title.
_PANELS = ((0, 1, "from above", "x, m", "y, m"), (0, 2, "from the side", "x, m", "z, m"))


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
    width, height = 2 * (_LEFT + _SIZE) + _GAP + _KEY, _TOP + _SIZE + _BOTTOM
    head = Markup('<svg class="plot forces" viewBox="0 0 {} {}" role="img" aria-label="{}">').format(
        round(width), round(height), label
    )
    limits = _limits(found)
    body = Markup()
    for k, panel in enumerate(_PANELS):
        body += _panel(found, panel, _LEFT + k * (_LEFT + _SIZE + _GAP / 2), limits)
    return head + body + _key(limits, 2 * (_LEFT + _SIZE) + _GAP) + Markup("</svg>")


def _limits(found: ForceMap) -> tuple[float, float]:
    """Least and greatest force that is drawn in a shade."""
    known = [cell.force_n for cell in found.cells if cell.force_n is not None]
    return (min(known), max(known)) if known else (1.0, 1.0)


def _panel(found: ForceMap, panel: tuple[int, int, str, str, str], left: float, limits: tuple[float, float]) -> Markup:
    across, upwards, title, name_x, name_y = panel
    squares: dict[tuple[float, float], list[ForceCell]] = {}
    for cell in found.cells:
        squares.setdefault((cell.centre_m[across], cell.centre_m[upwards]), []).append(cell)
    low = [min(place[k] for place in squares) - found.cell_m / 2 for k in (0, 1)]
    extent = max(max(place[k] for place in squares) + found.cell_m / 2 - low[k] for k in (0, 1))
    scale = _SIZE / extent
    edge = found.cell_m * scale
    by_shade: dict[str, list[str]] = {}
    numbers = Markup()
    for (x, y), cells in sorted(squares.items()):
        force = max(inf if cell.force_n is None else cell.force_n for cell in cells)
        px, py = left + (x - low[0]) * scale, _TOP + _SIZE - (y - low[1]) * scale
        shade = _shade(force, limits)
        side = f"h{edge:.1f}v{edge:.1f}h-{edge:.1f}z"
        by_shade.setdefault(shade, []).append(f"M{px - edge / 2:.1f} {py - edge / 2:.1f}{side}")
        if edge >= _NUMBERED:
            pale = ' class="on-pale"' if shade in _PALE else ""
            words = "–" if force == inf else significant(force, 2)
            numbers += Markup('<text{} x="{:.0f}" y="{:.0f}">{}</text>').format(Markup(pale), px, py + 4, words)
    out = _text(left, 13, title, "start")
    for shade, paths in by_shade.items():
        out += Markup('<path fill="{}" stroke="{}" stroke-width=".5" d="{}"/>').format(shade, _EDGE, "".join(paths))
    out += Markup('<g class="numbers" text-anchor="middle">{}</g>').format(numbers)
    for value, text_at in ((low[0], "start"), (low[0] + extent, "end")):
        out += _text(left + (value - low[0]) * scale, _TOP + _SIZE + 14, f"{value:.1f}", text_at)
    for value in (low[1], low[1] + extent):
        out += _text(left - 4, _TOP + _SIZE - (value - low[1]) * scale + (0 if value == low[1] else 9), f"{value:.1f}")
    out += _text(left + _SIZE / 2, _TOP + _SIZE + 29, name_x, "middle")
    return out + _text(left - 4, _TOP + _SIZE / 2, name_y)


def _shade(force: float, limits: tuple[float, float]) -> str:
    if force == inf:
        return _BLIND
    share = log(force / limits[0]) / (log(limits[1] / limits[0]) or 1.0)
    return _SHADES[min(len(_SHADES) - 1, max(0, int(share * len(_SHADES))))]


def _key(limits: tuple[float, float], left: float) -> Markup:
    """Which shade is which force, N."""
    out = _text(left, 13, "needs up to, N", "start")
    ratio = limits[1] / limits[0]
    rows = [(s, significant(limits[0] * ratio ** ((k + 1) / len(_SHADES)), 2)) for k, s in enumerate(_SHADES)]
    for k, (shade, words) in enumerate([*rows, (_BLIND, "blind")]):
        y = _TOP + 20 * k
        out += Markup(
            '<rect x="{:.0f}" y="{:.0f}" width="16" height="16" fill="{}" stroke="{}" stroke-width="0.5"/>'
        ).format(left, y, shade, _EDGE)
        out += _text(left + 22, y + 12, words, "start")
    return out


def _text(x: float, y: float, text: str, anchor: str = "end") -> Markup:
    return Markup('<text x="{:.0f}" y="{:.0f}" text-anchor="{}">{}</text>').format(x, y, anchor, text)
