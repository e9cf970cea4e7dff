"""Wrapped angles are continued, jumps are breaks, and fast motion is neither."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic import make_log

from collaudit.core.conditioning.conditioning import condition
from collaudit.core.conditioning.position_jumps import continued_angles
from collaudit.core.config.schema import ConditioningConfig
from collaudit.core.data.joint_log import JointLog
from collaudit.core.findings import joints_not_judged

CONFIG = ConditioningConfig()
TURN = 2 * np.pi


def turning(rate_hz: float = 500.0, speed: float = 2.0, noise: float = 1e-5, seconds: float = 8.0) -> JointLog:
    """Two joints; the first turns to and fro by several radians at up to ``speed``."""
    t = np.arange(round(seconds * rate_hz)) / rate_hz
    rng = np.random.default_rng(3)
    w = np.array([[0.6, 0.9]])
    top = np.array([[speed, 0.4]])
    q = np.pi + top / w * np.sin(w * t[:, None]) + noise * rng.standard_normal((t.size, 2))
    return make_log(t, q, top * np.cos(w * t[:, None]), np.sin(3 * t)[:, None] * [1.0, 2.0], ("a", "b"))


def wrapped(log: JointLog, low: float, period: float = TURN) -> JointLog:
    q = log.position_rad.copy()
    q[:, 0] = low + np.mod(q[:, 0] - low, period)
    return replace(log, position_rad=q)


def said(log: JointLog, *prismatic: str) -> list[tuple[str, str | None]]:
    return [(f.code, f.joint) for f in continued_angles(log, prismatic).findings]


@settings(max_examples=60, deadline=None)
@given(
    low=st.floats(-7.0, 1.0),
    rate_hz=st.sampled_from([20.0, 30.0, 100.0, 125.0, 1000.0]),
    speed=st.floats(0.2, 6.0),
    velocity=st.sampled_from(["logged", "none", "degrees"]),
    periods=st.integers(1, 2),
)
def test_a_wrapped_angle_is_continued_by_whole_turns(
    low: float, rate_hz: float, speed: float, velocity: str, periods: int
) -> None:
    log = turning(rate_hz, speed)
    if velocity != "logged":
        log = replace(log, velocity_rad_s=None if velocity == "none" else np.rad2deg(log.velocity_rad_s))
    spoilt = wrapped(log, low, periods * TURN)
    found = continued_angles(spoilt)
    away = (found.position_rad - log.position_rad) / TURN
    np.testing.assert_allclose(away, np.round(away[0]) + np.zeros_like(away), atol=1e-9)
    assert not found.breaks
    stepped = bool((np.abs(np.diff(spoilt.position_rad[:, 0])) > 5.0).any())
    assert [f.code for f in found.findings] == ["fact"] * stepped


@settings(max_examples=60, deadline=None)
@given(
    rate_hz=st.sampled_from([20.0, 30.0, 125.0, 500.0]),
    speed=st.floats(0.01, 12.0),
    velocity=st.booleans(),
    gap=st.booleans(),
)
def test_fast_motion_is_no_wrap_and_no_break(rate_hz: float, speed: float, velocity: bool, gap: bool) -> None:
    log = turning(rate_hz, speed)
    if gap:
        keep = np.r_[0:60, 75:160]
        log = make_log(log.time_s[keep], log.position_rad[keep], log.velocity_rad_s[keep], None, ("a", "b"))
    if not velocity:
        log = replace(log, velocity_rad_s=None)
    found = continued_angles(log)
    assert found.position_rad is log.position_rad
    assert not found.findings


def test_wrapped_angles_give_the_same_series() -> None:
    log = turning()
    plain, other = condition(log, CONFIG), condition(wrapped(log, -np.pi), CONFIG)
    np.testing.assert_allclose(other.velocity_rad_s, plain.velocity_rad_s, atol=1e-12)
    np.testing.assert_allclose(other.acceleration_rad_s2, plain.acceleration_rad_s2, atol=1e-9)
    assert {f.code for f in other.findings} == {"fact"}
    assert not plain.findings


def test_noise_at_the_seam_and_missing_samples_do_not_matter() -> None:
    t = np.arange(3000) / 500.0
    rng = np.random.default_rng(1)
    q = np.pi + 1e-4 * rng.standard_normal((3000, 1))
    at_rest = make_log(t, q, np.zeros_like(q), q)
    found = continued_angles(replace(at_rest, position_rad=np.mod(q, TURN) - TURN * (np.mod(q, TURN) > np.pi)))
    assert np.ptp(found.position_rad) < 0.01
    log = wrapped(turning(), -np.pi)
    row = int(np.flatnonzero(np.abs(np.diff(log.position_rad[:, 0])) > 5)[0])
    holes = log.position_rad.copy()
    holes[row - 1 : row + 2, 0] = np.nan
    again = continued_angles(replace(log, position_rad=holes)).position_rad
    steps = np.diff(again[np.isfinite(again[:, 0]), 0])
    assert np.abs(steps).max() < 0.1


def test_the_order_of_recording_does_not_matter() -> None:
    log = wrapped(turning(), -np.pi)
    mixed = np.arange(log.time_s.size).reshape(-1, 4)[:, ::-1].ravel()
    other = make_log(log.time_s[mixed], log.position_rad[mixed], log.velocity_rad_s[mixed], None, ("a", "b"))
    found, plain = continued_angles(other), continued_angles(log)
    np.testing.assert_allclose(found.position_rad, plain.position_rad[mixed], atol=1e-12)


@pytest.mark.parametrize("jump", [4.45, -4.45, 0.6, 1.7])
def test_a_jump_that_is_no_wrap_is_a_break_and_keeps_the_logged_velocity(jump: float) -> None:
    log = turning()
    q = log.position_rad.copy()
    q[2000:, 0] += jump
    series = condition(replace(log, position_rad=q), CONFIG)
    assert [(f.code, f.joint) for f in series.findings] == [("not-measured", "a")]
    assert [(s.start, s.stop) for s in series.segments] == [(0, 2000), (2001, 4000)]
    assert series.raw_velocity_rad_s is not None
    kept = np.isfinite(series.raw_velocity_rad_s[:, 0])
    np.testing.assert_array_equal(series.raw_velocity_rad_s[kept], log.velocity_rad_s[kept])
    assert np.nanmax(np.abs(series.velocity_rad_s)) < 2.1
    assert np.nanmax(np.abs(series.acceleration_rad_s2)) < 3.0
    assert series.edge[1990:2010].all()


def test_a_sample_astray_is_cut_out() -> None:
    log = turning()
    q = log.position_rad.copy()
    q[1500, 1] = 700.0
    series = condition(replace(log, position_rad=q), CONFIG)
    assert np.nanmax(np.abs(series.position_rad)) < 10
    assert ("not-measured", "b") in {(f.code, f.joint) for f in series.findings}


def test_prismatic_joints_are_never_continued() -> None:
    log = wrapped(turning(), -np.pi)
    assert said(log) == [("fact", "a")]
    assert said(log, "a") == [] and list(continued_angles(log, ["a"]).breaks) == [0]


def test_positions_that_are_held_are_not_cut_to_pieces() -> None:
    log = turning(100.0, 5.0)
    held = np.repeat(log.position_rad[::10], 10, axis=0)[: log.time_s.size]
    found = continued_angles(replace(log, position_rad=held, velocity_rad_s=None))
    assert not found.breaks
    assert [f.code for f in found.findings] == ["not-measured"]


def test_a_joint_that_jumps_in_many_steps_is_not_judged() -> None:
    log = turning()
    q = log.position_rad.copy()
    astray = np.random.default_rng(3).choice(q.shape[0], q.shape[0] // 40, replace=False)
    q[astray, 0] += 3.0
    found = [f for f in continued_angles(replace(log, position_rad=q)).findings if f.joint == "a"]
    assert [(f.code, f.severity, f.forbids_pass) for f in found] == [("not-measured", "error", True)]
    assert joints_not_judged(found, ("a", "b")) == {"a"}
