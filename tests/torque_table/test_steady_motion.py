"""Samples at which friction slides, against a loop over samples."""

from __future__ import annotations

import numpy as np
import pytest

from collaudit.core.data.joint_log import MOVING_RAD_S
from collaudit.core.numeric.arrays import Span
from collaudit.core.torque_table.log_samples import REVERSAL_TRAVEL_RAD, sliding

PERIOD_S = 0.002


def travelled(q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Whether the joint turns, a hundredth of a radian from where it began to."""
    out, begun = np.zeros(v.size, dtype=bool), 0.0
    for k in range(v.size):
        fast = abs(v[k]) >= MOVING_RAD_S
        if not fast or k == 0 or v[k] * v[k - 1] < 0:
            begun = q[k]
        out[k] = fast and abs(q[k] - begun) >= REVERSAL_TRAVEL_RAD
    return out


def plain(q: np.ndarray, v: np.ndarray, margin: int) -> list[bool]:
    """Whether so long on either side the joint turns one way, that far from both ends of its way."""
    moved = np.where(travelled(q, v) & travelled(q[::-1], v[::-1])[::-1], np.sign(v), 0.0)
    out = [False] * v.size
    for k in range(margin, v.size - margin):
        near = moved[k - margin : k + margin + 1]
        out[k] = bool((near == 1.0).all() or (near == -1.0).all())
    return out


@pytest.mark.parametrize("margin", [0, 1, 4])
def test_friction_slides_where_a_joint_has_travelled_one_way(margin: int) -> None:
    rng = np.random.default_rng(margin)
    v = np.repeat(rng.choice([-0.9, -0.01, 0.0, 0.01, 0.9, 2.0 * MOVING_RAD_S], 60), rng.integers(1, 60, 60))
    q = np.cumsum(v) * PERIOD_S
    found = sliding([Span(0, v.size)], q, v, MOVING_RAD_S, margin)
    assert found.any() and not found.all()
    assert found.tolist() == plain(q, v, margin)
