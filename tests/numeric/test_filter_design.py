"""Filters without scipy.signal are those of scipy.signal, bit for bit."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy import linalg, signal

from collaudit.core.numeric import filter_design
from collaudit.core.numeric import linear_filter as loading
from collaudit.core.numeric.filter_design import butterworth_low_pass, first_order_hold, settled_state
from collaudit.core.numeric.linear_filter import linear_filter


def test_the_low_pass_and_its_settled_state() -> None:
    for corner in np.random.default_rng(1).uniform(1e-4, 0.95, 200).tolist():
        ours, theirs = butterworth_low_pass(corner), signal.butter(2, corner)
        for one, other in zip(ours, theirs, strict=True):
            np.testing.assert_array_equal(one, other)
        np.testing.assert_array_equal(settled_state(*ours), signal.lfilter_zi(*theirs))


def test_nobody_can_change_what_others_get() -> None:
    b, a = butterworth_low_pass(0.1)
    for values in (b, a, settled_state(b, a)):
        with pytest.raises(ValueError, match="read-only"):
            values[0] = 0.0
    assert settled_state(2.0 * b, a)[0] != settled_state(b, a)[0]


@pytest.mark.parametrize(
    ("numerator", "denominator"),
    [
        ((60.0,), (1.0, 60.0)),
        ((60.0, 0.0), (1.0, 60.0)),
        ((900.0,), (1.0, 42.0, 900.0)),
        ((900.0, 0.0), (2.0, 60.0, 900.0)),
        ((3.0, 2.0, 900.0), (1.0, 60.0, 900.0)),
    ],
)
@pytest.mark.parametrize("period_s", [0.001, 0.01, 0.05])
def test_the_first_order_hold(numerator: tuple[float, ...], denominator: tuple[float, ...], period_s: float) -> None:
    top, bottom = np.array(numerator), np.array(denominator)
    b, a = first_order_hold(top, bottom, period_s)
    expected_b, expected_a, _ = signal.cont2discrete((top, bottom), period_s, method="foh")
    np.testing.assert_array_equal(b, expected_b[0])
    np.testing.assert_array_equal(a, expected_a)
    np.testing.assert_array_equal(settled_state(b, a), signal.lfilter_zi(b, a))


@pytest.mark.parametrize("compiled", [True, False])
def test_rows_in_parts_are_filtered_as_a_whole(compiled: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    if not compiled:
        monkeypatch.setattr(loading, "_compiled", lambda: None)
    b, a = butterworth_low_pass(0.1)
    x = np.random.default_rng(2).standard_normal((3, 1000))
    state, parts = np.zeros((3, 2)), []
    for start, stop in pairwise((0, 1, 400, 1000)):
        part, state = linear_filter(b, a, x[:, start:stop], state)
        parts.append(part)
    np.testing.assert_array_equal(np.hstack(parts), signal.lfilter(b, a, x, axis=-1))


def test_a_filter_without_recursion() -> None:
    x = np.arange(12.0).reshape(2, 6)
    result, state = linear_filter(np.array([1.0, 2.0]), np.array([1.0]), x, np.zeros((2, 1)))
    expected, after = signal.lfilter([1.0, 2.0], [1.0], x, axis=-1, zi=np.zeros((2, 1)))
    np.testing.assert_array_equal(result, expected)
    np.testing.assert_array_equal(state, after)


def test_exponential_is_that_of_scipy_in_every_shape() -> None:
    rng = np.random.default_rng(3)
    for size in (2, 3, 4):
        a = rng.standard_normal((size, size))
        for one in (a, np.triu(a), np.tril(a), np.triu(a, 1), 40.0 * a, np.diag(np.diag(a)), np.zeros_like(a)):
            np.testing.assert_array_equal(filter_design.matrix_exponential(one), linalg.expm(one))
    assert filter_design._compiled_exponential() is not None
