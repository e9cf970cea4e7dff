"""Ripple of a friction file is taken off only where the judged log has it at the same place."""

from __future__ import annotations

import numpy as np
import pytest
from origins import log_source

from collaudit.core.data.friction_result import RippleWave
from collaudit.core.data.joint_log import UniformSeries
from collaudit.core.friction.friction_model import FrictionModel
from collaudit.core.numeric.arrays import Span
from collaudit.core.numeric.filters import double_pole
from collaudit.core.residual.friction_bounds import known_ripple

T = 0.002
LAW = FrictionModel(
    "coulomb-viscous",
    {"A": 5.0, "D": 1.0},
    (0.05, 1.0),
    False,
    ripple=(RippleWave(200.0, (0.0, 1.0), (0.0, 0.0), 0.02),),
)


def taken_off(phase: float, push_nm: float = 0.0) -> tuple[np.ndarray, np.ndarray, float]:
    t = T * np.arange(10_000)
    q = 0.5 * np.sin(0.7 * t)
    zero = np.zeros((t.size, 1))
    series = UniformSeries(
        t, T, ("joint1",), q[:, None], np.gradient(q, T)[:, None], zero, zero, "Nm", None, (Span(0, t.size),),
        np.zeros(t.size, bool), np.zeros((t.size, 1), bool), 20.0, log_source(),
    )  # fmt: skip
    left = np.sin(200 * q + phase) + 0.3 * np.random.default_rng(0).standard_normal(t.size)
    left[2000:3000] += push_nm
    usable = np.ones(t.size, dtype=bool)
    ripple, doubt = known_ripple(series, 0, series.velocity_rad_s[:, 0], LAW, double_pole(1e4, False), left, usable)
    return left, np.broadcast_to(np.asarray(ripple), t.shape), doubt


@pytest.mark.parametrize("push_nm", [0.0, 40.0])
def test_at_its_place(push_nm: float) -> None:
    left, ripple, doubt = taken_off(0.0, push_nm)
    assert np.std((left - ripple)[4000:]) == pytest.approx(0.3, rel=0.05)
    assert doubt == pytest.approx(0.04)


def test_elsewhere_the_threshold_carries_it() -> None:
    for phase in (np.pi, 2.0):
        _, ripple, doubt = taken_off(phase)
        assert not ripple.any()
        assert doubt == pytest.approx(1.0)
