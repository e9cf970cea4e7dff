"""Interpolation of several columns at once against ``numpy.interp``: the same digits, whatever the clocks are."""

from __future__ import annotations

import numpy as np
import pytest

from collaudit.core.conditioning.stamp_order import interpolated

COUNT = 40_000
RNG = np.random.default_rng(3)
STEADY = 0.002 * np.arange(COUNT)
UNEVEN = np.cumsum(RNG.uniform(0.001, 0.003, COUNT))

CLOCKS = {
    "late by a part of a step": (STEADY, STEADY - 0.0007),
    "the very same": (UNEVEN, UNEVEN),
    "every other sample the same": (np.where(np.arange(COUNT) % 2, STEADY, STEADY + 1e-4), STEADY),
    "uneven samples": (np.linspace(UNEVEN[0], UNEVEN[-1], COUNT), UNEVEN),
    "three times as fast": (np.linspace(0.0, STEADY[-1], 3 * COUNT), STEADY),
    "a third as fast": (STEADY[::3] + 1e-4, STEADY),
    "beyond both ends": (np.linspace(-1.0, STEADY[-1] + 1.0, COUNT), STEADY),
    "all beyond the end": (STEADY + 1e4, STEADY),
    "stamps twice": (STEADY, np.repeat(STEADY[::2], 2)),
    "rounded stamps": (STEADY, np.round(UNEVEN, 2)),
    "since 1970": (1.7e9 + STEADY, 1.7e9 + UNEVEN),
    "one sample": (STEADY, np.array([1.0])),
    "one place": (STEADY[7:8], UNEVEN),
    "no place": (STEADY[:0], UNEVEN),
}


@pytest.mark.parametrize("clocks", CLOCKS)
@pytest.mark.parametrize("lost", [False, True], ids=["known", "with holes"])
def test_it_gives_the_digits_of_numpy(clocks: str, lost: bool) -> None:
    x, at = CLOCKS[clocks]
    values = RNG.standard_normal((at.size, 5))
    values[::3, 1] = -0.0
    if lost:
        values[::977, 2], values[5::1999, 3], values[:, 4] = np.nan, np.inf, 1e308 * np.sign(values[:, 4])
    for order in ("C", "F"):
        found = interpolated(x, at, np.asarray(values, order=order))  # type: ignore[call-overload]
        with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
            wanted = np.stack([np.interp(x, at, column) for column in values.T], axis=1)
        assert found.shape == wanted.shape
        np.testing.assert_array_equal(found, wanted)
        np.testing.assert_array_equal(np.signbit(found), np.signbit(wanted))
