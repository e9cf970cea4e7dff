"""A log's means, against a loop over them."""

from __future__ import annotations

import numpy as np
import pytest
from synthetic import PERIOD, make_log

from collaudit.core.conditioning.conditioning import condition
from collaudit.core.config.schema import ConditioningConfig
from collaudit.core.torque_table.log_samples import TorqueTable, thinned


def test_means_are_those_of_what_is_known_and_of_half_at_least() -> None:
    rng = np.random.default_rng(0)
    values = np.asfortranarray(np.where(rng.random((103, 3)) < 0.4, np.nan, rng.normal(size=(103, 3))))
    found = thinned(values, 5)
    assert found.shape == (20, 3)
    for k, j in np.ndindex(found.shape):
        cell = values[5 * k : 5 * k + 5, j]
        known = cell[np.isfinite(cell)]
        assert found[k, j] == pytest.approx(known.mean() if known.size > 2 else np.nan, nan_ok=True)


def test_what_is_faster_than_the_table_is_gone_and_what_is_slower_stays() -> None:
    t = PERIOD * np.arange(20000)
    q, v = np.sin(t)[:, None], np.cos(t)[:, None]
    slow, fast = 20.0 * np.cos(t), 5.0 * np.sin(2.0 * np.pi * 80.0 * t)
    series = condition(make_log(t, q, v, (slow + fast)[:, None]), ConditioningConfig())
    table = TorqueTable.of(series, slow[: series.time_s.size, None])
    assert 0.02 < table.period_s <= 0.025
    rest = table.effort[:, 0] - table.model[:, 0]
    assert np.abs(rest).max() < 0.05 * 5.0
    sums = table.sums()["joint1"]
    assert sums.mean("beyond") == pytest.approx(0.0, abs=0.02)
    assert sums.sd("model") == pytest.approx(np.std(slow), rel=0.05)
