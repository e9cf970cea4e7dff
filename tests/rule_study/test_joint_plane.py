"""Planes of a joint whose residual is known in closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from collaudit.core.data.rule_study_result import JointPlane
from collaudit.core.rule_study.joint_plane import (
    AddedTorque,
    JointSeries,
    alarm_rate,
    frontier,
    joint_plane,
    plane_point,
    point_of,
)
from collaudit.core.rule_study.shown_torque import Windows

PERIOD, ONSET = 0.002, 100


def quiet(level: float = 0.0, moments: int = 40, length: int = 600, width: float = 0.0) -> Windows:
    shape = (1, moments, length)
    flat = [np.full(shape, value) for value in (level, width, width, 0.0)]
    return Windows(*flat, np.ones(shape, dtype=bool), np.full(shape, width > 0))


def step(samples: int, length: int = 600) -> np.ndarray:
    out = np.zeros((1, 1, length))
    out[..., ONSET : ONSET + samples] = 1.0
    return out


def series(residual: np.ndarray) -> JointSeries:
    return JointSeries(residual, np.zeros_like(residual), np.ones(residual.size, dtype=bool), PERIOD, 0)


def plane_of(around: Windows, samples: int = 50) -> tuple[JointPlane, JointSeries]:
    noise = np.random.default_rng(2).normal(size=60_000)
    residual = np.convolve(noise, np.hanning(41) / 20.0, "same")
    joint = series(residual)
    return joint_plane(joint, 2.0, 13, AddedTorque(around, step(samples))), joint


def test_the_smallest_torque_is_the_threshold_while_the_push_lasts() -> None:
    plane, _ = plane_of(quiet())
    for c, n in enumerate(plane.n):
        for g, gamma in enumerate(plane.gamma_nm):
            torque = plane.torque_nm[g][c]
            assert torque == (pytest.approx(gamma, rel=0.01) if n <= 50 else None)


@pytest.mark.parametrize(("level", "expected"), [(0.5, 1.5), (-0.5, 2.5)])
def test_a_residual_of_its_own_helps_or_hinders(level: float, expected: float) -> None:
    plane, _ = plane_of(quiet(level))
    assert plane.configured is not None
    assert plane.configured.torque_nm == pytest.approx(expected, rel=0.01)


def test_friction_of_a_standing_joint_is_overcome_first() -> None:
    plane, _ = plane_of(quiet(level=-3.0, width=6.0))
    assert plane.configured is not None
    assert plane.configured.torque_nm == pytest.approx(2.0 + 6.0, rel=0.01)


def test_moments_that_notice_nothing_make_the_torque_unknown() -> None:
    around = quiet()
    around.evidence[0, :3] = False
    plane, _ = plane_of(around)
    assert plane.configured is not None
    assert plane.configured.torque_nm is None  # of 40 moments three are more than 5 %
    around.evidence[0, 1:3] = True
    again, _ = plane_of(around)
    assert again.configured is not None
    assert again.configured.torque_nm == pytest.approx(2.0, rel=0.01)


def test_points_and_cells_agree() -> None:
    plane, joint = plane_of(quiet())
    push = AddedTorque(quiet(), step(50))
    for g, c in ((0, 0), (20, 3), (60, 12)):
        cell = point_of(plane, g, c)
        own = plane_point(joint, plane.gamma_nm[g], plane.n[c], push)
        assert cell.alarms == own.alarms
        assert own.torque_nm == pytest.approx(cell.torque_nm, rel=0.02)
    assert plane.clean_hours == pytest.approx(120.0 / 3600.0)
    assert plane.alarms[0][0] > 1000 and plane.alarms[-1][0] == 0


def test_the_frontier_trades_alarms_for_torque() -> None:
    plane, _ = plane_of(quiet())
    points = frontier(plane)
    assert len(points) >= 2
    alarms, torques = [p.alarms for p in points], [p.torque_nm for p in points]
    assert alarms == sorted(set(alarms)) and torques == sorted(torques, reverse=True)
    every = [point_of(plane, g, c) for g in range(0, 100, 3) for c in range(0, len(plane.n), 3)]
    for cell in every:
        if cell.torque_nm is not None:
            assert any(p.alarms <= cell.alarms and (p.torque_nm or 0.0) <= cell.torque_nm for p in points)


def test_rates_have_their_poisson_bound() -> None:
    assert alarm_rate(0, 2.0) == (0.0, pytest.approx(2.9957 / 2.0, rel=1e-4))
    assert alarm_rate(3, 2.0) == (1.5, pytest.approx(7.7537 / 2.0, rel=1e-4))
    assert alarm_rate(0, 0.0) == (None, None)


def test_without_clean_time_there_is_no_rate() -> None:
    joint = series(np.zeros(500))
    joint = replace(joint, clean=np.zeros(500, dtype=bool))
    plane = joint_plane(joint, 2.0, 13, None)
    assert plane.configured is not None
    assert plane.configured.alarms_per_hour is None and plane.configured.torque_nm is None
