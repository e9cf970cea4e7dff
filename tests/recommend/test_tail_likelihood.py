"""The tail's bounds against laws whose tails are known."""

from __future__ import annotations

import numpy as np
import pytest

from collaudit.core.recommend.tail_fit import tail_likelihood

_ONE_SIDED_95 = 1.645


def exponential(seed: int, scale: float = 0.4, rate: float = 80.0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return rng.exponential(scale, rng.poisson(rate))


def test_bounds_hold_as_often_as_they_say() -> None:
    """Rate and level of an exponential tail, inside the data's range and far beyond it."""
    held: dict[float, list[bool]] = {20.0: [], 2.0: [], 0.01: []}
    for seed in range(120):
        law = tail_likelihood(exponential(seed), 1.0, 1.0, (1.0, 1.0))
        for rate, found in held.items():
            true_level = 1.0 + 0.4 * np.log(80.0 / rate)
            found.append(law.rate_bound(true_level, _ONE_SIDED_95) >= rate)
            assert law.rate_bound(law.level_bound(rate, _ONE_SIDED_95), _ONE_SIDED_95) == pytest.approx(rate, rel=1e-6)
    for rate, found in held.items():
        assert 0.86 <= np.mean(found) <= 0.99, rate


def test_rate_and_level_are_each_others_inverse() -> None:
    law = tail_likelihood(exponential(3), 1.0, 1.0, (1.0, 1.0))
    assert law.rate_at(law.level_bound(0.5, 0.0)) == pytest.approx(0.5, rel=1e-9)
    assert law.rate_at(1.0) == pytest.approx(law.rate_per_hour)
    assert law.level_bound(0.5, _ONE_SIDED_95) > law.level_bound(0.5, 0.0)


def test_peaks_that_come_in_crowds_tell_less() -> None:
    even = tail_likelihood(exponential(5), 1.0, 1.0, (1.0, 1.0))
    crowded = tail_likelihood(exponential(5), 1.0, 1.0, (10.0, 1.0))
    uneven = tail_likelihood(exponential(5), 1.0, 1.0, (1.0, 10.0))
    assert crowded.rate_bound(1.5, _ONE_SIDED_95) > 1.3 * even.rate_bound(1.5, _ONE_SIDED_95)
    assert uneven.level_bound(0.01, _ONE_SIDED_95) > 1.05 * even.level_bound(0.01, _ONE_SIDED_95)
    for law in (crowded, uneven):
        assert law.level_bound(1.0, 0.0) == pytest.approx(even.level_bound(1.0, 0.0), rel=0.1), (
            "the estimate itself stays"
        )


def test_a_tail_heavier_than_exponential_is_seen_and_reckoned_with() -> None:
    rng = np.random.default_rng(2)
    heavy = tail_likelihood(rng.pareto(2.5, 400) * 0.4, 1.0, 1.0, (1.0, 1.0))
    light = tail_likelihood(rng.exponential(0.4, 400), 1.0, 1.0, (1.0, 1.0))
    assert heavy.heavy and heavy.shape > 0.1
    assert not light.heavy and light.shape <= 0.0
    assert heavy.level_bound(0.01, _ONE_SIDED_95) > 2 * light.level_bound(0.01, _ONE_SIDED_95)


def test_a_tail_that_ends_has_an_end() -> None:
    rng = np.random.default_rng(4)
    law = tail_likelihood(rng.uniform(0.0, 1.0, 500), 1.0, 1.0, (1.0, 1.0))
    assert law.shape < -0.3
    assert law.level_bound(1e-6, _ONE_SIDED_95) < 3.5, "an exponential tail would reach 11"
