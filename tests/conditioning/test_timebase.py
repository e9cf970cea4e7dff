"""Recorded stamps onto a uniform grid: order, duplicates, gaps, jitter."""

from __future__ import annotations

import numpy as np
import pytest

from collaudit.core.conditioning.timebase import make_timebase
from collaudit.core.errors import NotJudgedError

T = 0.002


def smooth_motion(t: np.ndarray) -> np.ndarray:
    return np.column_stack([np.sin(2 * t), 0.5 * np.cos(3 * t)])


def codes(base: object) -> list[str]:
    return [f.code for f in base.findings]  # type: ignore[attr-defined]


def test_even_stamps_are_taken_as_they_are() -> None:
    t = T * np.arange(1000)
    base = make_timebase(t, smooth_motion(t))
    assert base.n == 1000
    assert base.snap == (True,)
    assert base.period_s == pytest.approx(T, rel=1e-12)
    assert codes(base) == []


def test_a_gap_stays_a_gap_and_keeps_its_length() -> None:
    t = T * np.arange(1000)
    keep = np.r_[0:400, 650:1000]
    base = make_timebase(t[keep], smooth_motion(t[keep]))
    assert [(s.start, s.stop) for s in base.grid] == [(0, 400), (650, 1000)]
    assert "time-gap" in codes(base)
    finding = next(f for f in base.findings if f.code == "time-gap")
    assert finding.start_s == pytest.approx(399 * T)
    assert finding.end_s == pytest.approx(650 * T)


def test_a_single_lost_sample_is_a_gap() -> None:
    t = np.delete(T * np.arange(200), 100)
    base = make_timebase(t, smooth_motion(t))
    assert [(s.start, s.stop) for s in base.grid] == [(0, 100), (101, 200)]


def test_duplicates_and_disorder_are_found_and_mended() -> None:
    t = T * np.arange(500)
    stamps = t.copy()
    stamps[[100, 101]] = stamps[[101, 100]]
    stamps = np.insert(stamps, 300, stamps[299])
    rows = smooth_motion(stamps)
    base = make_timebase(stamps, rows)
    assert codes(base) == ["log-clock"]  # what is left out is said with its size, where that is known
    assert np.allclose(base.stamps_s, t)
    assert np.allclose(rows[base.order], smooth_motion(t))


def test_stamp_jitter_is_told_from_sampling_jitter() -> None:
    rng = np.random.default_rng(1)
    even = T * np.arange(3000)
    jittered = even + rng.normal(0, 0.1 * T, even.size)
    jittered[0] = 0.0
    stamps_lie = make_timebase(jittered, smooth_motion(even))
    sampling_jitters = make_timebase(jittered, smooth_motion(jittered))
    assert stamps_lie.snap == (True,)
    assert sampling_jitters.snap == (False,)
    assert codes(stamps_lie) == codes(sampling_jitters) == ["fact"]


def test_the_period_is_recovered_from_jittered_stamps_to_its_statistical_error() -> None:
    rng = np.random.default_rng(2)
    n = 5000
    stamps = T * np.arange(n) + rng.normal(0, 0.1 * T, n)
    base = make_timebase(np.sort(stamps), smooth_motion(stamps))
    standard_error = 0.1 * T * np.sqrt(12.0 / n**3)
    assert abs(base.period_s - T) < 5 * standard_error


def test_stamps_that_are_not_numbers_are_left_out() -> None:
    t = T * np.arange(100)
    t[5] = np.nan
    base = make_timebase(t, smooth_motion(np.nan_to_num(t)))
    assert "log-nan" in codes(base)


@pytest.mark.parametrize("n", [0, 1, 11])
def test_too_few_samples_are_refused(n: int) -> None:
    t = T * np.arange(n)
    with pytest.raises(NotJudgedError, match="too few samples"):
        make_timebase(t, smooth_motion(t))


def test_short_pieces_between_gaps_are_said_to_be_lost() -> None:
    t = T * np.r_[0:200, 300:305, 400:600]
    base = make_timebase(t, smooth_motion(t))
    assert len(base.grid) == 2
    assert "time-gap" in codes(base)


@pytest.mark.parametrize(("longest", "gaps"), [(1.85, 0), (2.0, 0), (3.5, 1)])
def test_where_stamps_scatter_a_gap_is_longer(longest: float, gaps: int) -> None:
    """Eight times a scatter of 15 % makes a step of twice the period none, where 1.8 periods would be one otherwise."""
    steps = T * (1.0 + np.random.default_rng(3).normal(0.0, 0.15, 2000).clip(-0.4, 0.4))
    steps[1000] = longest * T
    t = np.concatenate(([0.0], np.cumsum(steps)))
    found = [finding for finding in make_timebase(t, smooth_motion(t)).findings if finding.code == "time-gap"]
    assert len(found) == gaps
