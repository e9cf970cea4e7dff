"""The spread of residuals by cell, against the same written plainly."""

from __future__ import annotations

import numpy as np

from collaudit.core.numeric.robust_regression import local_spread
from collaudit.core.numeric.stats import robust_sd


def test_each_cell_has_the_spread_of_its_kept_samples() -> None:
    rng = np.random.default_rng(4)
    conditions = np.round(rng.exponential(size=(4000, 2)), 2)  # values that lie on the quantiles, too
    rest = rng.standard_normal(4000) * (0.5 + conditions[:, 0])
    kept = rng.random(4000) < 0.8
    kept[conditions[:, 1] > 2.0] = False
    whole, least = robust_sd(rest[kept]), 150
    edges = [np.quantile(column[kept], (0.1, 0.4, 0.7)) for column in conditions.T]
    cell = 4 * np.searchsorted(edges[0], conditions[:, 0]) + np.searchsorted(edges[1], conditions[:, 1])
    plain = np.full(4000, whole)
    told = 0
    for number in range(16):
        inside = cell == number
        if np.count_nonzero(inside & kept) >= least:
            plain[inside] = max(whole, robust_sd(rest[inside & kept]))
            told += 1
    assert 4 < told < 16
    assert np.array_equal(local_spread(rest, kept, tuple(conditions.T), least), plain)
