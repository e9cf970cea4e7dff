"""Strokes with a contact at speeds that nothing else of the log tells friction of."""

from __future__ import annotations

import numpy as np
import pytest

from collaudit.core.identification.lone_speeds import untold_beside

PERIOD_S = 0.01


def strokes(*speeds: float) -> tuple[np.ndarray, np.ndarray]:
    """Rows and speed of strokes of a second, half a second of rest between them."""
    rows = np.concatenate([np.arange(100) + 150 * k for k in range(len(speeds))])
    return rows, np.repeat(speeds, 100)


@pytest.mark.parametrize(("others", "out"), [((0.5, 0.9), True), ((0.5, 0.045), False)])
def test_two_levels_at_one_speed_need_a_witness(others: tuple[float, float], out: bool) -> None:
    """The first 30 samples of the slow stroke lie far off: which part is friction only another slow stroke tells."""
    rows, speed = strokes(0.04, *others)
    far = np.zeros(500, dtype=bool)
    far[:30] = True
    found = untold_beside(rows, speed, far, PERIOD_S, 1.0)
    assert found[30:100].all() == out
    assert found[100:150].all() == out  # the rest between the strokes tells nothing, and goes with it
    assert not found[150:].any()


def test_nothing_far_off_leaves_all_in() -> None:
    rows, speed = strokes(0.04, 0.5, 0.9)
    assert not untold_beside(rows, speed, np.zeros(500, dtype=bool), PERIOD_S, 1.0).any()
