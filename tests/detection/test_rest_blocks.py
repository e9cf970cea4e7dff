"""Means, steps and ways of standing joints against the same block by block."""

import numpy as np
import pytest

from collaudit.core.detection.rest_steps import RunningSums, travel


@pytest.mark.parametrize(("width", "rise"), [(1, 0), (4, 2), (12, 8), (40, 41)])
def test_a_step_is_the_mean_after_less_the_mean_before_where_both_are_known(width: int, rise: int) -> None:
    x = np.random.default_rng(width).normal(5.0, 1.0, 300)
    x[120:124] = np.nan
    rows, expected = np.flatnonzero(np.arange(300) % 7 < 4), np.full(x.size, np.nan)
    found = RunningSums.of(x).step(width, rise, rows)
    for k in range(width + rise // 2, x.size - width - rise + rise // 2 + 1):
        before = x[k - rise // 2 - width : k - rise // 2]
        after = x[k - rise // 2 + rise : k - rise // 2 + rise + width]
        if np.isfinite(x[k - width : k]).all():  # what is unknown just before is no step, either
            expected[k] = after.mean() - before.mean()
    np.testing.assert_allclose(found, expected[rows], atol=1e-12)


def test_nothing_known_gives_no_step() -> None:
    assert np.isnan(RunningSums.of(np.full(50, np.nan)).step(3, 1, np.arange(50))).all()


@pytest.mark.parametrize(("before", "after"), [(3, 5), (9, 2), (30, -10), (150, -90), (2, 190)])
def test_the_way_of_a_joint_is_that_of_its_windows_held_at_the_ends(before: int, after: int) -> None:
    x = np.random.default_rng(1).normal(size=200)
    length = before + after
    padded = np.pad(x, length, mode="constant", constant_values=np.nan)
    # Windows about each sample, as the sliding range has them, then taken at the place asked for.
    about = [padded[k + length - length // 2 : k + 2 * length - length // 2] for k in range(x.size)]
    spread = np.array([np.nanmax(w) - np.nanmin(w) for w in about])
    middle = np.clip(np.arange(x.size) - before + length // 2, 0, x.size - 1)
    np.testing.assert_array_equal(travel(x, before, after), spread[middle])
