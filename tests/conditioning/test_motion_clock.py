"""The sample clock from the motion: found where it is shown, not claimed where it is not; lost samples bridged."""

from __future__ import annotations

import numpy as np
import pytest

from collaudit.core.conditioning.conditioning import condition
from collaudit.core.conditioning.motion_clock import MotionClock, motion_clock
from collaudit.core.config.schema import ConditioningConfig
from collaudit.core.data.joint_log import JointLog, LogSource, UniformSeries
from collaudit.core.numeric.arrays import frozen

T = 0.001


def arm(t: np.ndarray, seed: int, rests: bool = False) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Position, velocity and acceleration of seven joints; with rests every few seconds."""
    rng = np.random.default_rng(seed)
    w, phase, size = 2 * np.pi * rng.uniform(0.1, 0.6, 7), rng.uniform(0, 6, 7), rng.uniform(0.3, 0.8, 7)
    pace = np.clip(3.0 * np.sin(2 * np.pi * t / 7), 0.0, 1.0) if rests else np.ones_like(t)
    way = np.concatenate([[0.0], np.cumsum(0.5 * (pace[1:] + pace[:-1]) * np.diff(t))])[:, None]
    q, dq = size * np.sin(w * way + phase), size * w * np.cos(w * way + phase)
    return q, dq * pace[:, None], -(w**2) * q


def pc_log(seed: int, *, rests: bool = False, speed_noise: float = 1e-3, lost: float = 0.01, n: int = 20_000):  # type: ignore[no-untyped-def]
    """True times, and stamps, positions and velocities as a PC wrote them."""
    rng = np.random.default_rng(100 + seed)
    t = T * np.arange(n)
    q, v, _ = arm(t, seed, rests)
    late = rng.exponential(0.6 * T, n)
    for start in rng.integers(0, n - 20, 20):
        late[start : start + 15] = np.maximum(late[start : start + 15], T * (14 - np.arange(15)))
    stamps = np.maximum.accumulate(t + late)
    keep = rng.random(n) >= lost
    keep[0] = True
    v = v + rng.normal(0, speed_noise, v.shape)
    return t[keep], stamps[keep], np.round(q[keep], 6), v[keep]


def log_of(stamps: np.ndarray, q: np.ndarray, v: np.ndarray | None, effort: np.ndarray) -> JointLog:
    names = tuple(f"j{k}" for k in range(q.shape[1]))
    source = LogSource("x", "0" * 64, "csv", None, "t", "x")
    frozen_v = None if v is None else frozen(v)
    return JointLog(frozen(stamps - stamps[0]), names, frozen(q), frozen_v, frozen(effort), "Nm", None, source)


def codes(series: UniformSeries) -> set[str]:
    return {f.code for f in series.findings}


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("speed_noise", [1e-3, 3e-2])
def test_every_lost_sample_is_counted(seed: int, speed_noise: float) -> None:
    true, stamps, q, v = pc_log(seed, speed_noise=speed_noise)
    clock = motion_clock(stamps, q, v)
    assert isinstance(clock, MotionClock)
    assert clock.period_s == pytest.approx(T, rel=1e-5)
    np.testing.assert_allclose(np.diff(clock.stamps_s), np.diff(true), rtol=1e-4)
    assert clock.jitter_s > 0.3 * T


@pytest.mark.parametrize("seed", range(5))
def test_rests_are_placed_by_the_stamps(seed: int) -> None:
    true, stamps, q, v = pc_log(seed, rests=True)
    clock = motion_clock(stamps, q, v)
    assert isinstance(clock, MotionClock)
    moving = (np.abs(v) > 0.02).any(axis=1)
    off = clock.stamps_s - true
    assert np.abs(off - np.median(off))[moving].max() < 2.5 * T


@pytest.mark.parametrize("share", [0.1, 0.2, 0.4])
def test_uneven_sampling_with_true_stamps_is_left_alone(share: float) -> None:
    """The motion then follows the stamps."""
    rng = np.random.default_rng(3)
    t = np.sort(T * np.arange(8000) + rng.normal(0, share * T, 8000))
    q, v, _ = arm(t, 1)
    assert not isinstance(motion_clock(t, q, v), MotionClock)


def test_no_clock_is_made_of_weak_evidence() -> None:
    true, stamps, q, v = pc_log(2)
    noise = np.random.default_rng(0).normal(0, 1.0, v.shape)
    assert motion_clock(stamps, q, None) is None
    assert motion_clock(stamps, q, v + noise) is None
    assert motion_clock(stamps, 0 * q, 0 * v) is None
    assert motion_clock(stamps, q, 2.0 * v) is None
    assert motion_clock(true, q, v) is None
    drift = np.cumsum(np.where(np.arange(true.size) % 4000 < 2000, 0.2 * T, -0.2 * T))
    assert motion_clock(stamps + drift, q, v) is None  # a clock that goes faster and slower for seconds


def rebuilt(series: UniformSeries) -> list[str]:
    """What is said of times that were rebuilt from the controller's clock."""
    return [f.text for f in series.findings if "rebuilt from that clock" in f.text]


