"""A drawing as inline SVG: panels with axes, curves and shading, whose colours are classes of the page's style.

Numbers have one decimal of a pixel, so that the same drawing always gives the same text. No text of a log is drawn:
names stand in the page around the plot.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise

import numpy as np
from markupsafe import Markup

from collaudit.core.numeric.arrays import BoolArray, FloatArray, run_bounds
from collaudit.reports.plots.joint_trace import Series

Box = tuple[float, float, float, float]
_TICK_STEPS = (1.0, 2.0, 5.0, 10.0)
_ROUGHLY = 0.65
#: By how much strokes are wider than rows of cells, pixels: no seam shows where a browser scales them.
_OVERLAP = 0.5


class Panel:
    """One plotting area; everything drawn in it is given in data units."""

    def __init__(self, box: Box, x: tuple[float, float], y: tuple[float, float]) -> None:
        """``box``: left, top, width, height in pixels; ``x``, ``y``: what its edges stand for."""
        self.box, self.x_range, self.y_range = box, _open(x), _open(y)
        self.marks: list[str] = []
        self.frame: list[str] = []

    def px(self, x: Series | Sequence[float] | float) -> FloatArray:
        """Pixels from the left."""
        low, high = self.x_range
        return self.box[0] + self.box[2] * (np.asarray(x, dtype=np.float64) - low) / (high - low)

    def py(self, y: Series | Sequence[float] | float) -> FloatArray:
        """Pixels from the top; far beyond the panel is cut to a panel's height beyond it."""
        low, high = self.y_range
        share = (np.asarray(y, dtype=np.float64) - low) / (high - low)
        return self.box[1] + self.box[3] * (1.0 - np.clip(share, -1.0, 2.0))

    def line(self, x: Series, y: Series, kind: str) -> None:
        """A curve, interrupted where ``y`` is not finite; a lone sample is a dot."""
        path = []
        for a, b in zip(*run_bounds(np.isfinite(y)), strict=True):
            xs, ys = self.px(x[a:b]), self.py(y[a:b])
            if b - a == 1:
                xs, ys = np.array([xs[0] - 0.6, xs[0] + 0.6]), np.repeat(ys, 2)
            path.append(polyline(xs, ys))
        self._path(path, kind)

    def area(self, x: Series, low: Series, high: Series, kind: str) -> None:
        """A band between two curves, interrupted where either is not finite."""
        path = []
        for a, b in zip(*run_bounds(np.isfinite(low) & np.isfinite(high)), strict=True):
            xs, up, down = self.px(x[a:b]), self.py(high[a:b]), self.py(low[a:b])
            path.append(polyline(np.concatenate([xs, xs[::-1]]), np.concatenate([up, down[::-1]])) + "z")
        self._path(path, kind)

    def columns(self, x: Series, low: Series, high: Series, kind: str) -> None:
        """A vertical stroke from ``low`` to ``high`` at each ``x``, in whole pixels, at least one long."""
        known = np.isfinite(low) & np.isfinite(high)
        xs, down, up = self.px(x[known]), np.rint(self.py(low[known])), np.rint(self.py(high[known]))
        up = np.minimum(up, down - 1.0)
        self._path([strokes(xs, down, up)] if known.any() else [], kind)

    def shade(self, starts: Series, stops: Series, kind: str) -> None:
        """Full-height stretches of time."""
        top, height = self.box[1], self.box[3]
        at = zip(self.px(starts).tolist(), self.px(stops).tolist(), strict=True)
        wide = ((a, max(round(b - a, 1), 0.5)) for a, b in at)
        self._path([f"M{a:.1f} {top:.0f}h{w:.1f}v{height:.0f}h-{w:.1f}z" for a, w in wide], kind)

    def level(self, y: float, kind: str) -> None:
        """A horizontal line."""
        left, _, width, _ = self.box
        self._path([f"M{left:.1f} {self.py(y):.1f}H{left + width:.1f}"], kind)

    def moments(self, x: Sequence[float], kind: str) -> None:
        """Vertical lines."""
        _, top, _, height = self.box
        self._path([f"M{at:.1f} {top:g}v{height:g}" for at in self.px(x).tolist()], kind)

    def dots(self, x: Series, y: Series, kind: str) -> None:
        """Round marks: strokes without length, whose width the style gives."""
        self._path([strokes(self.px(x), self.py(y), self.py(y))], kind)

    def bars(self, x: Series, low: Series, high: Series, kind: str) -> None:
        """Error bars."""
        self._path([strokes(self.px(x), self.py(low), self.py(high))], kind)

    def cells(self, marked: BoolArray, x: Series, y: Series, colour: str) -> None:
        """Marked cells (rows, columns) of a grid with these borders, rows of one height: a stroke for each stretch."""
        across, down = self.px(x), self.py(y)
        height = down[0] - down[1]
        path = [
            f"M{across[a]:.0f} {down[row] - height / 2:.1f}H{across[b]:.0f}"
            for row, cells in enumerate(marked)
            for a, b in zip(*run_bounds(cells), strict=True)
        ]
        if path:
            width = height + _OVERLAP
            self.marks.append(f'<path class="cells" stroke="{colour}" stroke-width="{width:g}" d="{"".join(path)}"/>')

    def y_axis(self, label: str, count: int = 4, decades: bool = False) -> None:
        """Ticks and grid at the left, and what the axis shows above the panel; ``decades``: it is a logarithm to 10."""
        left, top, width, _ = self.box
        values, texts = _labelled(self.y_range, count, decades)
        grid = "".join(f"M{left:.1f} {self.py(v):.1f}H{left + width:.1f}" for v in values)
        self.frame.append(f'<path class="grid" d="{grid}"/>')
        at = [(left - 5, float(self.py(value)) + 4) for value in values]
        self.frame.append(_texts(at, texts, "end"))
        self.frame.append(str(Markup('<text x="{}" y="{}">{}</text>').format(round(left), round(top - 6), label)))

    def x_axis(self, label: str, count: int = 6, decades: bool = False) -> None:
        """Ticks below the panel; the last of them names the axis; ``decades`` as above."""
        left, top, width, height = self.box
        values, texts = _labelled(self.x_range, count, decades)
        base = top + height
        marks = "".join(f"M{self.px(v):.1f} {base:.1f}v4" for v in values)
        self.frame.append(f'<path class="axis-line" d="M{left:.1f} {base:.1f}h{width:.1f}{marks}"/>')
        at = [(float(self.px(value)), base + 16) for value in values]
        self.frame.append(_texts(at, texts, "middle"))
        end = Markup('<text x="{}" y="{}" text-anchor="end">{}</text>')
        self.frame.append(str(end.format(round(left + width), round(base + 30), label)))

    def _path(self, pieces: Sequence[str], kind: str) -> None:
        if path := "".join(pieces):
            self.marks.append(f'<path class="{kind}" d="{path}"/>')


