"""The grid of alarms is rule (6) applied threshold by threshold and persistence by persistence."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plain_rule import collisions

from collaudit.core.rule_study.joint_plane import (
    COUNTS,
    GAMMAS,
    alarm_grid,
    excess,
    grid_counts,
    grid_gammas,
    sustained_level,
)


def log_of(seed: int, samples: int = 4000) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A smooth residual with holes in what may count, and an uncertainty that comes and goes."""
    rng = np.random.default_rng(seed)
    noise = np.convolve(rng.normal(size=samples + 40), np.hanning(15), "same")[:samples]
    residual = noise + 4.0 * (rng.random(samples) > 0.999)
    residual[rng.random(samples) < 0.002] = np.nan
    evidence = np.convolve(rng.random(samples) < 0.003, np.ones(30), "same") < 0.5
    uncertainty = 0.25 * (np.sin(np.arange(samples) / 200.0) > 0.5)
    return residual, uncertainty, evidence


@pytest.mark.parametrize("merge", [0, 1, 7, 60])
def test_the_whole_grid_is_the_rule_cell_by_cell(merge: int) -> None:
    residual, uncertainty, evidence = log_of(3)
    found = excess(residual, uncertainty, evidence)
    gammas, counts = np.geomspace(0.25, 16.0, 24), np.array([1, 2, 3, 5, 8, 13, 14, 30])
    brute = [[len(collisions(residual, evidence, g + uncertainty, int(n), merge)) for n in counts] for g in gammas]
    assert np.array_equal(alarm_grid(found, gammas, counts, merge), brute)
    assert 0 < np.count_nonzero(brute) < np.size(brute)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.integers(0, 4), max_size=60), st.integers(0, 4), st.lists(st.booleans(), min_size=60, max_size=60))
def test_any_short_residual(values: list[int], merge: int, there: list[bool]) -> None:
    residual, evidence = np.array(values, dtype=float), np.array(there[: len(values)], dtype=bool)
    gammas, counts = np.array([0.5, 1.0, 2.5]), np.array([1, 2, 4])
    found = alarm_grid(excess(residual, np.zeros(len(values)), evidence), gammas, counts, merge)
    assert found.tolist() == [[len(collisions(residual, evidence, g, int(n), merge)) for n in counts] for g in gammas]


def test_the_sustained_level_is_where_alarms_end() -> None:
    residual, uncertainty, evidence = log_of(5)
    found = excess(residual, uncertainty, evidence)
    counts = np.array([1, 2, 3, 7, 20])
    for n, level in zip(counts, sustained_level(found, counts), strict=True):
        assert alarm_grid(found, np.array([level - 1e-9]), np.array([n]))[0, 0] > 0
        assert alarm_grid(found, np.array([level]), np.array([n]))[0, 0] == 0


def test_a_window_longer_than_the_stretch_never_alarms() -> None:
    assert sustained_level(np.ones((2, 5)), np.array([1, 5, 6])).tolist() == [[1, 1, -np.inf]] * 2


@pytest.mark.parametrize(("period_s", "n"), [(0.001, 25), (0.002, 13), (0.008, 4), (0.033, 1), (0.005, 300)])
def test_axes_of_the_grid(period_s: float, n: int) -> None:
    counts = grid_counts(period_s, n)
    assert n in counts
    assert counts.size >= COUNTS - 1 and np.all(np.diff(counts) > 0) and counts[0] == 1
    assert counts[-1] * period_s >= 0.249
    gammas = grid_gammas(0.2, [4.0], 1.5)
    assert gammas.size == GAMMAS and gammas[0] < 0.2 and gammas[-1] > 4.0


@pytest.mark.parametrize("largest", [0.3, 3.0, 300.0, 3e5])
def test_thresholds_enclose_what_is_asked_in_equal_ratios(largest: float) -> None:
    gammas = grid_gammas(0.13, [4.0], largest)
    assert gammas.size == GAMMAS and gammas[0] <= 0.5 * 0.13 and gammas[-1] >= 2.5 * max(4.0, largest) * (1 - 1e-9)
    np.testing.assert_allclose(np.diff(np.log(gammas)), np.log(gammas[1] / gammas[0]), rtol=1e-9)