def test_stamps_in_whole_milliseconds_are_rebuilt_and_no_sample_taken_for_a_copy() -> None:
    true, stamps, q, v = pc_log(4)
    coarse = np.round(stamps, 3)
    series = condition(log_of(coarse, q, v, q), ConditioningConfig())
    assert rebuilt(series)
    assert "time-duplicate" not in codes(series)
    assert series.bridged is not None
    assert np.count_nonzero(~series.bridged) == true.size


def test_the_acceleration_behind_a_pc_clock_is_that_of_the_arm() -> None:
    true, stamps, q, v = pc_log(1)
    series = condition(log_of(stamps, q, v, q), ConditioningConfig())
    assert any("bridged by interpolation" in finding.text for finding in series.findings)
    assert len(series.segments) == 1
    _, _, a = arm(true[0] + series.period_s * np.arange(series.time_s.size), 1)
    inner = slice(200, -200)
    assert np.sqrt(np.mean((series.acceleration_rad_s2 - a)[inner] ** 2)) < 0.03
    (text,) = rebuilt(series)
    assert f"{series.bridged.sum()} samples lost" in text  # type: ignore[union-attr]


def test_a_hole_is_bridged_only_while_it_is_short_against_the_filter() -> None:
    k = np.delete(np.arange(4000), np.r_[500, 1000:1005, 2000:2020])
    t = 0.002 * k
    q, v, _ = arm(t, 0)
    series = condition(log_of(t, q, v, q), ConditioningConfig())
    assert [(s.start, s.stop) for s in series.segments] == [(0, 2000), (2020, 4000)]
    assert series.bridged is not None
    assert np.flatnonzero(series.bridged).tolist() == [500, 1000, 1001, 1002, 1003, 1004]
    whole, _, _ = arm(0.002 * np.arange(4000), 0)
    recorded = np.isfinite(series.position_rad[:, 0])
    np.testing.assert_allclose(series.position_rad[recorded], whole[recorded], atol=1e-6)
    slow = condition(log_of(10 * t, q, v, q), ConditioningConfig())  # 50 Hz: single samples only
    assert np.flatnonzero(slow.bridged).tolist() == [500]  # type: ignore[arg-type]


def test_jitter_is_stated_by_a_spread_and_not_by_its_worst() -> None:
    rng = np.random.default_rng(5)
    t = T * np.arange(5000) + rng.normal(0, 0.03 * T, 5000)
    t[2500:] += 0.3 * T
    q, v, _ = arm(t, 0)
    series = condition(log_of(np.sort(t), q, v, q), ConditioningConfig())
    assert any("scatter by 0.03" in f.text for f in series.findings)
