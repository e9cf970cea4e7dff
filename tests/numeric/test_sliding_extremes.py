"""Extremes of sliding windows are those of their definition."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from collaudit.core.numeric.arrays import (
    FloatArray,
    centred_extremes,
    lowest_in_row,
    range_exceeds,
    whole_window_minima,
)

SIZES = (1, 2, 3, 4, 7, 13, 100, 999, 1000)


@pytest.fixture
def x() -> FloatArray:
    values = np.abs(np.random.default_rng(3).standard_normal(1000))
    values[::97] = np.inf
    values[5::101] = 0.0
    return values


@pytest.mark.parametrize("n", SIZES)
def test_windows_that_fit(x: FloatArray, n: int) -> None:
    views = np.lib.stride_tricks.sliding_window_view(x, n)
    np.testing.assert_array_equal(lowest_in_row(x, n), views.min(axis=1))
    np.testing.assert_array_equal(whole_window_minima(x, n), ndimage.minimum_filter1d(x, n, mode="constant"))


@pytest.mark.parametrize("n", (*SIZES, 1500))
def test_windows_that_are_cut_at_the_ends(x: FloatArray, n: int) -> None:
    x = np.where(np.isinf(x), 9.0, x)
    low, high = ndimage.minimum_filter1d(x, n, mode="nearest"), ndimage.maximum_filter1d(x, n, mode="nearest")
    np.testing.assert_array_equal(centred_extremes(x, n), (low, high))
    for level in (0.0, float(np.median(high - low)), float((high - low).max())):
        np.testing.assert_array_equal(range_exceeds(x, n, level), high - low > level)


def test_too_few_samples() -> None:
    assert lowest_in_row(np.ones(4), 5).size == lowest_in_row(np.empty(0), 1).size == 0
    np.testing.assert_array_equal(whole_window_minima(np.ones(4), 5), np.zeros(4))
    assert range_exceeds(np.empty(0), 3, 1.0).size == 0
