"""One joint's (γ, n) plane as a drawing: alarms an hour and the smallest noticeable torque, with the rules on it.

Drawn in a few shades, to whole pixels: neighbouring cells that share one become one rectangle, all of a shade one path.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from math import log, log10

from markupsafe import Markup

from collaudit.core.data.rule_study_result import JointPlane, PlanePoint

_WIDTH, _HEIGHT, _GAP, _LEFT, _TOP, _BOTTOM = 380.0, 210.0, 70.0, 46.0, 20.0, 34.0
#: Shades from little to much, and the colour of what is not known.
_ALARMS = ("#f4f7fa", "#d3e0ec", "#a9c3da", "#7aa3c5", "#4b81ad", "#255f90", "#0b3f6e")
_TORQUE = ("#0d4f3c", "#2a6f57", "#4c8f75", "#74ae95", "#a0cbb6", "#cde5d9", "#eef7f2")
_UNKNOWN = "#c9c9c9"
#: Rows that thresholds are drawn in.
_ROWS = 50
_RATES = (0.0, 0.1, 1.0, 10.0, 100.0, 1000.0)


def plane_map(plane: JointPlane, period_s: float, label: str) -> Markup:
    """Two panels over persistence (ms) and threshold (N·m), both logarithmic.

    Args:
        plane: of one joint.
        period_s: sample period, s.
        label: for those who cannot see the drawing; any text.
    """
    total = 2 * (_LEFT + _WIDTH) + _GAP
    head = Markup('<svg class="plot plane" viewBox="0 0 {} {}" role="img" aria-label="{}">').format(
        round(total), round(_TOP + _HEIGHT + _BOTTOM), label
    )
    known = sorted(t for row in plane.torque_nm for t in row if t)
    panels = (
        (_LEFT, "alarms an hour", lambda g, c: _alarm_shade(plane, g, c), False),
        (2 * _LEFT + _WIDTH + _GAP, "smallest push noticed, N·m", lambda g, c: _torque_shade(plane, g, c, known), True),
    )
    body = Markup()
    for left, title, shade, worst_last in panels:
        body += _panel(plane, period_s, left, title, shade, worst_last)
    return head + body + Markup("</svg>")


def _panel(
    plane: JointPlane, period_s: float, left: float, title: str, shade: Callable[[int, int], str], worst_last: bool
) -> Markup:
    """One panel; thresholds that share a row show the worst of them: of alarms the first, of torque the last."""
    out = Markup('<text x="{}" y="13" font-size="12" fill="currentColor">{}</text>').format(round(left) + 16, title)
    edges_x = [left + x for x in _edges(plane.n, _WIDTH)]
    edges_y = [_TOP + _HEIGHT - y for y in _edges(plane.gamma_nm, _HEIGHT)]
    rows = list(range(0, len(plane.gamma_nm), max(1, len(plane.gamma_nm) // _ROWS)))
    edges_y = [edges_y[g] for g in [*rows, len(plane.gamma_nm)]]
    if worst_last:
        rows = [g - 1 for g in [*rows[1:], len(plane.gamma_nm)]]
    shades = [[shade(g, c) for c in range(len(plane.n))] for g in rows]
    for colour, blocks in sorted(_blocks(shades).items()):
        path = "".join(
            f"M{edges_x[x]:.0f} {edges_y[top]:.0f}H{edges_x[stop]:.0f}V{edges_y[base]:.0f}H{edges_x[x]:.0f}"
            for x, stop, base, top in blocks
        )
        out += Markup('<path fill="{}" stroke="{}" stroke-width=".6" d="{}z"/>').format(colour, colour, path)
    out += _ticks(plane, period_s, left)
    at = {
        point: (
            left + _place(plane.n, point.n, _WIDTH),
            _TOP + _HEIGHT - _place(plane.gamma_nm, point.gamma_nm, _HEIGHT),
        )
        for point in (*plane.frontier, plane.configured, plane.chosen)
        if point is not None
    }
    dots = "".join("M{:.1f} {:.1f}h0".format(*at[point]) for point in plane.frontier)
    for colour, width in (("#8a0018", 5.4), ("#fff", 3.8)):
        out += Markup('<path d="{}" stroke="{}" stroke-width="{}" stroke-linecap="round"/>').format(dots, colour, width)
    for point, path in ((plane.configured, "M-5-5h10v10h-10z"), (plane.chosen, "M0-7L7 0L0 7L-7 0z")):
        if point is not None:
            out += Markup(
                '<path transform="translate({:.1f} {:.1f})" d="{}" fill="none" stroke="#8a0018" stroke-width="2">'
                "<title>{}</title></path>"
            ).format(*at[point], path, _words(point, period_s))
    return out


def _words(point: PlanePoint, period_s: float) -> str:
    torque = "no push" if point.torque_nm is None else f"pushes from {point.torque_nm:g} N·m"
    return f"γ {point.gamma_nm:g} N·m, n {point.n} ({1e3 * period_s * point.n:.0f} ms): {point.alarms} alarms, {torque}"


def _ticks(plane: JointPlane, period_s: float, left: float) -> Markup:
    out = Markup()
    for value in _round(plane.n[0] * period_s * 1e3, plane.n[-1] * period_s * 1e3):
        x = left + _place(plane.n, value / (1e3 * period_s), _WIDTH)
        out += _text(x, _TOP + _HEIGHT + 14, f"{value:g}", "middle")
    out += _text(left + 0.5 * _WIDTH, _TOP + _HEIGHT + 29, "persistence, ms", "middle")
    for value in _round(plane.gamma_nm[0], plane.gamma_nm[-1]):
        y = _TOP + _HEIGHT - _place(plane.gamma_nm, value, _HEIGHT)
        out += _text(left - 4, y + 4, f"{value:g}", "end")
    return out + _text(left - 44, _TOP - 6, "γ, N·m", "start")


def _text(x: float, y: float, text: str, anchor: str) -> Markup:
    return Markup('<text x="{:.1f}" y="{:.1f}" font-size="11" text-anchor="{}" fill="currentColor">{}</text>').format(
        x, y, anchor, text
    )


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


def _blocks(shades: Sequence[Sequence[str]]) -> dict[str, list[tuple[int, int, int, int]]]:
    """Rectangles of one colour: first column, column after, first row, row after.

    Neighbours of a row are one rectangle, and so are those of neighbouring rows that begin and end alike.
    """
    done: dict[str, list[tuple[int, int, int, int]]] = {}
    open_: dict[tuple[int, int, str], int] = {}
    for g in range(len(shades) + 1):
        here = set(_stretches(shades[g])) if g < len(shades) else set()
        for key in sorted(open_.keys() - here):
            start, stop, colour = key
            done.setdefault(colour, []).append((start, stop, open_.pop(key), g))
        for key in here - open_.keys():
            open_[key] = g
    return done


def _stretches(colours: Sequence[str]) -> Iterator[tuple[int, int, str]]:
    """Neighbours of one colour together."""
    start = 0
    for k in range(1, len(colours) + 1):
        if k == len(colours) or colours[k] != colours[start]:
            yield start, k, colours[start]
            start = k


def _alarm_shade(plane: JointPlane, g: int, c: int) -> str:
    if plane.clean_hours <= 0:
        return _UNKNOWN
    rate = plane.alarms[g][c] / plane.clean_hours
    return _ALARMS[sum(rate > limit for limit in _RATES)]


def _torque_shade(plane: JointPlane, g: int, c: int, known: Sequence[float]) -> str:
    torque = plane.torque_nm[g][c]
    if torque is None or not known:
        return _UNKNOWN
    if torque <= known[0]:
        return _TORQUE[0]
    share = log(torque / known[0]) / (log(known[-1] / known[0]) or 1.0)
    return _TORQUE[min(len(_TORQUE) - 1, int(share * len(_TORQUE)))]
