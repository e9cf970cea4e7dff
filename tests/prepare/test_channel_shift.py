"""What channels are compared with, joint by joint and block by block, against whole tables."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np

from collaudit.core.data.joint_log import UniformSeries
from collaudit.core.numeric.arrays import Span
from collaudit.core.numeric.filters import differentiate, low_pass
from collaudit.core.prepare.channel_delay import all_known, position_velocity

SEGMENTS = (Span(0, 300), Span(310, 900))
PERIOD_S = 0.004


def test_velocity_of_positions_is_that_of_the_whole_table() -> None:
    q = np.cumsum(np.random.default_rng(0).normal(size=(900, 3)), axis=0)
    series = SimpleNamespace(position_rad=q, segments=SEGMENTS, period_s=PERIOD_S, bandwidth_hz=20.0)
    plain = low_pass(differentiate(q, SEGMENTS, PERIOD_S), SEGMENTS, PERIOD_S, 20.0)
    np.testing.assert_array_equal(position_velocity(cast(UniformSeries, series)), plain)


def test_known_samples_are_finite_in_every_table() -> None:
    rng = np.random.default_rng(1)
    first, second = rng.normal(size=(900, 3)), rng.normal(size=(900, 2))
    first[rng.random(900) < 0.05, 1], second[rng.random(900) < 0.05, 0] = np.nan, np.inf
    slope = differentiate(first, SEGMENTS, PERIOD_S)
    tables = [first, second, slope]
    plain = np.all([np.isfinite(table).all(axis=1) for table in tables], axis=0)
    assert 0 < np.count_nonzero(plain) < 800
    np.testing.assert_array_equal(all_known([first, second, slope]), plain)
    np.testing.assert_array_equal(all_known([first], [1]), np.isfinite(first[:, 1]))
