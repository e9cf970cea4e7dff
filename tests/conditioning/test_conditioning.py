"""Conditioning against closed forms: filters, derivatives, gaps, missing values, saturation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic import PERIOD, make_log

from collaudit.core.conditioning import timebase
from collaudit.core.conditioning.conditioning import condition
from collaudit.core.config.schema import ConditioningConfig
from collaudit.core.data.joint_log import JointLog, WrenchSeries
from collaudit.core.errors import NotJudgedError
from collaudit.core.numeric.arrays import Span
from collaudit.core.numeric.filters import low_pass

CONFIG = ConditioningConfig()


def sine_log(n: int = 5000, hz: float = 1.0):  # type: ignore[no-untyped-def]
    t = PERIOD * np.arange(n)
    w = 2 * np.pi * hz
    q = 0.5 * np.sin(w * t)[:, None]
    v = 0.5 * w * np.cos(w * t)[:, None]
    a = -0.5 * w**2 * np.sin(w * t)[:, None]
    return t, q, v, a


def test_acceleration_of_a_sine_has_no_delay_and_the_filters_gain() -> None:
    t, q, v, a = sine_log(hz=2.0)
    series = condition(make_log(t, q, v, np.zeros_like(q) + t[:, None]), CONFIG)
    inner = slice(500, -500)
    got = series.acceleration_rad_s2[inner, 0]
    gain = got @ a[inner, 0] / (a[inner, 0] @ a[inner, 0])
    assert gain == pytest.approx(1.0, abs=2e-3)
    assert np.max(np.abs(got - gain * a[inner, 0])) < 2e-3 * np.max(np.abs(a))


@pytest.mark.parametrize("bandwidth", [5.0, 20.0, 60.0])
def test_the_stated_bandwidth_is_the_minus_3_db_point(bandwidth: float) -> None:
    t = PERIOD * np.arange(20000)
    x = np.sin(2 * np.pi * bandwidth * t)
    y = low_pass(x, [Span(0, x.size)], PERIOD, bandwidth)
    inner = slice(2000, -2000)
    assert np.std(y[inner]) / np.std(x[inner]) == pytest.approx(2**-0.5, rel=0.01)


def test_no_filter_reaches_across_a_gap() -> None:
    t, q, v, _ = sine_log(2000)
    keep = np.r_[0:1000, 1100:2000]
    whole = condition(make_log(t[keep], q[keep], v[keep], q[keep]), CONFIG)
    left = condition(make_log(t[:1000], q[:1000], v[:1000], q[:1000]), CONFIG)
    assert np.allclose(whole.acceleration_rad_s2[:1000], left.acceleration_rad_s2, rtol=1e-9, atol=1e-9)
    assert np.isnan(whole.acceleration_rad_s2[1000:1100]).all()
    assert whole.edge[999]
    assert whole.edge[1100]


def test_missing_velocity_is_derived_and_said() -> None:
    t, q, v, _ = sine_log()
    for logged in (None, np.full_like(v, np.nan), np.zeros_like(v)):
        series = condition(make_log(t, q, logged, q), CONFIG)
        assert "log-velocity" in {f.code for f in series.findings}
        assert np.max(np.abs(series.velocity_rad_s - v)[100:-100]) < 2e-3 * np.max(np.abs(v))


def test_velocity_in_degrees_is_noticed() -> None:
    t, q, v, _ = sine_log()
    series = condition(make_log(t, q, np.rad2deg(v), q), CONFIG)
    finding = next(f for f in series.findings if f.code == "log-velocity")
    assert "degrees" in finding.text
    assert np.max(np.abs(series.velocity_rad_s - v)[100:-100]) < 2e-3 * np.max(np.abs(v))


def late_log(late_s: float):  # type: ignore[no-untyped-def]
    """Two joints, the velocity of the second logged late; with noise."""
    t = PERIOD * np.arange(20000)
    rng = np.random.default_rng(4)
    w = 2 * np.pi * np.array([[0.5, 0.7]])

    def motion(at: np.ndarray) -> tuple[np.ndarray, ...]:
        angle = w * at
        return (
            np.sin(angle) + 0.2 * np.sin(3 * angle),
            w * (np.cos(angle) + 0.6 * np.cos(3 * angle)),
            -(w**2) * (np.sin(angle) + 1.8 * np.sin(3 * angle)),
        )

    q, _, a = motion(t[:, None])
    _, v, _ = motion(t[:, None] - [[0.0, late_s]])
    return t, q + 1e-5 * rng.standard_normal(q.shape), v + 2e-3 * rng.standard_normal(q.shape), a


def test_a_late_velocity_is_measured_and_derived_instead() -> None:
    t, q, v, a = late_log(0.008)
    errors = {}
    for source in ("auto", "logged", "position"):
        series = condition(make_log(t, q, v, q, ("joint1", "joint2")), ConditioningConfig(velocity=source))  # type: ignore[arg-type]
        errors[source] = np.std((series.acceleration_rad_s2 - a)[200:-200], axis=0)
        said = next(f for f in series.findings if "lags behind" in f.text)
        assert "'joint2' 8.0 ms (95 %: " in said.text
        assert "joint1" not in said.text
        assert ("derived from position" in said.text) == (source != "logged")
        assert said.code == "log-velocity"
    assert errors["auto"][1] < 0.2 * errors["logged"][1]
    assert errors["auto"][0] == errors["logged"][0], "the prompt velocity is kept"


def test_a_small_lag_is_undone_and_the_raw_velocity_is_kept() -> None:
    """A quarter of a sample and more; what a controller has stays as logged."""
    t, q, v, a = late_log(0.003)
    errors = {}
    for source in ("auto", "logged", "position"):
        series = condition(make_log(t, q, v, q, ("joint1", "joint2")), ConditioningConfig(velocity=source))  # type: ignore[arg-type]
        errors[source] = np.std((series.acceleration_rad_s2 - a)[200:-200], axis=0)
        if source == "auto":
            assert np.array_equal(series.raw_velocity_rad_s, v)
            said = next(f for f in series.findings if "lags behind" in f.text)
            assert "'joint2' 3.0 ms" in said.text
            assert "shifted by this lag" in said.text
            assert said.is_fact
    assert errors["auto"][1] < 0.4 * errors["logged"][1]
    assert errors["auto"][0] == errors["logged"][0]


def test_a_lag_below_a_quarter_sample_is_left_alone() -> None:
    for late_s in (0.0, 0.0003, -0.01):
        t, q, v, _ = late_log(late_s)
        series = condition(make_log(t, q, v, q, ("joint1", "joint2")), CONFIG)
        assert not any(f.code.startswith("log-velocity") for f in series.findings)
        assert np.array_equal(series.raw_velocity_rad_s, v)
        assert series.velocity_lag_s is not None


@pytest.mark.parametrize("fault", ["flipped", "degrees", "spikes"])
def test_a_velocity_wrong_in_a_small_part_of_a_long_log_is_noticed(fault: str) -> None:
    count = 350_000  # 700 s
    t = PERIOD * np.arange(count)
    angle = 2 * np.pi * 0.5 * t
    q, v = np.sin(angle)[:, None], 2 * np.pi * 0.5 * np.cos(angle)[:, None]
    logged = v + 1e-9
    part = slice(100_000, 103_500)
    if fault == "flipped":
        logged[100_000:110_000] *= -1.0
    elif fault == "degrees":
        logged[part] = np.rad2deg(logged[part])
    else:
        logged[part][::200] = 1e4
    series = condition(make_log(t, q, logged, q), CONFIG)
    assert any(f.code == "log-velocity" for f in series.findings)
    assert np.max(np.abs(series.velocity_rad_s - v)[100:-100]) < 2e-3 * np.max(np.abs(v))


def wrench_log(stamps: np.ndarray) -> JointLog:
    t, q, v, _ = sine_log(2000)
    forces = np.stack([np.sin(stamps + k) for k in range(6)], axis=1)
    return replace(make_log(t, q, v, q), wrench=WrenchSeries(stamps, forces, "/ft"))


def test_a_wrench_is_interpolated_and_not_across_a_gap() -> None:
    every = PERIOD * np.arange(2000) + 0.0007
    whole = condition(wrench_log(every), CONFIG)
    assert whole.wrench is not None
    expected = np.stack([np.sin(whole.time_s + k) for k in range(6)], axis=1)
    np.testing.assert_allclose(whole.wrench[1:], expected[1:], atol=2e-6)
    keep = np.r_[0:500, 600:2000]
    cut = condition(wrench_log(every[keep]), CONFIG)
    assert cut.wrench is not None
    lost = np.isnan(cut.wrench).all(axis=1)
    assert np.flatnonzero(lost).tolist() == list(range(500, 601)), "also the sample just before the stamps go on"
    np.testing.assert_array_equal(cut.wrench[~lost], whole.wrench[~lost])
    assert any(f.code == "log-wrench" and "101 of 2000" in f.text for f in cut.findings)
    assert not any(f.code == "log-wrench" for f in whole.findings)
    late = condition(wrench_log(every[300:]), CONFIG)
    assert late.wrench is not None
    assert np.flatnonzero(np.isnan(late.wrench).any(axis=1)).tolist() == list(range(300))


def test_velocity_zero_in_the_first_rows_is_mended_there_only() -> None:
    t, q, v, _ = sine_log()
    logged = v.copy()
    logged[:20] = 0.0
    series = condition(make_log(t, q, logged, q), CONFIG)
    finding = next(f for f in series.findings if f.code == "log-velocity")
    assert "20 samples" in finding.text
    assert np.max(np.abs(series.velocity_rad_s - v)[10:]) < 5e-3 * np.max(np.abs(v))


def test_missing_efforts_stay_missing_and_do_not_spread() -> None:
    t, q, v, _ = sine_log()
    effort = q.copy()
    effort[1000:1010] = np.nan
    series = condition(make_log(t, q, v, effort), CONFIG)
    assert series.effort is not None
    assert np.flatnonzero(np.isnan(series.effort[:, 0])).tolist() == list(range(1000, 1010))
    assert "log-nan" in {f.code for f in series.findings}


def test_rows_without_a_position_are_lost_and_missing_velocities_derived() -> None:
    t, q, v, _ = sine_log()
    position, velocity = q.copy(), v.copy()
    velocity[2000:2005] = np.nan
    position[1000:1100] = position[-300:] = np.nan
    series = condition(make_log(t, position, velocity, q), CONFIG)
    rows = np.isfinite(position[:, 0])
    gone = condition(make_log(t[rows], q[rows], velocity[rows], q[rows]), CONFIG)
    assert [(s.start, s.stop) for s in series.segments] == [(0, 1000), (1100, q.shape[0] - 300)]
    np.testing.assert_array_equal(series.velocity_rad_s, gone.velocity_rad_s)
    assert np.abs(series.velocity_rad_s - v[: series.time_s.size])[2000:2005].max() < 5e-3 * np.abs(v).max()
    assert series.off_grid_s == pytest.approx(300 * series.period_s) and gone.off_grid_s == 0.0
    assert {"log-nan", "log-velocity"} <= {f.code for f in series.findings}


def test_a_joint_without_any_position_is_refused_by_name() -> None:
    t, q, v, _ = sine_log()
    with pytest.raises(NotJudgedError) as refused:
        condition(make_log(t, np.full_like(q, np.nan), v, q), CONFIG)
    assert "'joint1'" in str(refused.value)


def test_saturated_effort_is_marked_and_noise_is_not() -> None:
    rng = np.random.default_rng(0)
    t, q, v, _ = sine_log()
    effort = 30 * q + rng.normal(0, 0.1, q.shape)
    clipped = np.clip(effort, -10.0, 10.0)
    assert condition(make_log(t, q, v, effort), CONFIG).saturated.sum() == 0
    marked = condition(make_log(t, q, v, clipped), CONFIG)
    assert "not-measured" in {f.code for f in marked.findings}
    assert np.abs(clipped[marked.saturated]).min() == 10.0


def test_a_dead_effort_channel_is_an_error() -> None:
    t, q, v, _ = sine_log()
    series = condition(make_log(t, q, v, np.zeros_like(q)), CONFIG)
    assert ("log-effort-missing", "error") in {(f.code, f.severity) for f in series.findings}


@settings(max_examples=30, deadline=None)
@given(st.lists(st.integers(20, 300), min_size=1, max_size=6), st.lists(st.integers(2, 500), min_size=6, max_size=6))
def test_every_recorded_sample_is_on_the_grid_once(lengths: list[int], gaps: list[int]) -> None:
    start, pieces = 0, []
    for length, gap in zip(lengths, gaps, strict=False):
        pieces.append(np.arange(start, start + length))
        start += length + gap
    k = np.concatenate(pieces)
    t = PERIOD * k
    q = np.sin(t)[:, None]
    series = condition(make_log(t, q, np.cos(t)[:, None], q), CONFIG)
    assert series.bridged is not None
    recorded = np.flatnonzero(np.isfinite(series.position_rad[:, 0]) & ~series.bridged)
    assert recorded.size + series.bridged.sum() == sum(len(s) for s in series.segments)
    assert recorded.size == k.size
    assert np.allclose(series.position_rad[recorded, 0], np.sin(PERIOD * k), atol=1e-12)
    assert np.array_equal(recorded, k)


def swing(k: np.ndarray) -> JointLog:
    """Samples number ``k`` of a swing, in the order given."""
    t = PERIOD * k
    q, v = 0.5 * np.sin(2.0 * t)[:, None], np.cos(2.0 * t)[:, None]
    return make_log(t, q, v, np.cos(3.0 * t)[:, None])


def test_the_order_of_recording_does_not_matter() -> None:
    k = np.arange(400)
    plain, mixed = (condition(swing(order), ConditioningConfig()) for order in (k, k.reshape(-1, 4)[:, ::-1].ravel()))
    np.testing.assert_array_equal(plain.position_rad, mixed.position_rad)
    np.testing.assert_array_equal(plain.acceleration_rad_s2, mixed.acceleration_rad_s2)


def test_a_gap_as_long_as_a_fragment_left_out_stays_a_gap(monkeypatch: pytest.MonkeyPatch) -> None:
    """The grid then has as many samples as were recorded, and yet they do not lie on it one by one."""
    k = np.concatenate([np.arange(5), np.arange(20, 220), np.arange(225, 425)])
    monkeypatch.setattr(timebase, "bridged_steps", lambda steps, *_: np.zeros(steps.size, dtype=bool))
    series = condition(swing(k), ConditioningConfig())
    assert series.position_rad.shape[0] == k.size
    assert np.isnan(series.position_rad[200:205]).all()
    np.testing.assert_allclose(
        series.position_rad[:, 0],
        np.where(np.isnan(series.position_rad[:, 0]), np.nan, 0.5 * np.sin(2.0 * series.time_s)),
        atol=1e-9,
    )
