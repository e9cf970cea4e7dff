"""Stamps as seconds, those that are no times of a recording, and which of its two clocks is the time of its samples."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from collaudit.core.errors import LogError
from collaudit.core.findings import Finding, fact
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.stats import median_of, quantile_of

#: A value is interpolated only between neighbours closer than this many of their own periods.
NEIGHBOUR_PERIODS = 2.5
Clock = Literal["header", "log"]
#: Stamps before this (1980) are not taken as times since the epoch.
EPOCH_FLOOR_NS = 315_532_800_000_000_000
#: Nor later ones (2200), which are garbage.
EPOCH_CEILING_NS = 7_258_118_400_000_000_000
#: Percentiles of steps rest on this many of them at most, evenly taken.
_SAMPLE = 50_000
_FEW = 10
#: Parts of the log at its beginning and end whose medians are compared: a few late messages do not move them.
_PARTS = 10
#: Stamps that lie so much farther apart than the recording lasts are of two clocks, one of which was never set.
_TWO_CLOCKS_NS = 10**15
#: Time that one clock gained on the other is said from so much on, s and share of the log's duration.
_GAINED_S, _GAINED_SHARE = 0.01, 100e-6
#: More than this share is worth a warning: speeds are wrong by as much.
_WARNED_SHARE = 0.01
#: A stamp so far from the middle of the log, s (12 days), and so many times the usual distance, is garbage where few
#: are: a recording with a long break has many on both sides.
_FAR_S, _FAR_TIMES, _FAR_SHARE = 1e6, 1e3, 0.1
_SURELY_NEAR_NS = int(0.9 * _FAR_S * 1e9)


def seconds_since(stamps_ns: IntArray, origin_ns: int) -> FloatArray:
    """(n,) seconds since an origin; the difference is taken in whole nanoseconds before it becomes a float."""
    return np.asarray((stamps_ns - np.int64(origin_ns)) / 1e9)


def interpolate(at_s: FloatArray, time_s: FloatArray, values: FloatArray) -> FloatArray:
    """Linear interpolation that never crosses a gap.

    Args:
        at_s: (m,) where values are wanted.
        time_s: (n,) stamps of the values, any order.
        values: (n, k).

    Returns:
        (m, k); NaN outside the stamps and between neighbours further apart than ``NEIGHBOUR_PERIODS`` of their
        own median period.
    """
    out = np.full((at_s.shape[0], values.shape[1]), np.nan)
    time_s, first = np.unique(time_s, return_index=True)
    values = values[first]
    if time_s.shape[0] == 0:
        return out
    right = np.searchsorted(time_s, at_s, side="left")
    exact = (right < time_s.shape[0]) & (time_s[np.minimum(right, time_s.shape[0] - 1)] == at_s)
    out[exact] = values[right[exact]]
    if time_s.shape[0] < 2:
        return out
    limit = NEIGHBOUR_PERIODS * median_of(np.diff(time_s))
    inside = ~exact & (right > 0) & (right < time_s.shape[0])
    hi = right[inside]
    step = time_s[hi] - time_s[hi - 1]
    share = ((at_s[inside] - time_s[hi - 1]) / step)[:, None]
    mixed = values[hi - 1] * (1 - share) + values[hi] * share
    mixed[step > limit] = np.nan
    out[inside] = mixed
    return out


@dataclass(frozen=True, slots=True)
class Steadiness:
    """How evenly a clock steps.

    Attributes:
        period_s: median step in s.
        spread_s: 5th to 95th percentile of the steps, s.
        usable: False when it stands still, runs backwards as often as not, or is always zero.
        why: why it is not usable.
    """

    period_s: float
    spread_s: float
    usable: bool
    why: str = ""


def steadiness(stamps_ns: IntArray | None) -> Steadiness:
    """Judge a clock by its steps."""
    if stamps_ns is None or stamps_ns.shape[0] == 0:
        return Steadiness(float("nan"), float("nan"), False, "there is none")
    if stamps_ns.shape[0] < 2:
        return Steadiness(float("nan"), 0.0, bool(stamps_ns[0] != 0), "it is zero")
    before, after = stamps_ns[:-1], stamps_ns[1:]
    forward = np.count_nonzero(after > before)
    if not forward and not (after != before).any():
        why = "it is always zero" if stamps_ns[0] == 0 else "it never changes"
        return Steadiness(0.0, 0.0, False, why)
    stride = -(-before.shape[0] // _SAMPLE)
    steps = (after[::stride] - before[::stride]).astype(np.float64) / 1e9
    low, middle, high = (quantile_of(steps, share) for share in (0.05, 0.5, 0.95))
    if forward < 0.5 * before.shape[0]:
        return Steadiness(middle, high - low, False, "most of its steps are not forward")
    return Steadiness(middle, high - low, True)


def of_two_clocks(stamp_ns: IntArray, log_ns: IntArray) -> bool:
    """Whether header stamps (n,) lie days farther apart than their times of recording (n,)."""
    if not stamp_ns.size:
        return False
    apart, lasted = (int(ns.max()) - int(ns.min()) for ns in (stamp_ns, log_ns))
    return apart - lasted > _TWO_CLOCKS_NS


def header_steadiness(stamp_ns: IntArray | None, log_ns: IntArray) -> Steadiness:
    """Judge header stamps (n,) by their steps and by the times of recording (n,)."""
    if stamp_ns is not None and of_two_clocks(stamp_ns, log_ns):
        return Steadiness(float("nan"), float("nan"), False, "some were never set, or are of another clock")
    return steadiness(stamp_ns)


def choose_clock(
    stamp_ns: IntArray | None, log_ns: IntArray, wanted: Literal["auto", "header", "log"], where: str
) -> tuple[Clock, Finding]:
    """Choose the clock of a topic and say why.

    Args:
        stamp_ns: (n,) header stamps, or None.
        log_ns: (n,) times of recording.
        wanted: the configuration's choice.
        where: the topic, for messages.

    Raises:
        LogError: the header's stamps were asked for and cannot be used.
    """
    header, log = header_steadiness(stamp_ns, log_ns), steadiness(log_ns)
    if wanted == "header" and not header.usable:
        raise LogError(
            f"the header's stamps were asked for and cannot be used: {header.why}",
            where=where,
            hint='[log] time = "log" or "auto"',
        )
    clock: Clock = "header" if header.usable and (not log.usable or header.spread_s <= log.spread_s) else "log"
    why = f"because the header's stamp cannot be used: {header.why}"
    if wanted != "auto":
        clock, why = wanted, "as configured"
    elif header.usable:
        spreads = [("header", header.spread_s), ("log time", log.spread_s)]
        own, other = spreads if clock == "header" else spreads[::-1]
        within = f"5-95 % of its steps within {own[1] * 1e3:.3g} ms, {other[0]} {other[1] * 1e3:.3g} ms"
        why = f"the steadier clock ({within})"
    named = "the header's stamps" if clock == "header" else "log time"
    return clock, fact(f"Samples are timed by {named}, {why}.", where=where)


def start_of(first_ns: int) -> int | None:
    """An absolute start, or None when the clock does not count from the epoch."""
    return first_ns if EPOCH_FLOOR_NS <= first_ns < EPOCH_CEILING_NS else None


def compare_clocks(stamp_ns: IntArray | None, log_ns: IntArray, topic: str) -> list[Finding]:
    """A finding where the header's clock goes on otherwise than the recording's: it drifts, was set, or is simulated.

    A jump of the clock that is used shows as a gap, or as a clock set back, too.

    Args:
        stamp_ns: (n,) header stamps, or None.
        log_ns: (n,) times of recording, in order.
        topic: for the findings.
    """
    if stamp_ns is None or log_ns.shape[0] < _FEW or not steadiness(stamp_ns).usable:
        return []
    recorded = seconds_since(log_ns, int(log_ns[0]))
    ahead = seconds_since(stamp_ns, int(stamp_ns[0])) - recorded
    part = log_ns.shape[0] // _PARTS
    gained = median_of(ahead[-part:]) - median_of(ahead[:part])
    over = median_of(recorded[-part:]) - median_of(recorded[:part])
    if over <= 0 or abs(gained) < _GAINED_S or abs(gained / over) < _GAINED_SHARE:
        return []
    text = (
        f"The header's clock gained {gained:+.4g} s on the recording's in {over:.4g} s ({gained / over * 1e6:+.3g} "
        "ppm): one of them runs fast or slow, was set, or tells simulated time."
    )
    return [Finding("log-clock", "warning" if abs(gained / over) > _WARNED_SHARE else "info", text, where=topic)]


def garbage_stamps(time_s: FloatArray) -> BoolArray:
    """(n,) stamps that are no times of this recording; those that are not numbers are not among them.

    Args:
        time_s: (n,) s from any origin, in any order.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        known = np.isfinite(time_s)
        times = time_s[known]
        if not times.size or float(times.max() / 2 - times.min() / 2) < _FAR_S / 2:
            return np.zeros(time_s.shape, dtype=np.bool_)
        middle = float(np.median(times))
        distance = np.abs(time_s - middle)
        usual = float(np.median(distance[known]))
        far = known & (distance > max(_FAR_S, _FAR_TIMES * usual))
    few = np.count_nonzero(far) <= _FAR_SHARE * np.count_nonzero(known)
    return np.asarray(far if few else np.zeros_like(far))


