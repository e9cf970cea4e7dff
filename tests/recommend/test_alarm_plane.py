"""The plane counts what rule (6) would alarm, threshold by threshold and persistence by persistence."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plain_rule import collisions

from collaudit.core.recommend.joint_thresholds import alarm_counts


def levels(residual: np.ndarray, evidence: np.ndarray) -> np.ndarray:
    """What the plane counts in."""
    return np.where(evidence & ~np.isnan(residual), np.abs(residual), -np.inf)


@pytest.mark.parametrize("merge", [0, 1, 7, 60])
def test_the_whole_plane_is_the_rule_cell_by_cell(merge: int) -> None:
    rng = np.random.default_rng(3)
    residual = np.convolve(rng.normal(size=4040), np.hanning(15), "same")[:4000] + 4.0 * (rng.random(4000) > 0.999)
    residual[rng.random(4000) < 0.002] = np.nan
    evidence = np.convolve(rng.random(4000) < 0.003, np.ones(30), "same") < 0.5
    gammas, counts = np.geomspace(0.25, 16.0, 24), np.array([1, 2, 3, 5, 8, 13, 14, 30])
    brute = [[len(collisions(residual, evidence, np.full(4000, g), int(n), merge)) for n in counts] for g in gammas]
    assert np.array_equal(alarm_counts(levels(residual, evidence), gammas, counts, merge), brute)
    assert 0 < np.count_nonzero(brute) < np.size(brute)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.integers(0, 4), max_size=60), st.integers(0, 4), st.lists(st.booleans(), min_size=60, max_size=60))
def test_any_short_residual(values: list[int], merge: int, there: list[bool]) -> None:
    residual, evidence = np.array(values, dtype=float), np.array(there[: len(values)], dtype=bool)
    gammas, counts = np.array([0.5, 1.0, 2.5]), np.array([1, 2, 4])
    found = alarm_counts(levels(residual, evidence), gammas, counts, merge)
    assert found.tolist() == [[len(collisions(residual, evidence, g, int(n), merge)) for n in counts] for g in gammas]
