"""What stands in for ``scipy.signal`` is what ``scipy.signal`` computes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from collaudit.core.numeric.filters import butterworth, filtfilt, first_order_hold, lfilter, lfilter_zi


@pytest.mark.parametrize("corner", [0.001, 0.03, 0.4, 0.94])
def test_low_passes_are_those_of_scipy(corner: float) -> None:
    b, a = butterworth(corner)
    expected = signal.butter(2, corner)
    np.testing.assert_allclose(b, expected[0], rtol=1e-9)
    np.testing.assert_allclose(a, expected[1], rtol=1e-9)
    np.testing.assert_allclose(lfilter_zi(b, a), signal.lfilter_zi(b, a), rtol=1e-6)
    x = np.random.default_rng(1).standard_normal((500, 3))
    zi = lfilter_zi(b, a)[:, None] * x[:1]
    np.testing.assert_allclose(lfilter(b, a, x, zi), signal.lfilter(b, a, x, axis=0, zi=zi)[0], rtol=1e-12)
    for pad in (0, 1, 40, 499):
        found = filtfilt(b, a, x, pad, lfilter_zi(b, a))
        np.testing.assert_allclose(found, signal.filtfilt(b, a, x, axis=0, padlen=pad), atol=1e-9)


@pytest.mark.parametrize("system", [((60.0,), (1.0, 60.0)), ((3600.0,), (1.0, 84.85, 3600.0)), ((1.0, 0.0), (0.1, 1.0)),
                                    ((9.0, 40.0), (1.0, 14.0, 49.0, 40.0))])  # fmt: skip
@pytest.mark.parametrize("period_s", [0.0002, 0.002, 0.033])
def test_filters_in_s_are_held_as_scipy_holds_them(system: tuple[tuple[float, ...], ...], period_s: float) -> None:
    num, den = (np.array(x) for x in system)
    b, a = first_order_hold(num, den, period_s)
    rows, expected, _ = signal.cont2discrete((num, den), period_s, method="foh")
    np.testing.assert_allclose(b, rows[0], rtol=1e-8, atol=1e-13)
    np.testing.assert_allclose(a, expected, rtol=1e-10)
