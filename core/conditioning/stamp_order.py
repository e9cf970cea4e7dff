"""Which samples are used, in which order, with which stamps: sorted, each once, rebuilt where the motion tells them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from collaudit.core.conditioning.lost_samples import through
from collaudit.core.conditioning.motion_clock import clock_findings, motion_clock
from collaudit.core.findings import Finding, fact
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray, Span
from collaudit.core.numeric.stats import median_of, robust_sd


def clocked(
    time_s: FloatArray, position: FloatArray, velocity: FloatArray | None
) -> tuple[IntArray, FloatArray, list[Finding]]:
    """Samples in time order with their stamps, rebuilt where the motion tells them; findings."""
    order, findings = _sorted(time_s)
    clock = motion_clock(time_s[order], position, velocity, order) if order.size else None
    if clock is not None:
        fresh = np.concatenate(([True], np.diff(clock.stamps_s) > 0.5 * clock.period_s))
        return order[fresh], clock.stamps_s[fresh], [*findings, *clock_findings(clock, fresh)]
    order = _distinct(order, time_s)
    return order, time_s[order], findings


def usable_order(time_s: FloatArray) -> IntArray:
    """Indices of samples with finite, distinct stamps, in time order."""
    return _distinct(_sorted(time_s)[0], time_s)


def _sorted(time_s: FloatArray) -> tuple[IntArray, list[Finding]]:
    """Indices of samples with finite stamps, in time order."""
    findings: list[Finding] = []
    finite = np.flatnonzero(np.isfinite(time_s))
    if finite.size < time_s.size:
        findings.append(
            Finding(
                "log-nan",
                "warning",
                f"{time_s.size - finite.size} stamps are not numbers and were left out.",
            )
        )
    stamps = time_s[finite]
    backwards = int(np.count_nonzero(np.diff(stamps) < 0))
    order = finite
    if backwards:
        order = finite[np.argsort(stamps, kind="stable")]
        findings.append(
            Finding(
                "log-clock",
                "warning",
                f"Stamps ran backwards {backwards} times; samples were sorted.",
            )
        )
    return order.astype(np.int64, copy=False), findings


def _distinct(order: IntArray, time_s: FloatArray) -> IntArray:
    """Those of the samples, in time order, whose stamp is not that of the one before."""
    stamps = time_s[order]
    fresh: BoolArray = np.concatenate(([True], np.diff(stamps) > 0)) if stamps.size else np.zeros(0, bool)
    return order if fresh.all() else order[fresh]


_PERIODIC_SHARE = 1e-3  # stamps within this share of a period of a perfect comb are a perfect comb


def comb_error(stamps: FloatArray, places: IntArray, period: float) -> FloatArray:
    """(m,) deviation of stamps from the best comb of this period, s."""
    off = stamps - period * places
    off -= median_of(off)
    return off


def _farthest(off: FloatArray) -> float:
    return float(max(off.max(), -off.min()))


def snaps(
    off: FloatArray, stamps: FloatArray, places: IntArray, position: FloatArray, order: IntArray, period: float
) -> bool:
    """Whether samples were taken evenly, whatever their stamps say.

    Judged by which time axis predicts each position better from its four neighbours (a cubic through
    them): an arm has inertia, so the true axis is the one on which it moves smoothly.

    Args:
        off: (m,) of the stamps, as of :func:`comb_error`.
        stamps: (m,) s; places: (m,) of each in its stretch.
        position: (n, j); order: (m,) rows of it.
        period: s.
    """
    error = _farthest(off)
    if error < _PERIODIC_SHARE * period:
        return True
    if error > 0.5 * period:
        return False
    even: FloatArray = np.asarray(period * places, dtype=np.float64)
    own = position[order]
    return _roughness(even, own) <= _roughness(stamps, own)


def _roughness(t: FloatArray, position: FloatArray) -> float:
    """RMS error of predicting each position from its neighbours at t[k±1], t[k±2]."""
    if t.size < 5:
        return 0.0
    inside = slice(2, t.size - 2)
    at = [slice(2 + k, t.size - 2 + k) for k in (-2, -1, 1, 2)]
    nodes = [t[part] - t[inside] for part in at]
    guess = through(np.zeros_like(nodes[0]), nodes, [position[part] for part in at])
    error = np.asarray(guess - position[inside])
    return float(np.sqrt(np.nanmean(error**2))) if np.isfinite(error).any() else 0.0


def jitter_finding(
    errors: Sequence[FloatArray], raw: Sequence[Span], snap: tuple[bool, ...], period: float
) -> list[Finding]:
    """How far stamps scatter about the period, and how the even time base was made.

    Args:
        errors: of each stretch's stamps, as of :func:`comb_error`.
        raw: the stretches; snap: which of them count as evenly sampled.
        period: s.
    """
    worst = max(_farthest(error) for error in errors)
    if worst < 0.02 * period:
        return []
    # of neighbours: a clock that drifts against another for minutes does not jitter
    spread = robust_sd(np.concatenate([np.diff(error) for error in errors])) / np.sqrt(2.0)
    snapped = sum(len(s) for s, yes in zip(raw, snap, strict=True) if yes)
    text = (
        f"Stamps scatter by {spread * 1e3:.2g} ms about a period of {period * 1e3:.6g} ms (robust standard deviation; "
        f"the farthest is {worst * 1e3:.3g} ms off an even clock); {snapped} of {sum(map(len, raw))} samples were "
        "taken as evenly spaced, on which positions move more smoothly, the others interpolated to an even time base."
    )
    return [fact(text)]