def drawing(
    width: int, height: int, label: str, panels: Sequence[Panel], name: str, kind: str = "plot", clip: bool = True
) -> Markup:
    """Panels as one ``<svg>``.

    Args:
        width, height: of its view, pixels.
        label: what it shows, for those who cannot see it; may hold any text.
        panels: drawn in order; what lies outside of one is cut off.
        name: unique in the page; letters, digits and hyphens.
        kind: its classes; with ``stretch`` it fills its place whatever the proportions, and must hold no text.
        clip: whether anything can lie outside of a panel.
    """
    body = []
    for k, panel in enumerate(panels):
        left, top, wide, high = panel.box
        body.append("".join(panel.frame))
        if clip:
            body.append(
                f'<clipPath id="{name}-clip{k}"><rect x="{left:g}" y="{top:g}" width="{wide:g}" height="{high:g}"/>'
            )
            body.append(f'</clipPath><g clip-path="url(#{name}-clip{k})">')
        body.append("".join(panel.marks) + ("</g>" if clip else ""))
    fill = Markup(' preserveAspectRatio="none"') if "stretch" in kind else ""
    head = Markup('<svg class="{}" viewBox="0 0 {} {}"{} role="img" aria-label="{}">')
    return head.format(kind, width, height, fill, label) + Markup("".join(body)) + Markup("</svg>")


