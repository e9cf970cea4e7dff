"""One stretch of time with a torque of its own, in motion that otherwise comes again and again."""

from __future__ import annotations

import numpy as np
import pytest

from collaudit.core.identification.lasting_contact import lasting_step
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.robust_regression import Columns

RATE_HZ = 100.0
NOISE_NM = 0.2


def motion(seconds: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Time, columns of friction and gravity, and the effort that they explain, with noise."""
    t = np.arange(0.0, seconds, 1.0 / RATE_HZ)
    columns = np.column_stack([np.sign(np.sin(2.1 * t)), np.sin(2.1 * t), np.cos(0.7 * t)])
    return t, columns, columns @ [5.0, 2.0, 12.0] + np.random.default_rng(1).normal(0.0, NOISE_NM, t.size)


@pytest.mark.parametrize(("start_s", "end_s"), [(10.0, 14.0), (20.0, 40.0), (30.0, 60.0)])
def test_a_clamp_is_found_where_it_is(start_s: float, end_s: float) -> None:
    t, columns, effort = motion(60.0)
    effort += 10.0 * ((t >= start_s) & (t < end_s))
    found = lasting_step(Columns.of(columns), effort, t, 0.0)
    assert found is not None
    assert abs(found.torque) == pytest.approx(10.0, abs=0.5)
    inside = (t[found.first], t[found.last - 1])
    outside = (start_s, end_s) == (30.0, 60.0) and inside[0] < 1.0  # of two halves either may be the contact
    assert outside or inside == pytest.approx((start_s, end_s), abs=0.6)


def test_clean_motion_has_none() -> None:
    t, columns, effort = motion(60.0)
    assert lasting_step(Columns.of(columns), effort, t, 0.0) is None


def test_a_short_log_does_not_tell() -> None:
    """A few motions, each made once, leave errors of the model that look like one block of time."""
    t, columns, effort = motion(12.0)
    effort += 10.0 * ((t >= 5.0) & (t < 8.0))
    assert lasting_step(Columns.of(columns), effort, t, 0.0) is None
