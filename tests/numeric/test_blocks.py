"""Comparisons by blocks give what whole arrays give."""

from __future__ import annotations

import numpy as np
import pytest

from collaudit.core.numeric.blocks import SAMPLES, exceeds, steps_exceed

SIZES = (0, 1, 2, SAMPLES - 1, SAMPLES, SAMPLES + 1, SAMPLES + 2, 2 * SAMPLES + 7)


def drawn(size: int) -> np.ndarray:
    x = np.random.default_rng(size).normal(size=size)
    x[:: max(2, size // 5)] = np.nan
    return x


@pytest.mark.parametrize("size", SIZES)
def test_what_exceeds_a_level(size: int) -> None:
    x = drawn(size)
    level = np.abs(drawn(size + 1)[:size])
    assert np.array_equal(exceeds(x, 0.5), np.abs(x) > 0.5)
    assert np.array_equal(exceeds(x, level, 0.8), np.abs(x) > 0.8 * level)


@pytest.mark.parametrize("size", SIZES)
def test_steps_that_exceed_a_level(size: int) -> None:
    x = drawn(size)
    assert np.array_equal(steps_exceed(x, 1.0), np.abs(np.diff(x)) > 1.0)
