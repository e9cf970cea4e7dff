"""Friction as an interval and as a level: against the full bristle model of eqs. (7)-(9), and against truth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from origins import log_source

from collaudit.core.data.friction_result import LoadFriction
from collaudit.core.data.identification_result import Trend, TrendFit
from collaudit.core.data.joint_log import UniformSeries
from collaudit.core.friction.friction_model import FrictionModel
from collaudit.core.numeric.arrays import Span
from collaudit.core.residual.followed_offsets import LARGEST, follow_level
from collaudit.core.residual.friction_bounds import friction_bounds
from collaudit.core.torque_table.log_samples import settled

T = 0.002
A, B, C, D = 7.1, 2.5, 26.3, 17.0


def law() -> FrictionModel:
    from collaudit.core.data.friction_result import FrictionFit

    fit = FrictionFit(
        model="static-lugre",
        parameters={"A_nm": A, "B_nm": B, "C_s_per_rad": C, "D_nm_s_per_rad": D},
        ci95={},
        covariance=None,
        identifiable=True,
        not_identifiable=(),
        known=(),
        n_points=30,
        n_pairs=30,
        speed_range_rad_s=(0.02, 1.2),
        rmse_nm=0.0,
        effort_unit="N·m",
        points=(),
    )
    made = FrictionModel.of(fit)
    assert made is not None
    return made


def bristles(v: np.ndarray, presliding_rad: float) -> np.ndarray:
    """Eqs. (7)-(9) with delta = 1, integrated at 50 steps a sample, implicitly in z."""
    s0 = (A + B) / presliding_rad
    z, h, out = 0.0, T / 50, np.zeros(v.size)
    for k in range(v.size):
        x = v[k]
        g = A + B * np.exp(-C * abs(x))
        for _ in range(50):
            z = (z + h * x) / (1.0 + h * s0 * abs(x) / g)
        out[k] = s0 * z + D * x
    return out


def motion(v: np.ndarray) -> UniformSeries:
    n = v.size
    q = np.cumsum(v) * T
    zero = np.zeros((n, 1))
    return UniformSeries(
        T * np.arange(n), T, ("joint1",), q[:, None], v[:, None], zero, zero, "Nm", None, (Span(0, n),),
        np.zeros(n, bool), np.zeros((n, 1), bool), 20.0, log_source(),
    )  # fmt: skip


@pytest.mark.parametrize("presliding_rad", [1.5e-4, 7.5e-4], ids=["stiff", "five times softer"])
def test_the_bristle_friction_lies_within_its_bounds_through_reversals(presliding_rad: float) -> None:
    t = T * np.arange(6000)
    v = 0.35 * np.sin(2.2 * t) + 0.2 * np.sin(5.1 * t + 1.0)
    true = bristles(v, presliding_rad)
    band = friction_bounds(motion(v), 0, v, law())
    slack = 0.65  # the Stribeck curve lags behind soft bristles near its foot; a sixth of the paper's gamma
    assert np.all(true <= band.high_nm + slack)
    assert np.all(true >= band.low_nm - slack)
    assert 0.5 < np.mean(band.steady) < 0.95
    assert np.max(np.abs(true - band.sliding_nm)[~band.steady]) > 5.0, "the steady law alone is far off there"
    assert np.max(np.abs(true - band.sliding_nm)[band.steady]) < 0.65


def test_slower_than_the_fitted_speeds_friction_opposes_the_motion_and_its_size_is_a_range() -> None:
    """Motion of up to 0.2 rad/s against a law of 0.3 rad/s and more: beyond its reversals friction has one sign."""
    v = 0.2 * np.sin(1.5 * T * np.arange(6000))
    true = bristles(v, 1.5e-4)
    fast = replace(law(), speed_range=(0.3, 1.2), breakaway_known=False)
    band = friction_bounds(motion(v), 0, v, fast)
    assert not band.steady.any()
    assert np.all(true <= band.high_nm + 0.65)
    assert np.all(true >= band.low_nm - 0.65)
    sliding = settled(motion(v).segments, motion(v).position_rad[:, 0], v, 0.02)[0]
    assert np.mean(sliding) > 0.7
    assert np.all((np.sign(v) * np.where(v > 0, band.low_nm, band.high_nm))[sliding] > 5.0)
    assert np.all((band.high_nm - band.low_nm)[sliding] < 0.35 * 2.0 * fast.hold)
    farthest = np.maximum(np.abs(band.low_nm), np.abs(band.high_nm))
    assert farthest == pytest.approx(fast.hold, rel=1e-6), "its fall from breakaway may lie below the fitted speeds"
    assert (band.high_nm - band.low_nm)[np.abs(v) < 0.02] == pytest.approx(2.0 * fast.hold), "at rest it is any"


def test_a_joint_whose_velocity_has_an_offset_does_not_slide() -> None:
    """It stands, with the noise of an encoder: friction is anything."""
    still = motion(np.zeros(4000))
    noisy = still.position_rad + np.random.default_rng(1).normal(0.0, 1e-4, still.position_rad.shape)
    slow = replace(law(), speed_range=(0.3, 1.2), breakaway_known=False)
    band = friction_bounds(replace(still, position_rad=noisy), 0, np.full(4000, 0.05), slow)
    assert (band.high_nm - band.low_nm).min() > 1.5 * slow.hold


def test_at_rest_anything_up_to_breakaway_is_consistent() -> None:
    v = np.zeros(500)
    band = friction_bounds(motion(v), 0, v, law())
    assert not band.steady.any()
    assert band.high_nm == pytest.approx(np.full(500, A + B))
    assert band.low_nm == pytest.approx(np.full(500, -A - B))


def test_a_reversal_between_two_samples_is_a_reversal() -> None:
    v = np.r_[np.full(400, 0.3), np.full(400, -0.3)]
    band = friction_bounds(motion(v), 0, v, law())
    assert not band.steady[400]
    assert band.high_nm[400] > A


def noisy(seconds: float, level: np.ndarray | float, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Friction over a random motion and the excess over its calibration, with ripple and noise."""
    rng = np.random.default_rng(seed)
    t = T * np.arange(round(seconds / T))
    v = 0.8 * np.sin(0.9 * t) + 0.3 * np.sin(2.3 * t)
    friction = law().torque(v)
    excess = (np.asarray(level) - 1.0) * friction + rng.normal(0, 0.5, t.size) + 0.8 * np.sin(40 * np.cumsum(v) * T)
    return friction, excess