def _texts(at: Sequence[tuple[float, float]], texts: Sequence[str], anchor: str) -> str:
    """Texts at places (pixels) that share their alignment."""
    each = (f'<text x="{x:.0f}" y="{y:.0f}">{text}</text>' for (x, y), text in zip(at, texts, strict=True))
    return f'<g text-anchor="{anchor}">{"".join(each)}</g>'


def _open(limits: tuple[float, float]) -> tuple[float, float]:
    """Limits with something between them."""
    low, high = (float(x) for x in limits)
    return (low, high) if high > low else (low - 0.5, low + 0.5)


def polyline(x: FloatArray, y: FloatArray) -> str:
    """A line through points.

    Args:
        x, y: (n,) pixels, n ≥ 1; rounded to tenths before steps are formed, so that no error adds up.
    """
    u, v = _tenths(x), _tenths(y)
    steps = np.stack([np.diff(u), np.diff(v)], axis=1).ravel().tolist()
    return f"M{_joined((u[0], v[0]))}" + (f"l{_joined(steps)}" if steps else "")


def strokes(x: FloatArray, y: FloatArray, end: FloatArray) -> str:
    """Vertical strokes at each ``x`` from ``y`` to ``end``, pixels (n,)."""
    u, v, w = _tenths(x), _tenths(y), _tenths(end)
    if u.size == 0:
        return ""
    across = np.diff(u, prepend=0).tolist()
    down = (v - np.concatenate(([0], w[:-1]))).tolist()
    moves = zip(across, down, (w - v).tolist(), strict=True)
    return "".join(f"m{_joined((a, b))}v{c / 10:g}" for a, b, c in moves)


def _tenths(pixels: FloatArray) -> np.ndarray:
    return np.rint(10.0 * np.asarray(pixels, dtype=np.float64)).astype(np.int64)


def _joined(tenths: Iterable[int]) -> str:
    """Tenths as numbers."""
    return " ".join(f"{value / 10:g}" for value in tenths)


def _labelled(limits: tuple[float, float], count: int, decades: bool) -> tuple[list[float], list[str]]:
    """Places and labels of an axis; of a logarithm 1, 2 and 5 times the powers of ten."""
    if not decades:
        values = ticks(*limits, count)
        return values, tick_text(values)
    powers = range(math.floor(limits[0]), math.ceil(limits[1]))
    shown = [digit * 10.0**power for power in powers for digit in (1, 2, 5)]
    shown = [value for value in shown if limits[0] <= math.log10(value) <= limits[1]]
    return [math.log10(value) for value in shown], [f"{value:g}" for value in shown]


def ticks(low: float, high: float, count: int) -> list[float]:
    """About ``count`` multiples of 1, 2 or 5 times a power of ten within the limits; none without an extent."""
    span = high - low
    if not (math.isfinite(span) and span > 0):
        return []
    rough = span / max(count, 1)
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(s * power for s in _TICK_STEPS if s * power >= _ROUGHLY * rough)
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [k * step for k in range(first, last + 1)]


def tick_text(values: Sequence[float]) -> list[str]:
    """Their labels, alike in decimals, with a true minus."""
    step = min((abs(b - a) for a, b in pairwise(values)), default=1.0)
    decimals = max(0, -math.floor(math.log10(step) + 1e-9))
    return [f"{value:.{decimals}f}".replace("-", "−") if value else "0" for value in values]
