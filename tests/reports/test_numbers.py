"""Numbers as text never lie about which side of a limit they are on."""

from __future__ import annotations

import math
from dataclasses import replace
from decimal import Decimal

import pytest
import samples
from hypothesis import assume, given
from hypothesis import strategies as st

from collaudit.core.data.audit_result import FrictionFile
from collaudit.core.data.identification_result import FrictionVariation, Identification, Trend
from collaudit.reports.sections.fit_sections import identified_sections
from collaudit.reports.terminal.command_texts import fit_text
from collaudit.reports.values.numbers import (
    UNKNOWN,
    against,
    apart,
    duration,
    fixed,
    interval,
    percent,
    significant,
    speed,
    stated,
    time_decimals,
)

FINITE = st.floats(allow_nan=False, allow_infinity=False, min_value=-1e12, max_value=1e12)


def sign(a: float | Decimal, b: float | Decimal) -> int:
    return (a > b) - (a < b)


@given(st.lists(FINITE, min_size=2, max_size=6), st.integers(0, 4))
def test_texts_side_by_side_compare_as_the_numbers_do(values: list[float], decimals: int) -> None:
    texts = apart(values, decimals)
    for value, text in zip(values, texts, strict=True):
        for other, other_text in zip(values, texts, strict=True):
            assert sign(Decimal(text), Decimal(other_text)) == sign(value, other)


@given(st.floats(-1e6, 1e6), st.floats(1e-3, 1e6))
def test_a_peak_stays_on_its_side_of_the_threshold(peak: float, gamma: float) -> None:
    peak_text, gamma_text = against(peak, gamma)
    assert sign(abs(Decimal(peak_text)), Decimal(gamma_text)) == sign(abs(peak), gamma)


@given(st.floats(1e-3, 1e3), st.integers(-40, 40))
def test_neighbouring_doubles_are_told_apart(gamma: float, steps: int) -> None:
    peak = gamma
    for _ in range(abs(steps)):
        peak = math.nextafter(peak, math.inf if steps > 0 else -math.inf)
    texts = [Decimal(text) for text in against(peak, gamma)]
    assert sign(*texts) == sign(peak, gamma)


@given(st.floats(0, 1))
def test_only_all_is_100_percent_and_only_nothing_is_0(share: float) -> None:
    number = Decimal(percent(share).removesuffix(" %"))
    assert (number == 0) == (share == 0)
    assert (number == 100) == (share == 1) or 100 * share == 100.0
    assert 0 <= number <= 100


@given(st.floats(-1e8, 1e8, allow_subnormal=False), st.floats(0, 1e8, allow_subnormal=False))
def test_interval_ends_are_rounded_outwards(low: float, width: float) -> None:
    high = low + width
    assume(high > low)
    low_text, high_text = interval(low, high).split(" to ")
    assert Decimal(low_text) <= Decimal(repr(low))
    assert Decimal(high_text) >= Decimal(repr(high))


def test_an_interval_without_width_is_none() -> None:
    """A parameter that was held at its limit has no uncertainty to show, least of all none at all."""
    assert interval(0.0, 0.0) == "none: held at its limit"
    result = samples.failed(3000).result
    fit = next(iter(result.friction.values()))
    held = replace(fit, parameters={"D_nm_s_per_rad": 0.0}, ci95={"D_nm_s_per_rad": (0.0, 0.0)})
    text = fit_text(FrictionFile("", {"j": held}, (), result.provenance), detail=True)
    assert "D 0 [none: held at its limit]" in text and "[0, 0]" not in text
    trend = Trend("load", 0.0, (0.0, 0.0), 1.0, "a.bag")
    (table,) = identified_sections(Identification(None, {}, {"j": FrictionVariation((trend,), ())}))
    assert "not determined" in table.rows[0]


@given(st.floats(-1e8, 1e8).filter(lambda v: abs(v) > 1e-6))
def test_significant_digits_are_close(value: float) -> None:
    assert float(significant(value, 4)) == pytest.approx(value, rel=1e-3)


@given(FINITE)
def test_fixed_never_shows_minus_zero(value: float) -> None:
    text = fixed(value, 2)
    assert not (text.startswith("-") and float(text) == 0)


@pytest.mark.parametrize(
    ("peak", "gamma", "texts"),
    [
        (4.004, 4.0, ("4.004", "4.000")),
        (-9.21734, 4.0, ("-9.22", "4.00")),
        (3.9996, 4.0, ("3.9996", "4.0000")),
        (4.0, 4.0, ("4.00", "4.00")),
        (None, 4.0, (UNKNOWN, "4.00")),
        (math.nan, 4.0, (UNKNOWN, "4.00")),
    ],
)
def test_peaks_beside_thresholds(peak: float | None, gamma: float, texts: tuple[str, str]) -> None:
    assert against(peak, gamma) == texts


@pytest.mark.parametrize(
    ("low", "high", "text"),
    [
        (1.234, 5.678, "1.23 to 5.68"),
        (None, 5.6, "open below, up to 5.60"),
        (1.2, None, "from 1.20, open above"),
        (None, None, "open on both sides"),
    ],
)
def test_open_sides_are_named(low: float | None, high: float | None, text: str) -> None:
    assert interval(low, high) == text


@pytest.mark.parametrize(
    ("value", "text"), [(None, UNKNOWN), (math.inf, UNKNOWN), (0.0, "0"), (1e-7, "1.00e-07"), (12345.6, "12346")]
)
def test_single_numbers(value: float | None, text: str) -> None:
    assert significant(value) == text


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (0.0, "0 s"),
        (0.026, "26.0 ms"),
        (0.9999, "1.00 s"),
        (38.82, "38.8 s"),
        (119.96, "2 min 00 s"),
        (7260.0, "2 h 01 min"),
        (None, UNKNOWN),
    ],
)
def test_durations(seconds: float | None, text: str) -> None:
    assert duration(seconds) == text


@pytest.mark.parametrize(("period", "decimals"), [(0.008, 3), (0.001, 3), (0.0005, 4), (0.00025, 4), (0.0, 3)])
def test_times_show_every_sample(period: float, decimals: int) -> None:
    assert time_decimals(period) == decimals


def test_stated_numbers_keep_what_was_written() -> None:
    assert [stated(v) for v in (4.0, 2.5, 0.1, 25.0, None)] == ["4", "2.5", "0.1", "25", UNKNOWN]
    assert [stated(v) for v in (4.125, 38.653767322, 0.333333333)] == ["4.125", "38.7", "0.333"]


def test_an_arm_that_stands_has_no_speed_of_sixteen_millionths() -> None:
    assert [speed(v, "m/s") for v in (1.6e-5, -0.0, 0.0124, -0.2791, None)] == [
        "under 0.001 m/s", "under 0.001 m/s", "0.0124 m/s", "-0.279 m/s", f"{UNKNOWN} m/s"
    ]  # fmt: skip


def test_side_by_side_three_digits_where_they_suffice() -> None:
    assert apart([40.790123, 4.0]) == ("40.8", "4.00")
    assert apart([138.7, 80.0, 100.0]) == ("139", "80.0", "100")
    assert apart([99.99, 80.0, 100.0]) == ("99.99", "80.00", "100.00")


@given(st.lists(FINITE, min_size=2, max_size=6))
def test_three_digits_compare_as_the_numbers_do(values: list[float]) -> None:
    texts = apart(values)
    for value, text in zip(values, texts, strict=True):
        for other, other_text in zip(values, texts, strict=True):
            assert sign(Decimal(text), Decimal(other_text)) == sign(value, other)