@pytest.mark.parametrize("level", [0.85, 1.0, 1.1])
@pytest.mark.parametrize("causal", [False, True])
def test_the_level_is_found_within_its_error(level: float, causal: bool) -> None:
    friction, excess = noisy(60.0, level)
    found = follow_level(excess, friction, np.abs(friction) > 0, T, 0.1, causal)
    late = slice(round(20 / T), None)
    assert np.max(np.abs(1 + found.deviation[late] - level)) < 0.02
    assert found.sd[late].max() < 0.03
    if causal:
        assert found.deviation[0] == 0.0
        assert found.sd[0] == pytest.approx(0.1)


def test_pushes_do_not_move_the_level() -> None:
    friction, excess = noisy(60.0, 1.0)
    t = T * np.arange(excess.size)
    pushed = excess + 15.0 * (np.mod(t, 5.0) < 0.5)
    calm = follow_level(excess, friction, np.abs(friction) > 0, T, 0.1, False)
    found = follow_level(pushed, friction, np.abs(friction) > 0, T, 0.1, False)
    assert np.max(np.abs(found.deviation - calm.deviation)) < 0.02


def test_warming_up_is_followed() -> None:
    t = T * np.arange(round(600 / T))
    true = 1.0 - 0.15 * (1 - np.exp(-t / 200.0))
    friction, excess = noisy(600.0, true)
    found = follow_level(excess, friction, np.abs(friction) > 0, T, 0.1, False)
    assert np.max(np.abs(1 + found.deviation - true)) < 0.02
    weight = np.where(np.isfinite(friction), friction, 0.0) ** 2
    assert 1 + found.mean == pytest.approx(float(true @ weight / weight.sum()), abs=0.002)


def test_without_data_the_calibration_and_its_stated_uncertainty_stand() -> None:
    friction, excess = noisy(10.0, 0.85)
    found = follow_level(excess, friction, np.zeros(excess.size, bool), T, 0.1, False)
    assert np.allclose(found.deviation, 0.0)
    assert np.allclose(found.sd, 0.1)


def test_a_level_beyond_belief_is_held_at_the_limit() -> None:
    friction, excess = noisy(60.0, 1.8)
    found = follow_level(excess, friction, np.abs(friction) > 0, T, 0.1, False)
    assert found.deviation.max() == pytest.approx(LARGEST)


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_an_unknown_velocity_is_no_reversal_in_either_direction(direction: float) -> None:
    v = np.full(500, 0.2 * direction)
    series = motion(v)
    v[300] = np.nan
    band = friction_bounds(series, 0, v, law())
    known = np.arange(500) != 300
    assert np.array_equal(band.steady[known], friction_bounds(series, 0, np.where(known, v, v[0]), law()).steady[known])
    turned = np.where(np.arange(500) < 300, v, -v)
    after = friction_bounds(motion(turned), 0, turned, law())
    assert not after.steady[301]


def test_friction_of_the_load_goes_with_the_temperature_too() -> None:
    """A law at 0.8 of its friction has 0.8 of what the load adds to it."""
    v = np.full(2000, 0.5)
    load = LoadFriction(0.1, 0.01, (0.1, 1.0), (10.0, 10.0), (5.0, 40.0))
    trend = Trend("temperature", -0.02, (-0.022, -0.018), 25.0, "log", TrendFit(20.0, 45.0, mean=30.0, level=0.0))
    warm = replace(law(), load=load, temperature_trend=trend)
    series = replace(motion(v), temperature_c=np.full((v.size, 1), 40.0))
    carried = np.full(v.size, 25.0)
    bounds = friction_bounds(series, 0, v, warm, carried)
    assert bounds.sliding_nm[-1] == pytest.approx(0.8 * (law().torque(v)[-1] + 0.1 * 15.0))
    np.testing.assert_allclose(warm.sliding(v, carried, series.temperature_c[:, 0]), bounds.sliding_nm)


def test_the_way_since_the_last_rest_is_that_of_each_stretch() -> None:
    rng = np.random.default_rng(4)
    v = np.repeat(rng.choice([-0.3, 0.0, 0.2], 700), rng.integers(1, 120, 700))
    v[rng.integers(0, v.size, 5)] = np.nan
    series = replace(motion(np.nan_to_num(v)), segments=(Span(0, 300), Span(300, 300), Span(340, v.size - 7)))
    steady, travel = settled(series.segments, series.position_rad[:, 0], v, 0.1)
    known = v[0]
    for k in range(v.size):
        inside = any(k in range(s.start, s.stop) for s in series.segments)
        first = any(k == s.start for s in series.segments)
        turned = known * v[k] < 0
        known = known if np.isnan(v[k]) else v[k]
        if not inside or first or turned or abs(v[k]) < 0.1:
            way = 0.0
        else:
            way += abs(series.position_rad[k, 0] - series.position_rad[k - 1, 0])
        assert travel[k] == pytest.approx(way, abs=1e-9)
        if inside and not abs(way - 0.01) < 1e-9:
            assert steady[k] == (way > 0.01)
