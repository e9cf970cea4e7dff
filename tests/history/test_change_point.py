"""Change points: false ones as rarely as stated, beginnings and sizes inside their intervals as often as stated."""

from __future__ import annotations

import numpy as np
import pytest

from collaudit.core.history.series_changes import find_change

T = np.arange(40.0)
SE = np.full(40, 0.005)


def test_chance_alone_is_seldom_a_change() -> None:
    rng = np.random.default_rng(1)
    p = np.array([find_change(T, rng.normal(size=40), SE).p for _ in range(800)])
    assert np.mean(p < 0.05) <= 0.05 and np.mean(p < 0.01) <= 0.015


@pytest.mark.parametrize(("shape", "size"), [("step", 0.03), ("drift", 0.004)])
def test_intervals_hold_the_truth(shape: str, size: float) -> None:
    rng = np.random.default_rng(2)
    truth = size * ((T >= 15) if shape == "step" else np.maximum(T - 15, 0.0))
    held = np.zeros((200, 3), dtype=bool)
    for k in range(200):
        found = find_change(T, 1.0 + truth + rng.normal(0.0, 0.01, 40), SE)
        held[k] = (
            found.shape == shape,
            found.first <= 15 <= found.last,
            found.size_ci95[0] <= size <= found.size_ci95[1],
        )
    assert np.all(held.mean(axis=0) >= 0.92), held.mean(axis=0)


def test_what_a_covariate_explains_is_no_change() -> None:
    rng = np.random.default_rng(3)
    warm = rng.normal(0.0, 0.3, 40) + (T > 20)
    y = 2.0 * warm + rng.normal(0.0, 0.1, 40)
    assert find_change(T, y, SE).p < 1e-3 < 0.05 < find_change(T, y, SE, warm).p


def test_scaling_changes_nothing_but_the_size() -> None:
    y = np.random.default_rng(4).normal(size=40) + 2.0 * (T > 18)
    one, other = find_change(T, y, SE), find_change(T, 1e3 * y, 1e3 * SE)
    assert other.p == pytest.approx(one.p) and other.size == pytest.approx(1e3 * one.size)


def test_too_few_values_are_no_series() -> None:
    assert find_change(T[:7], T[:7], SE[:7]) is None


def test_a_constant_series_does_not_change() -> None:
    assert find_change(T, np.ones(40), np.zeros(40)).p == 1.0
