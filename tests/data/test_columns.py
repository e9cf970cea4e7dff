"""Tables that are computed where they are read, against the same tables in memory."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from collaudit.core.data.columns import Columns, KnownAtFew, OfTwo, Slope
from collaudit.core.numeric.arrays import Span
from collaudit.core.numeric.filters import differentiate

RNG = np.random.default_rng(3)
N, J, PERIOD_S = 60, 3, 0.002
SEGMENTS = (Span(0, 7), Span(9, 10), Span(10, 12), Span(15, 41), Span(41, 41), Span(44, 58))
FIRST, SECOND = (np.asfortranarray(RNG.normal(size=(N, J))) for _ in range(2))


def known_at_few() -> tuple[Columns, np.ndarray]:
    whole = np.full((N, J), np.nan, dtype=np.float32)
    rows = [np.flatnonzero(RNG.random(N) < 0.2).astype(np.int32) for _ in range(J)]
    values = [RNG.normal(size=part.size).astype(np.float32) for part in rows]
    for j in range(J):
        whole[rows[j], j] = values[j]
    return KnownAtFew(N, rows, values), whole


TABLES = {
    "difference": (OfTwo(np.subtract, FIRST, SECOND), FIRST - SECOND),
    "sum": (OfTwo(np.add, FIRST, SECOND), FIRST + SECOND),
    "slope": (Slope(FIRST, SEGMENTS, PERIOD_S), differentiate(FIRST, SEGMENTS, PERIOD_S)),
    "known at few": known_at_few(),
}


@pytest.mark.parametrize("name", TABLES)
def test_every_part_is_that_of_the_table_in_memory(name: str) -> None:
    table, plain = TABLES[name]
    assert table.shape == plain.shape
    for start in range(N + 1):
        for stop in (start, start + 1, start + 2, start + 9, N, N + 5):
            np.testing.assert_array_equal(table[start:stop], plain[start:stop])
    rows = np.array([3, 50, 3, 16, 0, N - 1])
    mask = RNG.random(N) < 0.5
    close, none = np.array([9, 41, 10, 12, 15, *range(16, 40)]), np.empty(0, dtype=np.int64)
    for pick in (slice(None), slice(4, None, 3), slice(-9, -2), rows, close, none, -close, mask, 17, -1, [5, 6]):
        np.testing.assert_array_equal(table[pick], plain[pick])
        np.testing.assert_array_equal(table[pick, 1], plain[pick, 1])
        np.testing.assert_array_equal(table[pick, :][..., [2, 0]], plain[pick, :][..., [2, 0]])
    np.testing.assert_array_equal(np.asarray(table), plain)
    assert np.asarray(table).dtype == plain.dtype
    np.testing.assert_array_equal(np.asarray(pickle.loads(pickle.dumps(table))), plain)
