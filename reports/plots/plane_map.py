"""One joint's (γ, n) plane as a drawing: alarms an hour and the smallest noticeable torque, with the rules on it.

Drawn in a few shades, each of them one path of strokes as wide as a row of thresholds.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from math import log, log10

import numpy as np
from markupsafe import Markup

from collaudit.core.data.rule_study_result import JointPlane, PlanePoint
from collaudit.core.numeric.arrays import BoolArray, IntArray
from collaudit.core.numeric.runs import run_bounds

_WIDTH, _HEIGHT, _GAP, _LEFT, _TOP, _BOTTOM = 380.0, 204.0, 24.0, 46.0, 20.0, 34.0
#: Shades from little to much, and the colour of what is not known.
_ALARMS = ("#f4f7fa", "#d3e0ec", "#a9c3da", "#7aa3c5", "#4b81ad", "#255f90", "#0b3f6e")
_TORQUE = ("#0d4f3c", "#2a6f57", "#4c8f75", "#74ae95", "#a0cbb6", "#cde5d9", "#eef7f2")
_UNKNOWN = "#c9c9c9"
#: Rows that thresholds are drawn in.
_ROWS = 30
#: By how much strokes are wider than rows, pixels: no seam shows where a browser scales them.
_OVERLAP = 0.5
_RATES = (0.0, 0.1, 1.0, 10.0, 100.0, 1000.0)


def plane_map(plane: JointPlane, period_s: float, label: str, unit: str = "N·m") -> Markup:
    """Two panels over persistence (ms) and threshold (N·m), both logarithmic, on one axis of thresholds.

    Args:
        plane: of one joint.
        period_s: sample period, s.
        label: for those who cannot see the drawing; any text.
        unit: of what the joint's drive exerts.
    """
    second = _LEFT + _WIDTH + _GAP
    alarms = _shaded(plane, _LEFT, _alarm_ranks(plane), _ALARMS, False)
    pushes = _shaded(plane, second, _torque_ranks(plane), _TORQUE, True)
    body = _panel(plane, period_s, _LEFT, alarms, unit) + _panel(plane, period_s, second, pushes, unit)
    pushed, levelled = f"smallest push noticed, {unit}", f"γ, {unit}"
    titles = [(_LEFT + 16, 13.0, "alarms an hour"), (second, 13.0, pushed), (2, 13.0, levelled)]
    levels = [
        (_LEFT - 4, _TOP + _HEIGHT - _place(plane.gamma_nm, value, _HEIGHT) + 4, f"{value:g}")
        for value in _round(plane.gamma_nm[0], plane.gamma_nm[-1])
    ]
    head = Markup('<svg class="plot plane" viewBox="0 0 {} {}" role="img" aria-label="{}">').format(
        round(second + _WIDTH + 10), round(_TOP + _HEIGHT + _BOTTOM), label
    )
    return head + body + _texts(titles, "start") + _texts(levels, "end") + Markup("</svg>")


def _panel(plane: JointPlane, period_s: float, left: float, shaded: Markup, unit: str) -> Markup:
    """One shaded panel with its axis of time and the rules on it."""
    at = {
        point: (
            left + _place(plane.n, point.n, _WIDTH),
            _TOP + _HEIGHT - _place(plane.gamma_nm, point.gamma_nm, _HEIGHT),
        )
        for point in (*plane.frontier, plane.configured, plane.chosen)
        if point is not None
    }
    out = shaded
    dots = _dots([at[point] for point in plane.frontier])
    for colour, width in (("#8a0018", 5.4), ("#fff", 3.8)):
        out += Markup('<path d="{}" stroke="{}" stroke-width="{}" stroke-linecap="round"/>').format(dots, colour, width)
    for point, path in ((plane.configured, "M-5-5h10v10h-10z"), (plane.chosen, "M0-7L7 0L0 7L-7 0z")):
        if point is not None:
            out += Markup(
                '<path transform="translate({:.1f} {:.1f})" d="{}" fill="none" stroke="#8a0018" stroke-width="2">'
                "<title>{}</title></path>"
            ).format(*at[point], path, _words(point, period_s, unit))
    times = [
        (left + _place(plane.n, value / (1e3 * period_s), _WIDTH), _TOP + _HEIGHT + 14, f"{value:g}")
        for value in _round(plane.n[0] * period_s * 1e3, plane.n[-1] * period_s * 1e3)
    ]
    return out + _texts([*times, (left + 0.5 * _WIDTH, _TOP + _HEIGHT + 29, "persistence, ms")], "middle")


def _dots(at: Sequence[tuple[float, float]]) -> str:
    """Strokes without length, whose round ends are dots."""
    whole = [(round(x), round(y)) for x, y in at]
    return "".join(f"m{x - a} {y - b}h0" for (a, b), (x, y) in pairwise([(0, 0), *whole]))


def _words(point: PlanePoint, period_s: float, unit: str) -> str:
    torque = "no push" if point.torque_nm is None else f"pushes from {point.torque_nm:g} {unit}"
    rule = f"γ {point.gamma_nm:g} {unit}, n {point.n} ({1e3 * period_s * point.n:.0f} ms)"
    return f"{rule}: {point.alarms} alarms, {torque}"


def _texts(texts: Sequence[tuple[float, float, str]], anchor: str) -> Markup:
    """Texts by their place, pixels, in the size and colour that the page gives to drawings."""
    out = (Markup('<text x="{:.0f}" y="{:.0f}">{}</text>').format(*each) for each in texts)
    return Markup('<g text-anchor="{}">{}</g>').format(anchor, Markup().join(out))


def _round(low: float, high: float) -> Iterator[float]:
    """1, 2 and 5 times powers of ten in a range."""
    for power in range(int(log10(low)) - 2, int(log10(high)) + 2):
        for digit in (1, 2, 5):
            value = digit * 10.0**power
            if low <= value <= high:
                yield value


def _place(values: Sequence[float], value: float, length: float) -> float:
    """Where a value lies between the first and the last, in the logarithm."""
    span = log(values[-1] / values[0]) or 1.0
    return length * min(1.0, max(0.0, log(value / values[0]) / span))


def _edges(values: Sequence[float], length: float) -> list[float]:
    """Borders between neighbours, and the two ends."""
    at = [_place(values, value, length) for value in values]
    return [0.0, *(0.5 * (a + b) for a, b in pairwise(at)), length]


def _shaded(plane: JointPlane, left: float, ranks: IntArray, shades: Sequence[str], worst_last: bool) -> Markup:
    """A panel of rows of one height, shade by shade, on the colour of what is not known.

    Thresholds that share a row show the worst of them: of alarms the first, of torque the last.
    """
    step = max(1, len(ranks) // _ROWS)
    first = np.arange(0, len(ranks), step)
    shown = ranks[np.minimum(first + step - 1, len(ranks) - 1) if worst_last else first]
    edges = [round(left + x) for x in _edges(plane.n, _WIDTH)]
    height = _HEIGHT / len(shown)
    out = Markup()
    for rank, colour in enumerate((_UNKNOWN, *shades), -1):
        path = row_strokes(shown == rank, edges, height)
        out += Markup('<path stroke="{}" stroke-width="{:g}" d="{}"/>').format(colour, height + _OVERLAP, path)
    return out


def _alarm_ranks(plane: JointPlane) -> IntArray:
    """(thresholds, persistences) shade of each rule by its alarms an hour; -1: not known."""
    alarms = np.array(plane.alarms, dtype=np.float64)
    if plane.clean_hours <= 0:
        return np.full(alarms.shape, -1)
    return np.asarray(np.searchsorted(_RATES, alarms / plane.clean_hours, side="left"), dtype=np.int64)


def _torque_ranks(plane: JointPlane) -> IntArray:
    """(thresholds, persistences) shade of each rule by the torque that it notices; -1: none."""
    torque = np.array([[np.nan if t is None else t for t in row] for row in plane.torque_nm])
    known = torque[torque > 0]
    if known.size == 0:
        return np.full(torque.shape, -1)
    low, high = float(known.min()), float(known.max())
    share = np.log(np.maximum(np.nan_to_num(torque, nan=low), low) / low) / (log(high / low) or 1.0)
    ranks = np.minimum(len(_TORQUE) - 1, (share * len(_TORQUE)).astype(np.int64))
    return np.where(np.isfinite(torque), ranks, -1)


def row_strokes(marked: BoolArray, x: Sequence[int], height: float) -> str:
    """Path data of a stroke for each stretch of marked cells in a row, the first row at the bottom of the panel.

    Args:
        marked: (rows, columns) cells.
        x: (columns + 1,) borders of the columns, pixels.
        height: of a row, which is the width of its strokes, pixels.
    """
    path = []
    for row, cells in enumerate(marked):
        y = _TOP + _HEIGHT - height * (row + 0.5)
        path += [f"M{x[a]} {y:g}H{x[b]}" for a, b in zip(*run_bounds(cells), strict=True)]
    return "".join(path)
