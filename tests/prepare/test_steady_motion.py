"""Samples around which a joint moves one way, against a loop over samples."""

from __future__ import annotations

import numpy as np
import pytest

from collaudit.core.data.uniform_series import MOVING_RAD_S
from collaudit.core.prepare.effort.channel_shift import steady


def plain(v: np.ndarray, margin: int) -> list[bool]:
    """Whether the sample and so many on either side of it move one way; not where the log has fewer."""
    out = [False] * v.size
    for k in range(margin, v.size - margin):
        near = v[k - margin : k + margin + 1]
        out[k] = bool((near > MOVING_RAD_S).all() or (near < -MOVING_RAD_S).all())
    return out


@pytest.mark.parametrize("margin", [0, 1, 4])
def test_steady_samples_are_those_with_motion_one_way_around_them(margin: int) -> None:
    rng = np.random.default_rng(margin)
    v = np.repeat(rng.choice([-0.3, -0.01, 0.0, 0.01, 0.3, np.nan, MOVING_RAD_S], 60), rng.integers(1, 30, 60))
    found = steady(v, MOVING_RAD_S, margin)
    assert found.any() and not found.all()
    assert found.tolist() == plain(v, margin)
