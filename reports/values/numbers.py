"""Numbers as text: enough digits, a unit, and never rounded across a limit."""

from __future__ import annotations

import math
from collections.abc import Sequence
from decimal import ROUND_CEILING, ROUND_FLOOR, Decimal
from itertools import pairwise

UNKNOWN = "not known"

_MOST_DECIMALS = 17


def significant(value: float | None, digits: int = 3) -> str:
    """A number by itself, in ``digits`` significant digits; whole numbers are never cut.

    Args:
        value: any number, or None.
        digits: at least 1.
    """
    if value is None or not math.isfinite(value):
        return UNKNOWN
    if value == 0:
        return "0"
    magnitude = math.floor(math.log10(abs(float(f"{value:.{digits - 1}e}"))))  # 0.9999 reads 1.00
    if not -4 <= magnitude < 9:
        return f"{value:.{digits - 1}e}"
    return fixed(value, max(0, digits - 1 - magnitude))


def stated(value: float | None) -> str:
    """A number somebody chose, such as a threshold: in full, without added zeros.

    One with more than four digits was computed, and reads as any other.
    """
    if value is None or not math.isfinite(value):
        return UNKNOWN
    text = f"{value:.12g}"
    return text if float(f"{value:.4g}") == float(text) else significant(value)


def speed(value: float | None, unit: str) -> str:
    """A speed; an arm that stands has none that could be told."""
    if value is not None and abs(value) < 5e-4:
        return f"under 0.001 {unit}"
    return f"{significant(value)} {unit}"


def fixed(value: float, decimals: int) -> str:
    """A finite number with so many decimals, without a minus before zero."""
    text = f"{value:.{decimals}f}"
    return text[1:] if text.startswith("-") and not text.strip("-0.") else text


def apart(values: Sequence[float | None], decimals: int | None = None) -> tuple[str, ...]:
    """Numbers that are read side by side: as texts they compare exactly as the numbers themselves do.

    A peak of 4.004 beside a threshold of 4 becomes 4.004 beside 4.000, not "4.00" twice.

    Args:
        values: the numbers; None and what is not finite become "not known".
        decimals: the least count of decimals, of all alike. None: three significant digits each, where they suffice.
    """
    known = [value for value in values if value is not None and math.isfinite(value)]
    if decimals is None and _compare_alike(known, [significant(value) for value in known]):
        return tuple(significant(value) for value in values)
    chosen = _decimals_apart(known, 2 if decimals is None else decimals)
    return tuple(
        UNKNOWN
        if value is None or not math.isfinite(value)
        else (repr(float(value)) if chosen is None else fixed(value, chosen))
        for value in values
    )


def against(value: float | None, limit: float | None) -> tuple[str, str]:
    """A signed value and a limit on its magnitude: their texts keep which of |value| and limit is larger."""
    if value is None or not math.isfinite(value):
        return UNKNOWN, apart([limit])[0]
    magnitude, limit_text = apart([abs(value), limit])
    nothing = not any(digit in magnitude for digit in "123456789")
    return (magnitude if value >= 0 or nothing else f"-{magnitude}"), limit_text


def percent(share: float | None, decimals: int = 1) -> str:
    """A share as per cent; only exactly nothing reads 0 % and only exactly all reads 100 %."""
    if share is None or not math.isfinite(share):
        return UNKNOWN
    if share in (0, 1):
        return f"{100 * share:.0f} %"
    return f"{apart([100 * share, 0.0, 100.0], decimals)[0]} %"


def time_decimals(period_s: float) -> int:
    """Decimals that show every sample of a time base: 3, or more when samples are closer than 1 ms."""
    if not (math.isfinite(period_s) and period_s > 0):
        return 3
    return min(9, max(3, math.ceil(-math.log10(period_s) - 1e-9)))


def rate_words(per_hour: float | None) -> str:
    """A rate as a person says it: none, 1 per 1,000 h, 2.4 per hour; empty where it is not known."""
    if not per_hour:
        return "" if per_hour is None else "none"
    if per_hour >= 1.0:
        return f"{per_hour:.2g} per hour"
    hours = 1.0 / per_hour
    return f"1 per {hours:,.0f} h" if hours >= 10.0 else f"1 per {hours:.2g} h"


def duration(seconds: float | None) -> str:
    """A length of time in the unit a reader thinks in."""
    if seconds is None or not math.isfinite(seconds):
        return UNKNOWN
    if seconds == 0:
        return "0 s"
    if abs(seconds) < 0.9995:
        return f"{significant(seconds * 1e3)} ms"
    if abs(seconds) < 119.5:
        return f"{significant(seconds)} s"
    minutes, rest = divmod(round(seconds), 60)
    if minutes < 120:
        return f"{minutes} min {rest:02d} s"
    return f"{minutes // 60} h {minutes % 60:02d} min"


def interval(low: float | None, high: float | None, digits: int = 3) -> str:
    """An interval whose unknown sides are named open; its ends are rounded outwards; one without width is none."""
    if low is not None and low == high:
        return "none: held at its limit"
    if low is None and high is None:
        return "open on both sides"
    if low is None:
        return f"open below, up to {_outward(high, digits, up=True)}"
    if high is None:
        return f"from {_outward(low, digits, up=False)}, open above"
    return f"{_outward(low, digits, up=False)} to {_outward(high, digits, up=True)}"


def with_interval(value: float, bounds: tuple[float | None, float | None] | None) -> str:
    """A number with its interval in brackets; by itself where there is none."""
    return significant(value) if bounds is None else f"{significant(value)} [{interval(*bounds)}]"


def _outward(value: float | None, digits: int, *, up: bool) -> str:
    """In significant digits, never moved into the interval."""
    text = significant(value, digits)
    if value is None or text == UNKNOWN:
        return text
    rounding = ROUND_CEILING if up else ROUND_FLOOR
    shown = Decimal(repr(float(value))).quantize(Decimal(text), rounding)
    return f"{float(shown):.{digits - 1}e}" if "e" in text else f"{shown:f}"


def _decimals_apart(values: Sequence[float], least: int) -> int | None:
    """The fewest decimals that keep every comparison between the values; None when none of them do."""
    ordered = sorted(set(values))
    for decimals in range(least, _MOST_DECIMALS + 1):
        if _compare_alike(ordered, [fixed(value, decimals) for value in ordered]):
            return decimals
    return None


def _compare_alike(values: Sequence[float], texts: Sequence[str]) -> bool:
    """Whether texts of numbers are in the order of the numbers, and equal only where these are."""
    known = sorted(zip(values, map(Decimal, texts), strict=True))
    return all((a < b) == (low < high) for (a, low), (b, high) in pairwise(known))
