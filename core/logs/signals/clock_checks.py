"""Comparing the header's stamps with the times of recording over a whole log."""

from __future__ import annotations

from collaudit.core.findings import Finding
from collaudit.core.logs.signals.sample_clock import steadiness
from collaudit.core.logs.signals.stamps import seconds_since
from collaudit.core.numeric.arrays import IntArray
from collaudit.core.numeric.stats import median_of

_FEW = 10
#: Parts of the log at its beginning and end whose medians are compared: a few late messages do not move them.
_PARTS = 10
#: More than this share is worth a warning: speeds are wrong by as much.
_WARNED_SHARE = 0.01


def compare_clocks(
    stamp_ns: IntArray | None, log_ns: IntArray, topic: str, *, least_s: float = 0.01, least_share: float = 100e-6
) -> list[Finding]:
    """A finding where the header's clock goes on otherwise than the recording's: it drifts, was set, or is simulated.

    A jump of the clock that is used shows as a gap, or as a clock set back, too.

    Args:
        stamp_ns: (n,) header stamps, or None.
        log_ns: (n,) times of recording, in order.
        topic: for the findings.
        least_s, least_share: what is stated of the time that one clock gained, s and share of the log's duration.
    """
    if stamp_ns is None or log_ns.shape[0] < _FEW or not steadiness(stamp_ns).usable:
        return []
    recorded = seconds_since(log_ns, int(log_ns[0]))
    ahead = seconds_since(stamp_ns, int(stamp_ns[0])) - recorded
    part = log_ns.shape[0] // _PARTS
    gained = median_of(ahead[-part:]) - median_of(ahead[:part])
    over = median_of(recorded[-part:]) - median_of(recorded[:part])
    if over <= 0 or abs(gained) < least_s or abs(gained / over) < least_share:
        return []
    text = (
        f"The header's clock gained {gained:+.4g} s on the recording's in {over:.4g} s ({gained / over * 1e6:+.3g} "
        "ppm): one of them runs fast or slow, was set, or tells simulated time."
    )
    return [Finding("clock-drift", "warning" if abs(gained / over) > _WARNED_SHARE else "info", text, where=topic)]
