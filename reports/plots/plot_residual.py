"""What the residual plots share: the curve in its states, shading, thresholds, and an honest axis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection

from collaudit.core.data.signals import Signals, State
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.runs import run_bounds
from collaudit.reports.plots.downsample import column_shares, thin
from collaudit.reports.plots.svg import CURVE, LIMIT, MUTED, SHADE_OUT, SHADE_STANDING, STANDING

_COLUMNS = 900


@dataclass(frozen=True, slots=True, eq=False)
class Trace:
    """One joint's residual over a stretch of the log.

    Attributes:
        time_s: (n,) ascending.
        residual_nm: (n,).
        state: (n,) codes of State.
        period_s: sample period, the width a sample is shaded with.
    """

    time_s: FloatArray
    residual_nm: FloatArray
    state: np.ndarray
    period_s: float

    @property
    def judged(self) -> BoolArray:
        """(n,) where the rule was applied."""
        return np.asarray(self.state == State.JUDGED)

    @property
    def standing(self) -> BoolArray:
        """(n,) where friction was only known as an interval."""
        return np.asarray(self.state == State.FRICTION_INTERVAL)


def trace(signals: Signals, column: int, window: slice = slice(None)) -> Trace:
    """One joint's residual, all of it or a window of samples."""
    time_s = signals.time_s
    period = float((time_s[-1] - time_s[0]) / (len(time_s) - 1)) if len(time_s) > 1 else 1.0
    return Trace(time_s[window], signals.residual_nm[window, column], signals.state[window, column], period)


def draw_residual(axes: Axes, shown: Trace, points: int) -> None:
    """The residual: dark where judged, light blue where friction is known only as a range, grey where not judged.

    The curves are not joined where one state follows another: the residual means something else there.
    """
    judged, standing = shown.judged, shown.standing
    for mask, colour, width in (
        (~judged & ~standing, MUTED, 0.6),
        (standing, STANDING, 0.8),
        (judged, CURVE, 0.9),
    ):
        if mask.any():
            time_s, values = thin(shown.time_s, np.where(mask, shown.residual_nm, np.nan), points)
            axes.plot(time_s, values, color=colour, linewidth=width)
            alone = _alone(values)
            axes.plot(time_s[alone], values[alone], linestyle="none", marker=".", markersize=2.5, color=colour)


def draw_shading(axes: Axes, shown: Trace) -> None:
    """Hatched where not judged, tinted where friction is known only as a range; behind everything else."""
    if not len(shown.time_s):
        return
    out = ~shown.judged & ~shown.standing
    _shade(axes, shown, shown.standing, SHADE_STANDING, None)
    _shade(axes, shown, out, SHADE_OUT, "////")


def draw_threshold(axes: Axes, gamma_nm: float | None, near_share: float | None = None) -> None:
    """±γ dashed and, when asked, the near-miss level dotted."""
    if gamma_nm is None or not np.isfinite(gamma_nm):
        return
    for sign in (-1, 1):
        axes.axhline(sign * gamma_nm, color=LIMIT, linewidth=0.9, linestyle=(0, (5, 2.5)))
        if near_share is not None:
            axes.axhline(sign * gamma_nm * near_share, color=LIMIT, linewidth=0.7, linestyle=(0, (1, 2)))


def set_height(axes: Axes, shown: Trace, gamma_nm: float | None, peaks_nm: tuple[float, ...] = ()) -> str | None:
    """Fit the axis to what was judged and to ±γ.

    Returns:
        A note when the axis leaves out samples that were not judged, else None.
    """
    values = np.abs(shown.residual_nm)
    seen = values[(shown.judged | shown.standing) & np.isfinite(values)]
    rest = values[~(shown.judged | shown.standing) & np.isfinite(values)]
    wanted = [1.3 * g for g in (gamma_nm,) if g is not None and np.isfinite(g)]
    wanted += [1.12 * abs(peak) for peak in peaks_nm]
    wanted += [1.12 * float(seen.max())] if seen.size else []
    largest_rest = float(rest.max()) if rest.size else 0.0
    if not wanted:
        wanted = [1.12 * largest_rest or 1.0]
    height = max(wanted)
    if largest_rest * 1.12 <= 2 * height:
        height = max(height, 1.12 * largest_rest)
    axes.set_ylim(-height, height)
    beyond = int((rest > height).sum())
    if not beyond:
        return None
    return f"{beyond} samples that were not judged lie outside the axis, the largest at {largest_rest:.4g}"


def _alone(values: FloatArray) -> BoolArray:
    """Samples with no neighbour, which a line would not show."""
    finite = np.concatenate(([False], np.isfinite(values), [False]))
    return np.asarray(finite[1:-1] & ~finite[:-2] & ~finite[2:])


def _shade(axes: Axes, shown: Trace, mask: BoolArray, colour: str, hatch: str | None) -> None:
    starts, stops = _stretches(shown, mask)
    if not len(starts):
        return
    half = shown.period_s / 2
    boxes = [[(a - half, 0), (a - half, 1), (b + half, 1), (b + half, 0)] for a, b in zip(starts, stops, strict=True)]
    shade = PolyCollection(
        boxes, facecolor=colour, edgecolor="#b5b5b5" if hatch else "none", linewidth=0, hatch=hatch, zorder=0
    )
    shade.set_transform(axes.get_xaxis_transform())
    axes.add_collection(shade, autolim=False)


def _stretches(shown: Trace, mask: BoolArray) -> tuple[FloatArray, FloatArray]:
    """Start and end times of the masked stretches; of long logs, the pixel columns that are mostly masked."""
    time_s = shown.time_s
    if len(mask) <= 4 * _COLUMNS:
        first, after = run_bounds(mask)
    else:
        edges = np.linspace(0, len(mask), _COLUMNS + 1).astype(np.int64)
        left, right = run_bounds(column_shares(mask, _COLUMNS) >= 0.5)
        first, after = edges[left], edges[right]
    return time_s[first], time_s[after - 1]
