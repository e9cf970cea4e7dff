"""Comparing the header's stamps with the times of recording: drift, jumps, wrap-around, simulated time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from collaudit.core.findings import Finding, fact
from collaudit.core.logs.signals.sample_clock import EPOCH_FLOOR_NS, steadiness
from collaudit.core.numeric.arrays import FloatArray, IntArray
from collaudit.core.numeric.stats import median_of

#: A drift is told from this share of the time on, when it adds up to ``DRIFT_S`` at least.
DRIFT_SHARE = 100e-6
DRIFT_S = 0.01
#: A clock that moves this much further than the other between two messages, and stays there, has jumped.
JUMP_S = 0.5
JUMP_PERIODS = 20
#: Spans at which counters of 32 bits start again, s.
WRAPS = (
    (2.0**32 * 1e-9, "32-bit nanoseconds"),
    (2.0**32 * 1e-6, "32-bit microseconds"),
    (2.0**32 * 1e-3, "32-bit milliseconds"),
    (2.0**32, "32-bit seconds"),
)
_FEW = 10
_LISTED = 5
_ALL, _LAST = slice(None), slice(-1, None)


def compare_clocks(stamp_ns: IntArray | None, log_ns: IntArray, topic: str) -> list[Finding]:
    """What the two clocks of a topic show about each other.

    Args:
        stamp_ns: (n,) header stamps, or None.
        log_ns: (n,) times of recording, in order.
        topic: for the findings.
    """
    if stamp_ns is None or log_ns.shape[0] < _FEW or not steadiness(stamp_ns).usable:
        return []
    clocks = _Clocks(stamp_ns, log_ns)
    if clocks.log_s(_LAST)[0] <= 0:
        return []
    simulated = _simulated(clocks, topic)
    if simulated:
        return simulated
    return _jump_findings(_jumps(clocks), clocks, topic) or _drift(clocks, topic)


@dataclass(frozen=True, slots=True, eq=False)
class _Clocks:
    """Both clocks of a topic, in s since its first message, of any part of it or places in it."""

    stamp_ns: IntArray
    log_ns: IntArray

    def log_s(self, part: slice | IntArray) -> FloatArray:
        return np.asarray((self.log_ns[part] - self.log_ns[0]).astype(np.float64) / 1e9)

    def header_s(self, part: slice | IntArray) -> FloatArray:
        return np.asarray((self.stamp_ns[part] - self.stamp_ns[0]).astype(np.float64) / 1e9)

    def ahead_s(self, part: slice | IntArray) -> FloatArray:
        """The header's clock less the recording's."""
        return np.asarray(self.header_s(part) - self.log_s(part))


def _simulated(clocks: _Clocks, topic: str) -> list[Finding]:
    """A header that counts from near zero while recording times are of today is simulated time."""
    if clocks.stamp_ns[0] >= EPOCH_FLOOR_NS or clocks.log_ns[0] < EPOCH_FLOOR_NS:
        return []
    factor = float(clocks.header_s(_LAST)[0] / clocks.log_s(_LAST)[0])
    text = (
        f"The header's stamps count from {clocks.stamp_ns[0] / 1e9:.6g} s, not from the epoch: time since start, or "
        f"simulated time, running at {factor:.3g} times the speed of the recording."
    )
    return [fact(text, where=topic)]


def _jumps(clocks: _Clocks) -> IntArray:
    """Messages at which one clock moved away from the other for good."""
    count = clocks.log_ns.shape[0]
    limit = max(JUMP_S, JUMP_PERIODS * median_of(np.diff(clocks.log_s(_ALL))))
    at = np.flatnonzero(np.abs(np.diff(clocks.ahead_s(_ALL))) > JUMP_S) + 1
    steps = at[np.abs(clocks.ahead_s(at) - clocks.ahead_s(at - 1)) > limit]
    if steps.shape[0] > count // 10:
        return np.empty(0, dtype=np.int64)
    kept = [k for k in steps.tolist() if abs(_level(clocks, k, k + _FEW) - _level(clocks, k - _FEW, k)) > limit]
    return np.array(kept, dtype=np.int64)


def _level(clocks: _Clocks, start: int, stop: int) -> float:
    return median_of(clocks.ahead_s(slice(max(start, 0), stop)))


def _jump_findings(jumps: IntArray, clocks: _Clocks, topic: str) -> list[Finding]:
    findings = []
    for k in jumps.tolist()[:_LISTED]:
        before, after = clocks.ahead_s(slice(k - 1, k + 1)).tolist()
        size, at_s = after - before, float(clocks.log_s(slice(k, k + 1))[0])
        wrapped = next((name for span, name in WRAPS if abs(abs(size) - span) < 0.01 * span + 0.1 and size < 0), None)
        why = f", as a counter of {wrapped} that starts again" if wrapped else ""
        text = f"The header's clock jumps by {size:+.4g} s against the recording's at {at_s:.4g} s{why}."
        findings.append(Finding("clock-jump", "warning", text, where=topic, start_s=at_s))
    if jumps.shape[0] > _LISTED:
        text = f"The header's clock jumps {jumps.shape[0] - _LISTED} more times."
        findings.append(Finding("clock-jump", "warning", text, where=topic))
    return findings


def _drift(clocks: _Clocks, topic: str) -> list[Finding]:
    """Drift from the medians of the first and last tenth, which a few late messages do not move."""
    tenth = max(clocks.log_ns.shape[0] // 10, 1)
    first, last = slice(0, tenth), slice(-tenth, None)
    gained = median_of(clocks.ahead_s(last)) - median_of(clocks.ahead_s(first))
    over = median_of(clocks.log_s(last)) - median_of(clocks.log_s(first))
    if over <= 0 or abs(gained) < DRIFT_S or abs(gained / over) < DRIFT_SHARE:
        return []
    text = (
        f"The header's clock runs {gained / over * 1e6:+.3g} ppm against the recording's: "
        f"{gained * 1e3:+.3g} ms over {over:.4g} s."
    )
    return [Finding("clock-drift", "warning" if abs(gained / over) > 0.01 else "info", text, where=topic)]
