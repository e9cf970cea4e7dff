"""Runs of a mask against SciPy and against plain loops."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy import ndimage

from collaudit.core.numeric.arrays import closed, marked, run_bounds, widened

MASK = np.random.default_rng(4).random(500) < 0.01


@pytest.mark.parametrize("margin", [0, 1, 5, 300])
def test_a_mask_is_widened(margin: int) -> None:
    np.testing.assert_array_equal(widened(MASK, margin), ndimage.binary_dilation(MASK, np.ones(2 * margin + 1)))


@pytest.mark.parametrize("dip", [0, 1, 7, 60, 500])
def test_holes_no_longer_than_a_dip_are_filled(dip: int) -> None:
    expected, places = MASK.copy(), np.flatnonzero(MASK)
    for before, after in itertools.pairwise(places):
        if after - before - 1 <= dip:
            expected[before:after] = True
    np.testing.assert_array_equal(closed(MASK, dip), expected)


@pytest.mark.parametrize("reach", [0, 3, 40])
def test_what_lies_inside_ranges_is_marked_once(reach: int) -> None:
    starts, stops = run_bounds(MASK)
    expected = sorted({k for a, b in zip(starts, stops, strict=True) for k in range(a - reach, b + reach)})
    inside = marked(np.maximum(starts - reach, 0), np.minimum(stops + reach, MASK.size), MASK.size)
    assert np.flatnonzero(inside).tolist() == [k for k in expected if 0 <= k < MASK.size]


def test_ranges_that_begin_and_end_with_the_mask_or_hold_nothing() -> None:
    numbers = [np.array(x) for x in ([0, 3, 3, 6], [2, 3, 4, 8])]
    assert marked(*numbers, 8).tolist() == [True, True, False, True, False, False, True, True]
    assert not marked(*(x[:0] for x in numbers), 5).any()
    assert marked(np.array([0]), np.array([3]), 3).all()
