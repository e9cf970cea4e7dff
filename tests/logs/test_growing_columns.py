"""Columns that grow while a log is read keep what they were given, whatever a file claims of its length."""

from __future__ import annotations

import numpy as np
import pytest

from collaudit.core.logs.messages.message_decoding import Growing


@pytest.mark.parametrize("claimed", [0, 1, 5_000, 20_000, 10**18])
@pytest.mark.parametrize("width", [0, 3])
def test_rows_are_kept_in_order(claimed: int, width: int) -> None:
    rng = np.random.default_rng(1)
    shape = (20_000, width) if width else (20_000,)
    rows = rng.normal(size=shape) if width else rng.integers(0, 1 << 60, shape)
    column = Growing(width, claimed)
    for part in np.array_split(rows, [1, 7, 300, 4_000, 9_999]):
        column.add(part)
    assert len(column) == len(rows)
    np.testing.assert_array_equal(column.so_far(), rows)


def test_a_claim_that_holds_is_all_the_room_there_is() -> None:
    column = Growing(7, 5_000)
    column.add(np.zeros((1_000, 7)))
    assert column.so_far().base.shape == (5_000, 7)


def test_a_false_claim_takes_no_memory() -> None:
    """Memory of 10^18 rows could not be had."""
    column = Growing(7, 10**18)
    column.add(np.zeros((1_000, 7)))
    assert column.so_far().base.nbytes < 1e7
