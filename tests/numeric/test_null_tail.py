"""The level that something passes once in so many hours, told from the bulk of its peaks alone."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm

from collaudit.core.numeric.null_tail import BLOCK_S, FEWEST_BLOCKS, block_peaks, null_tail

PER_BLOCK = 10  # independent samples


def gaussian_peaks(blocks: int, seed: int) -> np.ndarray:
    draws = np.abs(np.random.default_rng(seed).standard_normal((blocks, PER_BLOCK)))
    return np.asarray(draws.max(axis=1))


def true_level(per_hour: float) -> float:
    """Of Gaussian samples: the level that a block passes so often."""
    chance = per_hour / (3600.0 / BLOCK_S)
    return float(norm.isf(0.5 * (1.0 - (1.0 - chance) ** (1.0 / PER_BLOCK))))


@pytest.mark.parametrize("blocks", [80, 2000])
def test_the_level_of_gaussian_noise_is_found(blocks: int) -> None:
    """Twenty seconds tell it to about a tenth, minutes to a few per cent; nothing beyond the data is seen."""
    found = [null_tail(gaussian_peaks(blocks, seed)).level(0.02) for seed in range(40)]  # type: ignore[union-attr]
    expected = true_level(0.02)
    assert np.median(found) == pytest.approx(expected, rel=0.06)
    assert np.std(found) < (0.15 if blocks < 100 else 0.04) * expected


def test_contact_in_a_tenth_of_the_blocks_moves_nothing_much() -> None:
    clean = gaussian_peaks(400, 1)
    touched = clean.copy()
    touched[::11] += 50.0
    before, after = null_tail(clean), null_tail(touched)
    assert before is not None and after is not None
    assert after.level(0.1) < 1.25 * before.level(0.1)
    assert touched.max() > 8 * after.level(0.1)


def test_the_interval_holds_the_rate() -> None:
    """What the spacings leave open: in 95 of 100 draws the true rate lies within (the law is exact here)."""
    inside = 0
    for seed in range(200):
        squares = np.random.default_rng(seed).exponential(2.0, 200)
        tail = null_tail(np.sqrt(squares))
        assert tail is not None
        level = tail.level(0.1)
        low, high = tail.interval(level)
        inside += low <= 3600.0 / BLOCK_S * np.exp(-(level**2) / 2.0) <= high
    assert inside >= 180


def test_too_little_tells_nothing() -> None:
    assert null_tail(gaussian_peaks(FEWEST_BLOCKS - 1, 1)) is None
    assert null_tail(np.ones(100)) is None


def test_blocks_count_where_most_of_them_does() -> None:
    level = np.arange(1000, dtype=float)
    counts = np.ones(1000, dtype=bool)
    counts[:70] = False
    counts[125:180] = False
    peaks = block_peaks(level, counts, 0.002)  # 125 samples a block
    np.testing.assert_array_equal(peaks, [249.0, 374.0, 499.0, 624.0, 749.0, 874.0, 999.0])
