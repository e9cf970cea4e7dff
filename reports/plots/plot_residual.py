"""One joint's residual: over the whole log, against speed and position, how it is spread, how long it remembers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from collaudit.core.data.audit_result import Collision, NearMiss
from collaudit.core.data.signals import State
from collaudit.core.numeric.arrays import BoolArray, FloatArray, equal_runs, run_bounds
from collaudit.reports.plots.joint_trace import JointTrace, column_edges, column_extremes, column_shares, thin
from collaudit.reports.plots.svg import Panel, drawing

_LONG_WIDTH, _LONG_HEIGHT = 1000, 84
_COLUMNS = 200
_BAR_HEIGHT = 100


def draw_overview(
    trace: JointTrace, alarms: Sequence[Collision], near_misses: Sequence[NearMiss], name: str, label: str
) -> tuple[Markup, float, str | None]:
    """Residual, ±γ, events and what was not judged, without any text.

    Args:
        trace: of the joint, one sample at least.
        alarms, near_misses: of this joint.
        name: id of the drawing, unique in the page.
        label: text for those who cannot see it.

    Returns:
        The drawing, the torque its upper and lower edge stand for, and a note on what these leave out, if anything.
    """
    out = ~(trace.judged | trace.standing)
    kinds = ((out, "curve-out"), (trace.standing, "curve-standing"), (trace.judged, "curve"))
    edges = column_edges(len(trace.time_s), _COLUMNS)
    borders = np.append(trace.time_s, trace.time_s[-1] + trace.period_s)[edges]
    extremes = [column_extremes(trace.residual_nm, mask, edges) for mask, _ in kinds]
    largest = [float(np.nanmax(np.abs(sides), initial=0.0)) for sides in extremes]
    peaks = [a.peak_nm for a in alarms] + [m.peak_nm for m in near_misses]
    height, beyond = _height(trace, peaks, max(largest[1:]), largest[0])
    panel = Panel((0, 0, _LONG_WIDTH, _LONG_HEIGHT), (min(0.0, trace.time_s[0]), trace.time_s[-1]), (-height, height))
    for mask, kind in ((trace.standing, "shade-standing"), (out, "shade-out")):
        starts, stops = run_bounds(column_shares(mask, edges) >= 0.5)
        panel.shade(borders[starts], borders[stops], kind)
    middle = trace.time_s[(edges[:-1] + edges[1:]) // 2]
    for (low, high), (_, kind) in zip(extremes, kinds, strict=True):
        panel.columns(middle, low, high, kind)
    _, gamma = column_extremes(trace.gamma_nm.astype(np.float64), np.ones(len(trace.time_s), np.bool_), edges)
    for sign in (-1, 1):
        panel.line(middle, sign * gamma, "gamma")
    for events, kind in ((near_misses, "mark-near"), (alarms, "mark-alarm")):
        panel.moments([event.onset_s for event in events], kind)
    return drawing(_LONG_WIDTH, _LONG_HEIGHT, label, [panel], name, "plot stretch"), height, beyond


def _height(trace: JointTrace, peaks_nm: Sequence[float], judged: float, largest: float) -> tuple[float, str | None]:
    """What the axis must show: all that was judged, ±γ, every event; the rest when it is not far more.

    Args:
        trace: of the joint.
        peaks_nm: of its events.
        judged, largest: the largest residual that was judged, and that was not.
    """
    wanted = [1.12 * abs(peak) for peak in peaks_nm] + [1.12 * judged]
    wanted += [1.3 * float(np.fmax.reduce(trace.gamma_nm, initial=0.0))]
    height = max(wanted) or 1.12 * largest or 1.0
    if 1.12 * largest <= 2 * height:
        return max(height, 1.12 * largest), None
    out = ~(trace.judged | trace.standing)
    beyond = int(np.count_nonzero(np.abs(trace.residual_nm[out]) > height))
    return height, f"{beyond} samples that were not judged lie outside the axis, the largest at {largest:.4g}"


def coverage_bar(trace: JointTrace, label: str) -> Markup:
    """One joint's time as stacked shares: judged at the bottom, then friction known as a range, not judged, no data.

    Args:
        trace: of the joint.
        label: text for those who cannot see the bar.
    """
    gap, judged, standing = trace.state == State.GAP, trace.judged, trace.standing
    parts = {"judged": judged, "standing": standing, "out": ~(judged | standing | gap), "gap": gap}
    edges = column_edges(len(trace.state), _LONG_WIDTH)
    top = np.zeros(len(edges) - 1)
    shapes: list[Markup] = []
    for kind, mask in parts.items():
        share = column_shares(mask, edges)
        top = top + share
        if share.any():
            path = _path(np.rint(_BAR_HEIGHT * top).astype(int))
            shapes.insert(0, Markup('<path class="{}" d="{}"/>').format(kind, path))
    return Markup(
        '<svg class="bar" viewBox="0 0 {} {}" preserveAspectRatio="none" role="img" aria-label="{}">{}</svg>'
    ).format(_LONG_WIDTH, _BAR_HEIGHT, label, Markup().join(shapes))


def _path(top: NDArray[np.int_]) -> str:
    """All below a step line, as steps; what is drawn after it covers what is not its own."""
    x = np.rint(np.linspace(0, _LONG_WIDTH, len(top) + 1)).astype(int)
    starts, _ = equal_runs(top)
    across = np.diff(np.append(x[starts], _LONG_WIDTH)).tolist()
    up = np.diff(top[starts], prepend=0).tolist()
    steps = "".join(f"v{-rise}h{run}" for rise, run in zip(up, across, strict=True))
    return f"M0 {_BAR_HEIGHT}{steps}V{_BAR_HEIGHT}z"


_AGAINST_COLUMNS = 24
_LEAST_IN_COLUMN = 5  # samples a column's spread is read from
_MOST_AGAINST = 50_000
_SHARES = (0.0, 0.05, 0.5, 0.95, 1.0)
_AGAINST_WIDTH, _AGAINST_HEIGHT = 780, 150
_CYCLE_COLUMNS, _CYCLE_POINTS = 120, 400


def draw_against(trace: JointTrace, unit: str, speed_unit: str, name: str, label: str) -> Markup | None:
    """Median, middle 90 % and extremes of the judged residual in columns of speed and of position.

    Of a long log fifty thousand samples, evenly spread, stand for all.

    Args:
        trace: of the joint.
        unit: of its torque.
        speed_unit: rad/s, or m/s where it slides.
        name: id of the drawing, unique in the page.
        label: text for those who cannot see it.

    Returns:
        The drawing, or None where nothing was judged.
    """
    rows = np.arange(0, len(trace.time_s), max(1, len(trace.time_s) // _MOST_AGAINST))
    signals = (trace.residual_nm, trace.velocity_rad_s, trace.position_rad)
    known = trace.state[rows] == State.JUDGED
    for signal in signals:
        known &= np.isfinite(signal[rows])
    rows = rows[known]
    if rows.size < 10 * _LEAST_IN_COLUMN:
        return None
    residual = trace.residual_nm[rows]
    limit = (min(0.0, 1.05 * float(residual.min())), max(0.0, 1.05 * float(residual.max())))
    panels = []
    for left, x, words in (
        (46, trace.velocity_rad_s, f"speed, {speed_unit}"),
        (426, trace.position_rad, f"position, {speed_unit.removesuffix('/s')}"),
    ):
        values = x[rows].astype(np.float64)
        panel = Panel((left, 18, 346, _AGAINST_HEIGHT - 52), (float(values.min()), float(values.max())), limit)
        panel.y_axis(f"residual, {unit}")
        panel.x_axis(words, 5)
        panel.level(0.0, "zero")
        _columns(panel, values, residual)
        panels.append(panel)
    return drawing(_AGAINST_WIDTH, _AGAINST_HEIGHT, label, panels, name)


def draw_cycles(trace: JointTrace, alarms: Sequence[Collision], unit: str, name: str, label: str) -> Markup | None:
    """The residual of all cycles over their path as a band, over it the one with the strongest alarm; places of alarms.

    Args:
        trace: of the joint.
        alarms: of this joint.
        unit: of its torque.
        name: id of the drawing, unique in the page.
        label: text for those who cannot see it.

    Returns:
        The drawing; None where nothing repeats, or nothing was judged.
    """
    if trace.cycle is None:
        return None
    number, place = trace.cycle
    rows = np.flatnonzero(np.isfinite(place) & trace.judged & np.isfinite(trace.residual_nm))
    if rows.size < 10 * _LEAST_IN_COLUMN:
        return None
    some = rows[:: max(1, rows.size // (2 * _MOST_AGAINST))]
    residual = trace.residual_nm[some]
    found = np.searchsorted(trace.time_s, [alarm.onset_s + 0.5 * alarm.duration_s for alarm in alarms])
    own = rows[:0]
    if alarms:
        worst = int(np.argmax([abs(alarm.peak_nm) / alarm.gamma_nm for alarm in alarms]))
        own = rows[number[rows] == number[found[worst]]] if number[found[worst]] >= 0 else own
    seen = np.concatenate([residual, trace.residual_nm[own]])
    limit = (min(0.0, 1.05 * float(seen.min())), max(0.0, 1.05 * float(seen.max())))
    panel = Panel((46, 18, _AGAINST_WIDTH - 54, _AGAINST_HEIGHT - 52), (0.0, 1.0), limit)
    panel.y_axis(f"residual, {unit}")
    panel.x_axis("share of the path")
    panel.level(0.0, "zero")
    _columns(panel, place[some].astype(np.float64), residual, _CYCLE_COLUMNS)
    panel.line(*thin(place[own].astype(np.float64), trace.residual_nm[own], _CYCLE_POINTS), "curve")
    panel.moments(place[found][np.isfinite(place[found])].tolist(), "mark-alarm")
    return drawing(_AGAINST_WIDTH, _AGAINST_HEIGHT, label, [panel], name)


def _columns(panel: Panel, x: FloatArray, residual: FloatArray, columns: int = _AGAINST_COLUMNS) -> None:
    """Extremes, 5 to 95 % and the median; nothing is drawn across what was never visited."""
    edges = np.linspace(float(x.min()), float(x.max()) + 1e-12, columns + 1)
    column = np.minimum(np.searchsorted(edges, x, side="right") - 1, columns - 1)
    part = np.full((columns, 5), np.nan)
    for k in range(columns):
        inside = residual[column == k]
        if inside.size:
            part[k] = np.quantile(inside, _SHARES, method="nearest")
        if inside.size < _LEAST_IN_COLUMN:
            part[k, 1:4] = np.nan
    at = (edges[:-1] + edges[1:]) / 2
    panel.columns(at, part[:, 0], part[:, 4], "curve-out")
    panel.columns(at, part[:, 1], part[:, 3], "middle")
    panel.line(at, part[:, 2], "measured")


_SMALL_WIDTH, _SMALL_HEIGHT = 170, 56
_SMALL_BOX = (0, 2, _SMALL_WIDTH, _SMALL_HEIGHT - 4)
_BINS = 41
_PIECES = 40
_LAG_S = 0.5
_LAGS = 60
_MOST_CORRELATED = 131_072
_LEAST = 100


def draw_histogram(trace: JointTrace, name: str, label: str) -> Markup | None:
    """Judged residual within ±1.2 γ (all of it without γ); None where too little was judged."""
    known = _known(trace)
    if np.count_nonzero(known) < _LEAST:
        return None
    gamma = float(np.fmin.reduce(trace.gamma_nm, initial=np.inf))
    reach = 1.2 * gamma
    if not np.isfinite(reach):
        reach = float(np.abs(trace.residual_nm[known]).max()) or 1.0
    counts, edges = np.histogram(np.clip(trace.residual_nm[known], -reach, reach), _BINS, (-reach, reach))
    panel = Panel(_SMALL_BOX, (-reach, reach), (0.0, float(counts.max())))
    across, up = np.repeat(edges, 2)[1:-1], np.repeat(counts, 2).astype(np.float64)
    panel.area(across, np.zeros(up.size), up, "bar-fill")
    panel.moments([-gamma, gamma] if np.isfinite(gamma) else [], "gamma")
    return drawing(_SMALL_WIDTH, _SMALL_HEIGHT, label, [panel], name)


def draw_autocorrelation(trace: JointTrace, name: str, label: str) -> Markup | None:
    """Autocorrelation of the judged residual up to half a second; None where no judged stretch is twice that long."""
    lags, values = autocorrelation(trace)
    if lags.size == 0:
        return None
    panel = Panel(_SMALL_BOX, (0.0, float(lags[-1])), (min(-0.2, float(values.min())), 1.0))
    panel.level(0.0, "zero")
    panel.line(lags, values, "curve")
    return drawing(_SMALL_WIDTH, _SMALL_HEIGHT, label, [panel], name)


def autocorrelation(trace: JointTrace) -> tuple[FloatArray, FloatArray]:
    """Lags, s, and correlation (k,) of the judged residual less its mean, over pairs that were both judged."""
    known = _known(trace)[:_MOST_CORRELATED]
    if np.count_nonzero(known) < _LEAST:
        return np.empty(0), np.empty(0)
    x = np.where(known, trace.residual_nm[: known.size], 0.0)
    x = np.where(known, x - x[known].mean(), 0.0)
    samples = np.unique(np.linspace(0, min(_LAG_S / trace.period_s, known.size / 2), _LAGS).astype(int))
    sums, pairs = (np.array([y[k:] @ y[: y.size - k] for k in samples]) for y in (x, known.astype(np.float64)))
    enough = pairs >= _LEAST / 2
    if not enough.any() or sums[0] <= 0:
        return np.empty(0), np.empty(0)
    covariance = sums[enough] / pairs[enough]
    return samples[enough] * trace.period_s, covariance / covariance[0]


def draw_trend(trace: JointTrace, name: str, label: str) -> Markup | None:
    """RMS of the judged residual in forty equal stretches of the log; None where too little was judged."""
    known = _known(trace)
    if np.count_nonzero(known) < _LEAST:
        return None
    edges = column_edges(known.size, _PIECES)
    power, counts = (np.add.reduceat(x, edges[:-1]) for x in (np.where(known, trace.residual_nm**2, 0.0), 1.0 * known))
    rms = np.sqrt(np.divide(power, counts, out=np.full(_PIECES, np.nan), where=counts > 0))
    middle = trace.time_s[(edges[:-1] + edges[1:]) // 2]
    panel = Panel(
        _SMALL_BOX,
        (trace.time_s[0], trace.time_s[-1]),
        (0.0, 1.1 * float(np.nanmax(rms)) or 1.0),
    )
    panel.line(middle, rms, "curve")
    return drawing(_SMALL_WIDTH, _SMALL_HEIGHT, label, [panel], name)


def _known(trace: JointTrace) -> BoolArray:
    return trace.judged & np.isfinite(trace.residual_nm)
