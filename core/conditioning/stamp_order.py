"""Which samples are used, in which order, with which stamps: sorted, each once, rebuilt where the motion tells them."""

from __future__ import annotations

import numpy as np

from collaudit.core.conditioning.motion_clock import MotionClock, clock_findings, motion_clock
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray


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
