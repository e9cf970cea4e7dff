"""A column that holds some of its samples only gives what the whole one would."""

import numpy as np
import pytest

from collaudit.core.numeric.sparse_column import SparseColumn


@pytest.mark.parametrize("share", [0.0, 0.2, 1.0])
def test_a_column_of_some_samples_answers_as_the_whole_one(share: float) -> None:
    rng = np.random.default_rng(3)
    mask = rng.random(200) < share
    whole = np.where(mask, rng.normal(size=200), 0.0)
    samples = rng.integers(0, 200, (4, 30))
    for column in (SparseColumn.of(whole), SparseColumn(np.flatnonzero(mask), whole[mask])):
        np.testing.assert_array_equal(column.at(samples), whole[samples])
        np.testing.assert_array_equal(column.at(column.rows), whole[column.rows])


def test_one_value_stands_at_every_marked_sample() -> None:
    column = SparseColumn.at_marked(np.array([False, True, True]), np.inf)
    np.testing.assert_array_equal(column.at(np.arange(3)), [0.0, np.inf, np.inf])
