"""A rule study as drawings: each joint's plane over γ and n, and the force at the tool that is noticed over space."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import log10

import numpy as np
from markupsafe import Markup

from collaudit.core.data.rule_study_result import ForceMap, JointPlane, PlanePoint
from collaudit.core.numeric.arrays import FloatArray, IntArray
from collaudit.reports.plots.svg import Panel, drawing
from collaudit.reports.values.numbers import significant

#: Shades from few alarms to many, from little torque or force to much, and the colour of what is not known.
_ALARMS = ("#f4f7fa", "#d3e0ec", "#a9c3da", "#7aa3c5", "#4b81ad", "#255f90", "#0b3f6e")
_SHADES = ("#0d4f3c", "#2a6f57", "#4c8f75", "#74ae95", "#a0cbb6", "#cde5d9", "#eef7f2")
_UNKNOWN = "#c9c9c9"
_EDGE = "#7d8a86"
#: Alarms an hour at which the shade changes.
_RATES = (0.0, 0.1, 1.0, 10.0, 100.0, 1000.0)
#: Rows that thresholds are drawn in.
_ROWS = 30
_LEFT, _TOP, _GAP = 46.0, 20.0, 20.0
_WIDE, _HIGH = 380.0, 204.0
_SIZE, _KEY = 300.0, 120.0
#: Shades that need white numbers, and the edge of a square that a number fits into, pixels.
_DARK, _NUMBERED = 3, 22.0


def plane_map(plane: JointPlane, period_s: float, label: str, unit: str = "N·m") -> Markup:
    """Two panels over persistence (ms) and threshold, both logarithmic: alarms an hour, and what push is noticed.

    Args:
        plane: of one joint.
        period_s: sample period, s.
        label: for those who cannot see the drawing; any text.
        unit: of what the joint's drive exerts.
    """
    torque = np.array([[np.nan if t is None else t for t in row] for row in plane.torque_nm])
    noticed = _log_ranks(torque, torque[torque > 0])
    panels = [
        _plane(plane, period_s, _LEFT, f"γ, {unit}; shade: alarms an hour", _alarm_ranks(plane), _ALARMS),
        _plane(plane, period_s, 2 * _LEFT + _WIDE + _GAP, f"smallest push noticed, {unit}", noticed, _SHADES),
    ]
    for panel in panels:
        _rules(panel, plane, period_s, unit)
    return drawing(round(2 * (_LEFT + _WIDE + _GAP)), round(_TOP + _HIGH + 34), label, panels, "", "plot plane", False)


def _plane(
    plane: JointPlane, period_s: float, left: float, words: str, ranks: IntArray, shades: Sequence[str]
) -> Panel:
    """One panel; thresholds that share a row show the worst of them: of alarms the first, of torque the last."""
    x, y = np.log10(1e3 * period_s * np.array(plane.n)), np.log10(plane.gamma_nm)
    panel = Panel((left, _TOP, _WIDE, _HIGH), (x[0], x[-1]), (y[0], y[-1]))
    step = max(1, len(ranks) // _ROWS)
    first = np.arange(0, len(ranks), step)
    shown = ranks[first if shades is _ALARMS else np.minimum(first + step - 1, len(ranks) - 1)]
    borders = np.concatenate([x[:1], (x[1:] + x[:-1]) / 2, x[-1:]])
    _shade(panel, shown, shades, borders, np.linspace(*panel.y_range, len(shown) + 1))
    panel.y_axis(words, decades=True)
    panel.x_axis("persistence, ms", decades=True)
    return panel


def _rules(panel: Panel, plane: JointPlane, period_s: float, unit: str) -> None:
    """The frontier as dots, the configured rule as a square and the recommended one as a diamond."""
    at = np.array([_place(panel, point, period_s) for point in plane.frontier]).reshape(-1, 2)
    panel.dots(at[:, 0], at[:, 1], "rule-edge")
    panel.dots(at[:, 0], at[:, 1], "rule-dot")
    for point, path in ((plane.configured, "M-5-5h10v10h-10z"), (plane.chosen, "M0-7L7 0L0 7L-7 0z")):
        if point is not None:
            x, y = _place(panel, point, period_s)
            mark = Markup('<path class="rule" transform="translate({:.1f} {:.1f})" d="{}"><title>{}</title></path>')
            panel.marks.append(mark.format(panel.px(x), panel.py(y), path, _words(point, period_s, unit)))


def _place(panel: Panel, point: PlanePoint, period_s: float) -> tuple[float, float]:
    """Where a rule lies in a panel, at its edge where it lies outside."""
    x, y = log10(1e3 * period_s * point.n), log10(point.gamma_nm)
    return float(np.clip(x, *panel.x_range)), float(np.clip(y, *panel.y_range))


def _words(point: PlanePoint, period_s: float, unit: str) -> str:
    torque = "no push" if point.torque_nm is None else f"pushes from {point.torque_nm:g} {unit}"
    rule = f"γ {point.gamma_nm:g} {unit}, n {point.n} ({1e3 * period_s * point.n:.0f} ms)"
    return f"{rule}: {point.alarms} alarms, {torque}"


def _alarm_ranks(plane: JointPlane) -> IntArray:
    """(thresholds, persistences) shade of each rule by its alarms an hour; -1: not known."""
    alarms = np.array(plane.alarms, dtype=np.float64)
    if plane.clean_hours <= 0:
        return np.full(alarms.shape, -1)
    return np.asarray(np.searchsorted(_RATES, alarms / plane.clean_hours, side="left"), dtype=np.int64)


def _log_ranks(values: FloatArray, known: FloatArray) -> IntArray:
    """Shade of each value, in equal steps of the logarithm from the least to the greatest known; -1: not finite."""
    low, high = (float(known.min()), float(known.max())) if known.size else (1.0, 1.0)
    finite = np.isfinite(values)
    share = np.log(np.maximum(values, low, where=finite, out=np.full(values.shape, low)) / low)
    ranks = (share / (np.log(high / low) or 1.0) * len(_SHADES)).astype(np.int64)
    return np.where(finite & (known.size > 0), np.minimum(len(_SHADES) - 1, ranks), -1)


def _shade(panel: Panel, ranks: IntArray, shades: Sequence[str], x: FloatArray, y: FloatArray) -> None:
    """Cells (rows, columns) by their shade, -1 in the colour of what is not known, below that none."""
    for rank, colour in enumerate((_UNKNOWN, *shades), -1):
        panel.cells(ranks == rank, x, y, colour)


def force_map_plot(found: ForceMap, label: str) -> Markup:
    """The force over the space driven through, from above and from the side, and a key.

    Cells behind each other are one square; it shows the one that needs the most force, as a shade and, where the
    squares are large enough, as a number.

    Args:
        found: of one log.
        label: for those who cannot see the drawing; any text.

    Returns:
        The drawing; empty without cells.
    """
    if not found.cells:
        return Markup()
    known = np.array([cell.force_n for cell in found.cells if cell.force_n is not None])
    second = _LEFT + _SIZE + _GAP
    views = ((1, "from above: y, m", _LEFT), (2, "from the side: z, m", second + _LEFT))
    panels = [_space(found, upwards, words, left, known) for upwards, words, left in views]
    panels[-1].marks += _key(known, 2 * second)
    return drawing(round(2 * second + _KEY), round(_TOP + _SIZE + 36), label, panels, "", "plot forces", False)


def _space(found: ForceMap, upwards: int, words: str, left: float, known: FloatArray) -> Panel:
    """One view: across is x, upwards y or z."""
    centres = np.array([(cell.centre_m[0], cell.centre_m[upwards]) for cell in found.cells])
    low = centres.min(axis=0) - found.cell_m / 2
    column, row = np.rint((centres - centres.min(axis=0)) / found.cell_m).astype(np.int64).T
    worst = np.full((row.max() + 1, column.max() + 1), -np.inf)
    np.maximum.at(worst, (row, column), [np.inf if c.force_n is None else c.force_n for c in found.cells])
    extent = found.cell_m * max(worst.shape)
    panel = Panel((left, _TOP, _SIZE, _SIZE), (low[0], low[0] + extent), (low[1], low[1] + extent))
    panel.y_axis(words)
    panel.x_axis("x, m")
    ranks = np.where(worst == -np.inf, -2, _log_ranks(worst, known))
    x, y = (start + found.cell_m * np.arange(count + 1) for start, count in zip(low, worst.shape[::-1], strict=True))
    _shade(panel, ranks, _SHADES, x, y)
    if _SIZE * found.cell_m / extent >= _NUMBERED:
        numbers = "".join(_numbers(panel, ranks, worst, (x[:-1] + x[1:]) / 2, (y[:-1] + y[1:]) / 2))
        panel.marks.append(f'<g class="numbers" text-anchor="middle">{numbers}</g>')
    return panel


def _numbers(panel: Panel, ranks: IntArray, worst: FloatArray, x: FloatArray, y: FloatArray) -> Iterator[str]:
    """The force of each square, N, at its centre; a dash where none is noticed."""
    for row, column in np.argwhere(ranks >= -1):
        rank = ranks[row, column]
        pale = ' class="on-pale"' if not 0 <= rank < _DARK else ""
        number = significant(worst[row, column], 2) if rank >= 0 else "–"
        yield f'<text{pale} x="{panel.px(x[column]):.0f}" y="{panel.py(y[row]) + 4:.0f}">{number}</text>'


def _key(known: FloatArray, left: float) -> Iterator[str]:
    """Which shade is which force, N."""
    yield f'<text x="{left:.0f}" y="13">needs up to, N</text>'
    low, high = (known.min(), known.max()) if known.size else (1.0, 1.0)
    rows = [(s, significant(low * (high / low) ** (k / len(_SHADES)), 2)) for k, s in enumerate(_SHADES, 1)]
    for k, (shade, words) in enumerate([*rows, (_UNKNOWN, "blind")]):
        y = _TOP + 20 * k
        yield f'<rect x="{left:.0f}" y="{y:.0f}" width="16" height="16" fill="{shade}" stroke="{_EDGE}"/>'
        yield f'<text x="{left + 22:.0f}" y="{y + 12:.0f}">{words}</text>'
