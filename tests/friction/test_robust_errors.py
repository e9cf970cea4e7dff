"""Cluster-robust errors against statsmodels, wherever both claim the same."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import t as student
from statsmodels.regression.linear_model import OLS

from collaudit.core.friction.friction_variation import friction_slope


def wander(rng: np.random.Generator, n: int, alike: int) -> np.ndarray:
    """Noise whose neighbours err alike."""
    return np.repeat(rng.standard_normal(n // alike + 1), alike)[:n] + 0.3 * rng.standard_normal(n)


def test_the_interval_of_time_and_temperature_is_a_cluster_jackknife() -> None:
    """Each cluster left out of an ordinary regression in turn; freedom is Satterthwaite's from the clusters' shares.

    The table takes each cluster's share of the one column for that of all: its interval is nearly the same.
    """
    rng = np.random.default_rng(2)
    time_s = 0.05 * np.arange(2400)
    speed = np.abs(np.sin(0.9 * time_s)) + 0.05
    sign = np.sign(np.sin(0.9 * time_s))
    friction = sign * (8.0 + 3.0 * speed)
    beside = np.column_stack([np.ones_like(speed), sign, sign * speed])
    residual = -0.01 * friction * time_s / 60.0 + wander(rng, time_s.size, 30)
    found = friction_slope(time_s, residual, friction, beside, time_s / 60.0)
    assert found is not None
    middle = np.sum(friction**2 * time_s / 60.0) / np.sum(friction**2)
    design = np.column_stack([friction * (time_s / 60.0 - middle), beside])
    groups = np.floor(time_s / 8.0).astype(int)
    ids = np.unique(groups)
    slope = OLS(residual, design).fit().params[0]
    without = np.array([OLS(residual[groups != g], design[groups != g]).fit().params[0] for g in ids])
    left = OLS(design[:, 0], beside).fit().resid  # what the others leave of the column
    share = np.array([np.sum(left[groups == g] ** 2) for g in ids])
    freedom = share.sum() ** 2 / np.sum(share**2) - 1.0
    error = np.sqrt((ids.size - 1) / ids.size * np.sum((without - without.mean()) ** 2))
    half = student.ppf(0.975, freedom) * error
    assert found[0] == pytest.approx(slope, rel=1e-8)
    assert 0.5 * (found[1][1] - found[1][0]) == pytest.approx(half, rel=0.07)
