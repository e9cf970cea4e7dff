"""From recorded stamps to a uniform time base: order, duplicates, gaps, and what jitter means."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from collaudit.core.errors import NotJudgedError
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray, Span
from collaudit.core.numeric.stats import robust_sd

MIN_SEGMENT_SAMPLES = 12
#: Of a longer gap only so much stands on the grid: memory follows what was recorded, not what was not.
MAX_VOID_S = 60.0
_PERIODIC_SHARE = 1e-3  # stamps within this share of a period of a perfect comb are a perfect comb


@dataclass(frozen=True, slots=True, eq=False)
class Timebase:
    """How recorded samples map onto a uniform grid.

    Attributes:
        order: (m,) indices of the recorded samples that are used, in time order.
        stamps_s: (m,) their stamps.
        period_s: grid spacing in s.
        n: grid length in samples.
        raw: gap-free stretches of recorded samples (ranges into ``order``).
        grid: the same stretches on the grid.
        snap: per stretch, True when sample k *is* grid sample k (stamps jitter, sampling does not);
            False when values have to be interpolated to the grid.
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
    time_s: FloatArray, position: FloatArray, gap_factor: float, breaks: IntArray | None = None
) -> Timebase:
    """Find the uniform grid behind recorded stamps.

    Args:
        time_s: (n,) stamps as recorded, s.
        position: (n, j) positions, used only to tell stamp jitter from sampling jitter.
        gap_factor: a step longer than this many periods is a gap.
        breaks: samples before which the recording is cut too; they are left out, so that a gap stands there.

    Raises:
        NotJudgedError: there are too few samples for any stretch.
    """
    order, findings = usable_order(time_s)
    stamps = time_s[order]
    if stamps.size < MIN_SEGMENT_SAMPLES:
        raise NotJudgedError(
            "too few samples to judge anything",
            found=f"{stamps.size} usable samples",
            expected=f"at least {MIN_SEGMENT_SAMPLES}",
        )
    steps = np.diff(stamps)
    period = float(np.median(steps))
    limit = _gap_limit(steps, period, gap_factor)
    gaps = np.flatnonzero(steps > limit) + 1
    all_raw = _stretches(gaps, order, breaks)
    raw = [s for s in all_raw if len(s) >= MIN_SEGMENT_SAMPLES]
    if not raw:
        raise NotJudgedError(
            "the log is in pieces too short to judge",
            found=f"{len(all_raw)} stretches, the longest of {max(len(s) for s in all_raw)} samples",
            expected=f"at least one stretch of {MIN_SEGMENT_SAMPLES} samples without a gap",
        )
    findings += _gap_findings(stamps, gaps, all_raw, limit)
    period = _pooled_period(stamps, raw, period)
    snap = tuple(_snaps(stamps[s.slice], position, order[s.slice], period) for s in raw)
    grid, skipped = _grid_spans(stamps, raw, snap, period)
    findings += _jitter_finding(stamps, raw, snap, period)
    return Timebase(order, stamps, period, grid[-1].stop, tuple(raw), tuple(grid), snap, skipped, tuple(findings))


def usable_order(time_s: FloatArray) -> tuple[IntArray, list[Finding]]:
    """Indices of samples with finite, distinct stamps, in time order."""
    findings: list[Finding] = []
    finite = np.flatnonzero(np.isfinite(time_s))
    if finite.size < time_s.size:
        findings.append(
            Finding(
                "time-not-finite",
                "warning",
                f"{time_s.size - finite.size} stamps are not numbers and were left out.",
            )
        )
    stamps = time_s[finite]
    backwards = int(np.count_nonzero(np.diff(stamps) < 0))
    order = finite
    if backwards:
        order = finite[np.argsort(stamps, kind="stable")]
        stamps = time_s[order]
        findings.append(
            Finding(
                "time-out-of-order",
                "warning",
                f"Stamps ran backwards {backwards} times; samples were sorted.",
            )
        )
    fresh: BoolArray = np.concatenate(([True], np.diff(stamps) > 0)) if stamps.size else np.zeros(0, bool)
    repeated = int(stamps.size - np.count_nonzero(fresh))
    if repeated:
        findings.append(
            Finding(
                "time-duplicate",
                "warning",
                f"{repeated} samples have the stamp of the sample before and were left out (the first was kept).",
            )
        )
    return order[fresh].astype(np.int64), findings


