"""Gaps of a log take few blocks, and a stretch of blocks is found again in time."""

from __future__ import annotations

import numpy as np

from collaudit.core.arm_states.hand_guiding import counted_in_time, without_gaps

NUMBERS = np.array([0, 0, 1, 2, 22, 23, 10_000_000, 10_000_001, 10_000_003])


def test_only_long_gaps_are_cut() -> None:
    assert without_gaps(NUMBERS, 20).tolist() == [0, 0, 1, 2, 22, 23, 43, 44, 46]


def test_a_stretch_is_found_again_in_time() -> None:
    block = without_gaps(NUMBERS, 20)
    assert counted_in_time(NUMBERS, block, 1, 3) == (1, 3)
    assert counted_in_time(NUMBERS, block, 43, 47) == (10_000_000, 10_000_004)
