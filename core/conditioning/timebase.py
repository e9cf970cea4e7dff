"""From recorded stamps to a uniform time base: stretches, where they lie on the grid, short holes that are bridged."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from collaudit.core.conditioning.motion_clock import pooled_period
from collaudit.core.conditioning.stamp_order import (
    clocked,
    comb_error,
    jitter_finding,
    snaps,
    through,
)
from collaudit.core.errors import NotJudgedError
from collaudit.core.findings import Finding, fact
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray, Span, marked
from collaudit.core.numeric.stats import median_of, robust_sd

MIN_SEGMENT_SAMPLES = 12
#: Of a longer gap only so much stands on the grid: memory follows what was recorded, not what was not.
MAX_VOID_S = 60.0
#: A step longer than so many sample periods lost samples: a gap, unless it is bridged. One lost sample makes two.
_GAP_PERIODS = 1.8
#: A uniform time base is at most so many times as long as the log, and so many samples more: memory is taken for it.
_MOST_TIMES, _FREE_SAMPLES = 50, 1_000_000
#: The longest step over several lost samples, and over a single one, in periods of the filter's band.
SEVERAL, _SINGLE = 0.25, 0.4
#: From this share of bridged samples on it is a warning.
_MANY = 0.05


@dataclass(frozen=True, slots=True, eq=False)
class Timebase:
    """How recorded samples map onto a uniform grid.

    Attributes:
        order: (m,) indices of the recorded samples that are used, in time order.
        stamps_s: (m,) their stamps; rebuilt where the motion tells the clock better (``motion_clock.py``).
        period_s: grid spacing in s.
        n: grid length in samples.
        raw: gap-free stretches of recorded samples (ranges into ``order``).
        grid: the same stretches on the grid.
        snap: per stretch, True when its samples *are* grid samples (stamps jitter, sampling does not);
            False when values have to be interpolated to the grid.
        places: (m,) place of each sample in its stretch; they count up by one but where samples were lost.
        bridged: (n,) grid samples that stand for lost ones.
        skipped_s: per stretch, the seconds of gaps before it that do not stand on the grid.
        findings: what was found on the way.
    """

    order: IntArray
    stamps_s: FloatArray
    period_s: float
    n: int
    raw: tuple[Span, ...]
    grid: tuple[Span, ...]
    snap: tuple[bool, ...]
    places: IntArray
    bridged: BoolArray
    skipped_s: tuple[float, ...]
    findings: tuple[Finding, ...]

    @property
    def time_s(self) -> FloatArray:
        """(n,) grid times in s; they jump at the end of a gap longer than ``MAX_VOID_S``."""
        out = np.asarray(self.stamps_s[self.raw[0].start] + self.period_s * np.arange(self.n), dtype=np.float64)
        before = 0.0
        for span, skipped in zip(self.grid, self.skipped_s, strict=True):
            if skipped != before:
                out[span.start :] += skipped - before
                before = skipped
        return out


def make_timebase(
    time_s: FloatArray,
    position: FloatArray,
    breaks: IntArray | None = None,
    velocity: FloatArray | None = None,
    bandwidth_of: Callable[[float], float] | None = None,
) -> Timebase:
    """Find the uniform grid behind recorded stamps.

    Args:
        time_s: (n,) stamps as recorded, s.
        position: (n, j) positions, used only to tell stamp jitter from sampling jitter.
        breaks: samples before which the recording is cut too; they are left out, so that a gap stands there.
        velocity: (n, j) as logged; with the positions it tells the clock behind stamps that scatter.
        bandwidth_of: of the filters, Hz, by the period, s; holes short against it are bridged; none when absent.

    Raises:
        NotJudgedError: there are too few samples for any stretch.
    """
    order, stamps, findings = clocked(time_s, position, velocity)
    if stamps.size < MIN_SEGMENT_SAMPLES:
        raise NotJudgedError(
            "too few samples to judge anything",
            found=f"{stamps.size} usable samples",
            expected=f"at least {MIN_SEGMENT_SAMPLES}",
        )
    steps = np.diff(stamps)
    period = median_of(steps)
    # a step longer than this is a gap; wider where stamps scatter, up to three periods
    limit = min(max(_GAP_PERIODS * period, period + 8.0 * robust_sd(steps - period)), 3.0 * period)
    none = np.zeros(steps.size, dtype=bool)
    bridged = none if bandwidth_of is None else bridged_steps(steps, period, limit, bandwidth_of(period))
    gaps = np.flatnonzero((steps > limit) & ~bridged) + 1
    all_raw = _stretches(gaps, order, breaks)
    raw = [s for s in all_raw if len(s) >= MIN_SEGMENT_SAMPLES]
    if not raw:
        raise NotJudgedError(
            "the log is in pieces too short to judge",
            found=f"{len(all_raw)} stretches, the longest of {max(len(s) for s in all_raw)} samples",
            expected=f"at least one stretch of {MIN_SEGMENT_SAMPLES} samples without a gap",
        )
    findings += _gap_findings(stamps, gaps, all_raw, limit)
    counts = np.ones(steps.size, dtype=np.int64)
    counts[bridged] = np.maximum(np.round(steps[bridged] / period), 2.0)
    places = _places(counts, raw, order.size)
    pooled = pooled_period(stamps, places, [(span.start, span.stop) for span in raw])
    period = pooled if abs(pooled - period) < 0.2 * period else period
    errors = [comb_error(stamps[s.slice], places[s.slice], period) for s in raw]
    snap = tuple(
        snaps(off, stamps[s.slice], places[s.slice], position, order[s.slice], period)
        for off, s in zip(errors, raw, strict=True)
    )
    grid, skipped = _grid_spans(stamps, places, raw, snap, period)
    filled = _bridged(stamps, places, bridged, raw, grid, snap, period)
    inside = np.flatnonzero(bridged & (np.diff(places) > 0))
    longest = float(steps[inside].max(initial=0.0))
    findings += bridged_findings(int(counts[inside].sum()) - inside.size, inside.size, grid[-1].stop, longest)
    findings += jitter_finding(errors, raw, snap, period)
    return Timebase(
        order, stamps, period, grid[-1].stop, tuple(raw), tuple(grid), snap, places, filled, skipped, tuple(findings)
    )


def _places(counts: IntArray, raw: list[Span], size: int) -> IntArray:
    """(m,) place of each sample in its stretch, from the periods that each step takes, mostly one."""
    out = np.zeros(size, dtype=np.int64)
    for span in raw:
        each = counts[span.start : span.stop - 1]
        out[span.start + 1 : span.stop] = np.arange(1, len(span)) if (each == 1).all() else np.cumsum(each)
    return out


def _bridged(
    stamps: FloatArray,
    places: IntArray,
    bridged: BoolArray,
    raw: list[Span],
    grid: list[Span],
    snap: tuple[bool, ...],
    period: float,
) -> BoolArray:
    """(n,) grid samples inside the steps that were bridged."""
    out = np.zeros(grid[-1].stop, dtype=bool)
    for span, place, snapped in zip(raw, grid, snap, strict=True):
        own = stamps[span.slice]
        at = places[span.slice] if snapped else np.round((own - own[0]) / period).astype(np.int64)
        after = 1 + np.flatnonzero(bridged[span.start : span.stop - 1])
        first, last = at[after - 1] + 1, np.minimum(at[after], len(place))
        some = first < last
        out[place.slice] = marked(first[some], last[some], len(place))
    return out


def _stretches(gaps: IntArray, order: IntArray, breaks: IntArray | None) -> list[Span]:
    """Ranges of samples between gaps and breaks; the first sample after a break is in none of them."""
    broken = (
        np.zeros(0, dtype=np.int64) if breaks is None or not breaks.size else np.flatnonzero(np.isin(order, breaks))
    )
    after = set(broken.tolist()) - set(gaps.tolist())
    bounds = sorted({0, order.size} | after | set(gaps.tolist()))
    spans = [Span(a + 1 if a in after else a, b) for a, b in pairwise(bounds)]
    return [span for span in spans if len(span)]


def _gap_findings(stamps: FloatArray, gaps: IntArray, spans: list[Span], limit: float) -> list[Finding]:
    findings = []
    if gaps.size:
        starts, ends = stamps[gaps - 1], stamps[gaps]
        worst = int(np.argmax(ends - starts))
        findings.append(
            Finding(
                "time-gap",
                "warning",
                f"{starts.size} gaps (steps over {limit * 1e3:.3g} ms), {np.sum(ends - starts):.3g} s in all; "
                f"the longest is {ends[worst] - starts[worst]:.3g} s. Nothing is judged or filtered across them.",
                start_s=float(starts[worst]),
                end_s=float(ends[worst]),
            )
        )
    lost = [s for s in spans if len(s) < MIN_SEGMENT_SAMPLES]
    if lost:
        findings.append(
            Finding(
                "time-gap",
                "warning",
                f"{len(lost)} stretches between gaps have fewer than {MIN_SEGMENT_SAMPLES} samples "
                f"({sum(len(s) for s in lost)} samples) and are not judged.",
            )
        )
    return findings


def _grid_spans(
    stamps: FloatArray, places: IntArray, raw: list[Span], snap: tuple[bool, ...], period: float
) -> tuple[list[Span], tuple[float, ...]]:
    """Where each stretch lies on the common grid, and the seconds of gaps left out before it.

    At least one empty grid sample stands between two stretches, and at most ``MAX_VOID_S`` of them.
    """
    origin = float(stamps[raw[0].start])
    longest = max(round(MAX_VOID_S / period), 1)
    spans: list[Span] = []
    skipped: list[float] = []
    left_out = 0
    for span, snapped in zip(raw, snap, strict=True):
        first, last = (float(stamps[k]) - left_out * period for k in (span.start, span.stop - 1))
        if spans and (excess := int((first - origin) / period) - spans[-1].stop - longest) > 0:
            left_out += excess
            first, last = first - excess * period, last - excess * period
        start = round((first - origin) / period) if snapped else int(np.ceil((first - origin) / period - 1e-9))
        if spans:
            start = max(start, spans[-1].stop + 1)
        stop = start + int(places[span.stop - 1]) + 1 if snapped else int(np.floor((last - origin) / period + 1e-9)) + 1
        spans.append(Span(start, max(stop, start)))
        skipped.append(left_out * period)
        if spans[-1].stop > _MOST_TIMES * stamps.size + _FREE_SAMPLES:
            raise NotJudgedError(
                "the stamps are too irregular for a uniform time base",
                found=f"a usual step of {period:.3g} s, and stretches that would take {spans[-1].stop:,} of them",
                expected=f"at most {_MOST_TIMES} times the {stamps.size:,} samples",
                hint="two publishers, or rows written twice, give such stamps; [log] time chooses another clock",
            )
    return spans, tuple(skipped)


def bridged_steps(steps: FloatArray, period_s: float, limit_s: float, bandwidth_hz: float) -> BoolArray:
    """(n - 1,) steps that are too long for one period and short enough to be bridged.

    Args:
        steps: between stamps, s.
        period_s: sample period, s.
        limit_s: a longer step lost samples.
        bandwidth_hz: of the filters that the samples pass.
    """
    slack = 0.05 * period_s
    single = steps <= min(2.5 * period_s, _SINGLE / bandwidth_hz + slack)
    return np.asarray((steps > limit_s) & (single | (steps <= SEVERAL / bandwidth_hz + slack)))


def filled(rows: FloatArray, places: IntArray, count: int, smooth: bool) -> FloatArray:
    """(count, j) rows at every place, those between interpolated: straight, or by a cubic through two on either side.

    Args:
        rows: (m, j) recorded values.
        places: (m,) their places, ascending from 0.
        count: number of places.
        smooth: positions, of which second derivatives are taken.
    """
    out = np.empty((count, rows.shape[1]), order="F")
    at = np.arange(count, dtype=np.float64)
    out[places] = rows
    missing = np.ones(count, dtype=bool)
    missing[places] = False
    holes = np.flatnonzero(missing)
    right = np.searchsorted(places, holes)
    cubic = smooth & (right >= 2) & (right + 1 < places.size)
    for j in range(rows.shape[1]):
        out[holes, j] = np.interp(at[holes], places, rows[:, j])
    k, x = right[cubic], at[holes[cubic]]
    if k.size:
        nodes = [places[k + o].astype(np.float64) for o in (-2, -1, 0, 1)]
        out[holes[cubic]] = through(x, nodes, [rows[k + o] for o in (-2, -1, 0, 1)])
    return out


def bridged_findings(count: int, holes: int, total: int, longest_s: float) -> list[Finding]:
    """How many samples were bridged.

    Args:
        count: samples that were put in; holes: how many holes they fill.
        total: samples with them.
        longest_s: the longest step that was bridged, s.
    """
    if not count:
        return []
    share = count / total
    text = (
        f"{count} lost samples ({100 * share:.2g} %) in {holes} holes of {1e3 * longest_s:.3g} ms at most were bridged "
        "by interpolation: they are short against the filter. What happened only inside a hole is not seen."
    )
    return [Finding("time-gap", "warning", text) if share > _MANY else fact(text)]