def _gap_limit(steps: FloatArray, period: float, gap_factor: float) -> float:
    """A step longer than this is a gap; wider where stamps scatter, up to three periods."""
    scatter = robust_sd(steps - period)
    return min(max(gap_factor * period, period + 8.0 * scatter), max(3.0, gap_factor) * period)


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
                "time-too-short",
                "warning",
                f"{len(lost)} stretches between gaps have fewer than {MIN_SEGMENT_SAMPLES} samples "
                f"({sum(len(s) for s in lost)} samples) and are not judged.",
            )
        )
    return findings


def _pooled_period(stamps: FloatArray, spans: list[Span], fallback: float) -> float:
    """Common least-squares slope of stamp against sample number over all stretches."""
    top = bottom = 0.0
    for span in spans:
        k = np.arange(len(span)) - (len(span) - 1) / 2
        top += float(k @ stamps[span.slice])
        bottom += float(k @ k)
    period = top / bottom
    return period if abs(period - fallback) < 0.2 * fallback else fallback


def _comb_error(stamps: FloatArray, period: float) -> FloatArray:
    """Deviation of stamps from the best comb of this period, s."""
    off = stamps - period * np.arange(stamps.size)
    return np.asarray(off - np.median(off))


def _snaps(stamps: FloatArray, position: FloatArray, order: IntArray, period: float) -> bool:
    """Whether samples were taken evenly, whatever their stamps say.

    Judged by which time axis predicts each position better from its four neighbours (a cubic through
    them): an arm has inertia, so the true axis is the one on which it moves smoothly.
    """
    error = float(np.max(np.abs(_comb_error(stamps, period))))
    if error < _PERIODIC_SHARE * period:
        return True
    if error > 0.5 * period:
        return False
    even: FloatArray = np.asarray(period * np.arange(stamps.size), dtype=np.float64)
    own = position[order]
    return _roughness(even, own) <= _roughness(stamps, own)


def _roughness(t: FloatArray, position: FloatArray) -> float:
    """RMS error of predicting each position from its neighbours at t[k±1], t[k±2]."""
    if t.size < 5:
        return 0.0
    offsets = (-2, -1, 1, 2)
    centre = t[2:-2]
    nodes = [t[2 + o : t.size - 2 + o] - centre for o in offsets]
    guess = np.zeros_like(position[2:-2])
    for a, node in enumerate(nodes):
        weight = np.ones_like(centre)
        for b, other in enumerate(nodes):
            if b != a:
                weight = weight * (-other) / (node - other)
        guess = guess + weight[:, None] * position[2 + offsets[a] : t.size - 2 + offsets[a]]
    error = np.asarray(guess - position[2:-2])
    return float(np.sqrt(np.nanmean(error**2))) if np.isfinite(error).any() else 0.0


def _grid_spans(
    stamps: FloatArray, raw: list[Span], snap: tuple[bool, ...], period: float
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
        stop = start + len(span) if snapped else int(np.floor((last - origin) / period + 1e-9)) + 1
        spans.append(Span(start, max(stop, start)))
        skipped.append(left_out * period)
    return spans, tuple(skipped)


def _jitter_finding(stamps: FloatArray, raw: list[Span], snap: tuple[bool, ...], period: float) -> list[Finding]:
    worst = max(float(np.max(np.abs(_comb_error(stamps[s.slice], period)))) for s in raw)
    if worst < 0.02 * period:
        return []
    snapped = sum(len(s) for s, yes in zip(raw, snap, strict=True) if yes)
    total = sum(len(s) for s in raw)
    how = (
        "positions move more smoothly on an even time base, so samples were taken as evenly spaced"
        if snapped == total
        else "values were interpolated to an even time base"
        if snapped == 0
        else f"{snapped} of {total} samples were taken as evenly spaced, the others interpolated"
    )
    return [
        Finding(
            "time-jitter",
            "info",
            f"Stamps deviate up to {worst * 1e3:.3g} ms from a period of {period * 1e3:.6g} ms; {how}.",
        )
    ]
