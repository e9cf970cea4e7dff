"""A still joint that dithers by a step of its encoder does not move."""

from __future__ import annotations

import numpy as np
from synthetic import make_log

from collaudit.core.conditioning.conditioning import condition
from collaudit.core.config.schema import ConditioningConfig
from collaudit.core.verdict.coverage import known_motion

PERIOD, STEP = 0.01, np.radians(0.0075)


def moves(q: np.ndarray) -> np.ndarray:
    t = PERIOD * np.arange(q.size)
    effort = np.random.default_rng(1).normal(0, 0.1, q.size)
    v = np.gradient(q, PERIOD)
    series = condition(make_log(t, q[:, None], v[:, None], effort[:, None]), ConditioningConfig())
    assert np.abs(series.velocity_rad_s).max() > 1e-3
    return known_motion(series, series.joint_names[0], series.position_rad[:, 0], np.zeros(q.size, dtype=np.int8))


def test_dither_is_rest_and_creeping_is_not() -> None:
    steps = np.random.default_rng(0).integers(0, 3, 2000)
    assert not moves(0.3 + STEP * steps).any()
    creeping = 0.3 + STEP * np.round(0.003 * PERIOD * np.arange(2000) / STEP)
    assert np.mean(moves(creeping)) > 0.9


def test_what_never_leaves_its_place_does_not_move_however_it_sways() -> None:
    """An arm that is said never to move is in motion for no time: swaying by 6 mrad, a touch a second."""
    assert not moves(0.3 + 0.003 * np.sin(2 * np.pi * 0.5 * PERIOD * np.arange(2000))).any()
    assert np.mean(moves(0.3 + 0.02 * np.sin(2 * np.pi * 0.5 * PERIOD * np.arange(2000)))) > 0.9
