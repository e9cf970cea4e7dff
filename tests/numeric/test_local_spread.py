"""The spread of residuals by cell, and columns made block by block, against the same over all samples at once."""

from __future__ import annotations

import numpy as np

from collaudit.core.numeric.robust_regression import Columns, local_spread
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


def test_columns_made_block_by_block_are_those_at_hand() -> None:
    rng = np.random.default_rng(5)
    columns = rng.standard_normal((50_003, 15))  # several blocks, the last one short
    made = Columns.of(columns)
    coefficients = rng.standard_normal(15)
    assert np.allclose(made.times(coefficients), columns @ coefficients, rtol=0, atol=1e-12)
    rows = np.flatnonzero(rng.random(50_003) < 0.7)
    assert np.array_equal(made.only(rows).at(np.arange(0, rows.size, 7)), columns[rows][::7])
