"""Minima and roots of functions of one number: digit for digit those of SciPy."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar

from collaudit.core.numeric import scalar_search

FUNCTIONS: tuple[Callable[[float], float], ...] = (
    lambda x: (x - 0.7) ** 2,
    lambda x: -math.exp(-((x - 1.3) ** 2)) + 0.01 * x,
    lambda x: abs(x - 2.9),
    lambda x: x,
    lambda x: -x,
    lambda x: 1.0,
    lambda x: math.cos(3.0 * x),
)


@pytest.mark.parametrize("function", FUNCTIONS)
def test_minimum_has_the_digits_of_scipy(function: Callable[[float], float]) -> None:
    for low, high in ((0.0, 3.0), (-1.0, 0.71), (1.2, 1.31)):
        ours = scalar_search.bounded_minimum(function, low, high, 1e-9)
        theirs = minimize_scalar(function, bounds=(low, high), method="bounded", options={"xatol": 1e-9}).x
        assert ours == float(theirs)


@pytest.mark.parametrize("compiled", [True, False])
def test_root_has_the_digits_of_scipy(compiled: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    if not compiled:
        monkeypatch.setattr(scalar_search, "_compiled", lambda: None)
    for level in np.linspace(0.1, 6.9, 9):
        ours = scalar_search.root(lambda x, level=float(level): x**3 - level, 0.0, 2.0, 1e-12)
        assert ours == brentq(lambda x, level=float(level): x**3 - level, 0.0, 2.0, xtol=1e-12)
    with pytest.raises(ValueError, match="sign"):
        scalar_search.root(lambda x: x**2 + 1.0, 0.0, 2.0, 1e-12)
    with pytest.raises(ValueError):
        scalar_search.root(lambda x: math.nan if 0.5 < x < 1.9 else x - 1.0, 0.0, 2.0, 1e-12)
