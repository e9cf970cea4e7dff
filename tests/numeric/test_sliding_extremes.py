"""Extremes of sliding windows are those of scipy.ndimage."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from collaudit.core.numeric import sliding_extremes
from collaudit.core.numeric.sliding_extremes import (
    centred_extremes,
    centred_range,
    centred_range_at,
    range_exceeds,
    whole_window_minima,
    window_maxima,
    window_minima,
)

SIZES = (1, 2, 3, 4, 7, 13, 100, 999, 1000)


@pytest.fixture
def x(monkeypatch: pytest.MonkeyPatch) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    monkeypatch.setattr(sliding_extremes, "_AT_ONCE", 64)  # several blocks, and windows longer than one
    values = np.abs(np.random.default_rng(3).standard_normal(1000))
    values[::97] = np.inf
    values[5::101] = 0.0
    return values


@pytest.mark.parametrize("n", SIZES)
def test_windows_that_fit(x: np.ndarray[tuple[int], np.dtype[np.float64]], n: int) -> None:
    views = np.lib.stride_tricks.sliding_window_view(x, n)
    np.testing.assert_array_equal(window_minima(x, n), views.min(axis=1))
    np.testing.assert_array_equal(window_maxima(-x, n), (-views).max(axis=1))
    np.testing.assert_array_equal(whole_window_minima(x, n), ndimage.minimum_filter1d(x, n, mode="constant"))


@pytest.mark.parametrize("n", (*SIZES, 1500))
def test_memory_that_is_handed_in_is_written_to_altogether(
    x: np.ndarray[tuple[int], np.dtype[np.float64]], n: int
) -> None:
    for function, size in ((window_minima, max(0, x.size - n + 1)), (window_maxima, max(0, x.size - n + 1))):
        used = np.full(size, np.nan)
        if size:
            assert function(x, n, used) is used
        np.testing.assert_array_equal(used, function(x, n))
    used = np.full(x.size, np.nan)
    np.testing.assert_array_equal(whole_window_minima(x, n, used), whole_window_minima(x, n))
    np.testing.assert_array_equal(used, whole_window_minima(x, n))


@pytest.mark.parametrize("n", (*SIZES, 1500))
@pytest.mark.parametrize("mode", ["nearest", "reflect"])
def test_windows_that_are_cut_at_the_ends(x: np.ndarray[tuple[int], np.dtype[np.float64]], n: int, mode: str) -> None:
    x = np.where(np.isinf(x), 9.0, x)
    low, high = ndimage.minimum_filter1d(x, n, mode=mode), ndimage.maximum_filter1d(x, n, mode=mode)
    np.testing.assert_array_equal(centred_extremes(x, n), (low, high))
    np.testing.assert_array_equal(centred_range(x, n), high - low)


@pytest.mark.parametrize("n", [1, 5, 24, 31, 100, 999, 1500])
@pytest.mark.parametrize("size", [1, 2, 50, 1000, 1013])
def test_what_is_looked_at_in_part_is_that_of_all(n: int, size: int) -> None:
    rng = np.random.default_rng(size + n)
    x = np.cumsum(rng.standard_normal(size) * (rng.random(size) < 0.05))
    whole = centred_range(x, n)
    for share in (0.0, 0.02, 0.3, 1.0):
        rows = np.flatnonzero(rng.random(size) < share)
        np.testing.assert_array_equal(centred_range_at(x, n, rows), whole[rows])
    repeated = np.sort(rng.integers(0, size, size // 3))
    np.testing.assert_array_equal(centred_range_at(x, n, repeated), whole[repeated])
    for level in (0.0, float(np.median(whole)), float(whole.max())):
        np.testing.assert_array_equal(range_exceeds(x, n, level), whole > level)


def test_too_few_samples() -> None:
    assert window_minima(np.ones(4), 5).size == 0
    assert window_maxima(np.empty(0), 1).size == 0
    np.testing.assert_array_equal(whole_window_minima(np.ones(4), 5), np.zeros(4))
    assert centred_range(np.empty(0), 3).size == 0
    assert range_exceeds(np.empty(0), 3, 1.0).size == range_exceeds(np.empty(0), 100, 1.0).size == 0
    assert centred_range_at(np.ones(5), 3, np.empty(0, dtype=np.int64)).size == 0
