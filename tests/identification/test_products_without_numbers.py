"""Products that are no numbers end a fit with a reason and no bug."""

from __future__ import annotations

import numpy as np
import pytest

from collaudit.core.errors import NotJudgedError
from collaudit.core.torque_table.block_sums import generalised_inverse


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_what_cannot_be_inverted_is_not_judged(bad: float) -> None:
    gram = np.eye(3)
    gram[0, 1] = gram[1, 0] = bad
    with pytest.raises(NotJudgedError, match="beyond any arm"):
        generalised_inverse(gram)
    assert np.allclose(generalised_inverse(np.eye(3)), np.eye(3))
