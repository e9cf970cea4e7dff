"""Which samples are used, in which order, with which stamps: sorted, each once, rebuilt where the motion tells them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from collaudit.core.conditioning.motion_clock import MotionClock, clock_findings, motion_clock
from collaudit.core.findings import Finding, fact
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray, Span
from collaudit.core.numeric.stats import median_of, quantile_of, robust_sd


def clocked(
    time_s: FloatArray, position: FloatArray, velocity: FloatArray | None
) -> tuple[IntArray, FloatArray, str, list[Finding]]:
    """Samples in time order with their stamps, rebuilt where the motion tells them; why it does not; findings."""
    order, findings = _sorted(time_s)
    clock = motion_clock(time_s[order], position, velocity, order) if order.size else None
    if isinstance(clock, MotionClock):
        fresh = np.concatenate(([True], np.diff(clock.stamps_s) > 0.5 * clock.period_s))
        return order[fresh], clock.stamps_s[fresh], "", [*findings, *clock_findings(clock, fresh)]
    order = _distinct(order, time_s)
    return order, time_s[order], "" if clock is None else clock.why, findings


def usable_order(time_s: FloatArray) -> tuple[IntArray, list[Finding]]:
    """Indices of samples with finite, distinct stamps, in time order."""
    order, findings = _sorted(time_s)
    return _distinct(order, time_s), findings


def _sorted(time_s: FloatArray) -> tuple[IntArray, list[Finding]]:
    """Indices of samples with finite stamps, in time order."""
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
        findings.append(
            Finding(
                "time-out-of-order",
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


def jitter_finding(
    errors: Sequence[FloatArray], raw: Sequence[Span], snap: tuple[bool, ...], period: float, weak: str
) -> list[Finding]:
    """How far stamps scatter about the period, and how the even time base was made.

    Args:
        errors: of each stretch's stamps, as of :func:`comb_error`.
        raw: the stretches; snap: which of them count as evenly sampled.
        period: s.
        weak: why the motion does not show a steady clock, where that was looked for.
    """
    worst = max(_farthest(error) for error in errors)
    if worst < 0.02 * period:
        return []
    # of neighbours: a clock that drifts against another for minutes does not jitter
    apart = np.concatenate([np.diff(error) for error in errors])
    spread = robust_sd(apart) / np.sqrt(2.0)
    snapped = sum(len(s) for s, yes in zip(raw, snap, strict=True) if yes)
    total = sum(len(s) for s in raw)
    how = (
        "positions move more smoothly on an even time base, so samples were taken as evenly spaced"
        if snapped == total
        else "values were interpolated to an even time base"
        if snapped == 0
        else f"{snapped} of {total} samples were taken as evenly spaced, the others interpolated"
    )
    if weak and snapped < total:
        how += f"; the motion does not show a steady clock behind the stamps: {weak}"
    text = (
        f"Stamps scatter by {spread * 1e3:.2g} ms about a period of {period * 1e3:.6g} ms (robust standard deviation; "
        f"95 % of the steps are within {quantile_of(np.abs(apart), 0.95) * 1e3:.2g} ms of it, the farthest stamp is "
        f"{worst * 1e3:.3g} ms off an even clock); {how}."
    )
    return [fact(text)]
