"""SciPy's compiled functions are found, tried, and given up where they are not what they were."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.optimize import nnls

from collaudit.core.numeric import linear_filter, nonnegative_fit, scalar_search
from collaudit.core.numeric.compiled_scipy import compiled_function


def test_the_functions_are_found_in_this_scipy() -> None:
    assert linear_filter._compiled() is not None
    assert nonnegative_fit._compiled() is not None
    assert scalar_search._compiled() is not None


@pytest.mark.parametrize("agrees", [linear_filter._agrees, nonnegative_fit._agrees, scalar_search._agrees])
@pytest.mark.parametrize("other", [lambda *arguments: arguments[2:], lambda: None, lambda *_: (np.zeros(2), 1.0, 1)])
def test_another_function_of_the_name_is_refused(agrees: Any, other: Any) -> None:
    found = compiled_function("signal/_sigtools", "_linear_filter", lambda _: agrees(other))
    assert found is None


def test_what_is_not_there_is_none() -> None:
    assert compiled_function("signal/_no_such_module", "f", lambda _: True) is None
    assert compiled_function("signal/_sigtools", "no_such_function", lambda _: True) is None
    assert compiled_function("signal/_sigtools", "_linear_filter", lambda _: False) is None


@pytest.mark.parametrize("compiled", [True, False])
def test_the_fit_is_that_of_scipy(compiled: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    if not compiled:
        monkeypatch.setattr(nonnegative_fit, "_compiled", lambda: None)
    rng = np.random.default_rng(5)
    for _ in range(20):
        a, b = rng.standard_normal((8, 3)), rng.standard_normal(8)
        np.testing.assert_array_equal(nonnegative_fit.nonnegative_fit(a[:, ::-1], b), nnls(a[:, ::-1], b)[0])
    with pytest.raises(ValueError, match="infs or NaNs"):
        nonnegative_fit.nonnegative_fit(np.eye(2), np.array([np.nan, 1.0]))
