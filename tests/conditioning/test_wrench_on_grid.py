"""A wrench comes onto the grid by its stamps, in whatever order and however often they were written."""

from __future__ import annotations

import numpy as np
import pytest

from collaudit.core.conditioning.conditioning import wrench_on_grid
from collaudit.core.data.joint_log import WrenchSeries

TIME_S = np.arange(500) * 0.004


def course(time_s: np.ndarray) -> np.ndarray:
    return np.column_stack([np.sin(time_s + k) for k in range(6)])


@pytest.mark.parametrize("rows", ["as they are", "in pairs turned", "shuffled", "doubled", "one without a stamp"])
def test_the_order_of_its_rows_does_not_matter(rows: str) -> None:
    order = np.arange(500)
    if rows == "in pairs turned":
        order = order.reshape(-1, 2)[:, ::-1].ravel()
    elif rows == "shuffled":
        order = np.random.default_rng(1).permutation(order)
    elif rows == "doubled":
        order = np.sort(np.concatenate([order, order[::3]]))
    stamps = TIME_S[order]
    if rows == "one without a stamp":
        stamps[100] = np.nan
    out, findings = wrench_on_grid(
        WrenchSeries(stamps, course(TIME_S[order]), "/wrench"), TIME_S, np.ones(500, dtype=bool), 20.0
    )
    np.testing.assert_allclose(out, course(TIME_S), atol=1e-5)
    assert findings == []
