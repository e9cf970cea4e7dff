"""Comparing the header's stamps with the times of recording: drift, jumps, wrap-around, simulated time."""

from __future__ import annotations

import numpy as np

from collaudit.core.findings import Finding
from collaudit.core.logs.signals.sample_clock import EPOCH_FLOOR_NS, steadiness
from collaudit.core.numeric.arrays import FloatArray, IntArray

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


def compare_clocks(stamp_ns: IntArray | None, log_ns: IntArray, topic: str) -> list[Finding]:
    """What the two clocks of a topic show about each other.

    Args:
        stamp_ns: (n,) header stamps, or None.
        log_ns: (n,) times of recording, in order.
        topic: for the findings.
    """
    if stamp_ns is None or log_ns.shape[0] < _FEW or not steadiness(stamp_ns).usable:
        return []
    log_s = (log_ns - log_ns[0]).astype(np.float64) / 1e9
    header_s = (stamp_ns - stamp_ns[0]).astype(np.float64) / 1e9
    if not np.isfinite(log_s).all() or log_s[-1] <= 0:
        return []
    simulated = _simulated(stamp_ns, log_ns, header_s, log_s, topic)
    if simulated:
        return simulated
    jumps = _jumps(header_s, log_s)
    findings = _jump_findings(jumps, header_s - log_s, log_s, topic)
    return findings or _drift(header_s - log_s, log_s, topic)


def _simulated(
    stamp_ns: IntArray, log_ns: IntArray, header_s: FloatArray, log_s: FloatArray, topic: str
) -> list[Finding]:
    """A header that counts from near zero while recording times are of today is simulated time."""
    if stamp_ns[0] >= EPOCH_FLOOR_NS or log_ns[0] < EPOCH_FLOOR_NS:
        return []
    factor = float(header_s[-1] / log_s[-1])
    text = (
        f"The header's stamps count from {stamp_ns[0] / 1e9:.6g} s, not from the epoch: time since start, or simulated "
        f"time, running at {factor:.3g} times the speed of the recording."
    )
    return [Finding("clock-simulated", "info", text, where=topic)]


def _jumps(header_s: FloatArray, log_s: FloatArray) -> IntArray:
    """Messages at which one clock moved away from the other for good."""
    limit = max(JUMP_S, JUMP_PERIODS * float(np.median(np.diff(log_s))))
    ahead = header_s - log_s
    steps = np.flatnonzero(np.abs(np.diff(ahead)) > limit) + 1
    if steps.shape[0] > ahead.shape[0] // 10:
        return np.empty(0, dtype=np.int64)
    kept = [k for k in steps.tolist() if abs(_level(ahead, k, k + _FEW) - _level(ahead, k - _FEW, k)) > limit]
    return np.array(kept, dtype=np.int64)


def _level(values: FloatArray, start: int, stop: int) -> float:
    return float(np.median(values[max(start, 0) : stop]))


def _jump_findings(jumps: IntArray, ahead: FloatArray, log_s: FloatArray, topic: str) -> list[Finding]:
    findings = []
    for k in jumps.tolist()[:_LISTED]:
        size = float(ahead[k] - ahead[k - 1])
        wrapped = next((name for span, name in WRAPS if abs(abs(size) - span) < 0.01 * span + 0.1 and size < 0), None)
        why = f", as a counter of {wrapped} that starts again" if wrapped else ""
        text = f"The header's clock jumps by {size:+.4g} s against the recording's at {log_s[k]:.4g} s{why}."
        findings.append(Finding("clock-jump", "warning", text, where=topic, start_s=float(log_s[k])))
    if jumps.shape[0] > _LISTED:
        text = f"The header's clock jumps {jumps.shape[0] - _LISTED} more times."
        findings.append(Finding("clock-jump", "warning", text, where=topic))
    return findings


def _drift(ahead: FloatArray, log_s: FloatArray, topic: str) -> list[Finding]:
    """Drift from the medians of the first and last tenth, which a few late messages do not move."""
    tenth = max(log_s.shape[0] // 10, 1)
    gained = float(np.median(ahead[-tenth:]) - np.median(ahead[:tenth]))
    over = float(np.median(log_s[-tenth:]) - np.median(log_s[:tenth]))
    if over <= 0 or abs(gained) < DRIFT_S or abs(gained / over) < DRIFT_SHARE:
        return []
    text = (
        f"The header's clock runs {gained / over * 1e6:+.3g} ppm against the recording's: "
        f"{gained * 1e3:+.3g} ms over {over:.4g} s."
    )
    return [Finding("clock-drift", "warning" if abs(gained / over) > 0.01 else "info", text, where=topic)]
