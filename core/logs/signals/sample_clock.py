"""Which clock is the time of a sample: the header's stamp or the time of recording."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from collaudit.core.errors import LogError
from collaudit.core.findings import Finding, fact
from collaudit.core.numeric.arrays import IntArray
from collaudit.core.numeric.stats import quantile_of

Clock = Literal["header", "log"]
#: Stamps before this (1980) are not taken as times since the epoch.
EPOCH_FLOOR_NS = 315_532_800_000_000_000
#: Nor later ones (2200), which are garbage.
EPOCH_CEILING_NS = 7_258_118_400_000_000_000
#: Percentiles of steps rest on this many of them at most, evenly taken.
_SAMPLE = 50_000


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
    header, log = steadiness(stamp_ns), steadiness(log_ns)
    if wanted == "log":
        return "log", _clock_finding("log time, as configured", where)
    if wanted == "header":
        if not header.usable:
            raise LogError(
                f"the header's stamps were asked for and cannot be used: {header.why}",
                where=where,
                hint='set time = "log" or "auto" under [log]',
            )
        return "header", _clock_finding("the header's stamps, as configured", where)
    if not header.usable:
        return "log", _clock_finding(f"log time, because the header's stamp cannot be used: {header.why}", where)
    spreads = f"5-95 % of its steps within {header.spread_s * 1e3:.3g} ms, log time {log.spread_s * 1e3:.3g} ms"
    if not log.usable or header.spread_s <= log.spread_s:
        return "header", _clock_finding(f"the header's stamps, the steadier clock ({spreads})", where)
    return "log", _clock_finding(
        f"log time, the steadier clock (5-95 % of its steps within {log.spread_s * 1e3:.3g} ms, "
        f"header {header.spread_s * 1e3:.3g} ms)",
        where,
    )


def _clock_finding(text: str, where: str) -> Finding:
    return fact(f"Samples are timed by {text}.", where=where)


def start_of(first_ns: int) -> int | None:
    """An absolute start, or None when the clock does not count from the epoch."""
    return first_ns if EPOCH_FLOOR_NS <= first_ns < EPOCH_CEILING_NS else None