def garbage_ns(stamps_ns: IntArray) -> BoolArray | None:
    """As :func:`garbage_stamps` of seconds; None where there is no garbage, which the ends of a recording tell."""
    if not stamps_ns.size or int(stamps_ns.max()) - int(stamps_ns.min()) < _SURELY_NEAR_NS:
        return None
    far = garbage_stamps(stamps_ns / 1e9)
    return far if far.any() else None


def plausible_ns(stamps_ns: IntArray, where: str) -> tuple[IntArray, list[Finding]]:
    """The stamps, ns, without garbage, and a finding where there is some."""
    far = garbage_ns(stamps_ns)
    return (stamps_ns, []) if far is None else (stamps_ns[~far], garbage_findings(far, "message", where))


def garbage_findings(far: BoolArray | None, what: str, where: str) -> list[Finding]:
    """A finding for the stamps that are garbage, if any are.

    Args:
        far: (n,) which of them are; None where none is.
        what: "row" or "message".
        where: the file or topic.
    """
    if far is None or not far.any():
        return []
    text = (
        f"{np.count_nonzero(far)} of {far.size} stamps are no times of this recording; these {what}s were left out. "
        f"The first is {what} {int(np.argmax(far)) + 1}."
    )
    return [Finding("log-nan", "warning", text, where=where)]
