"""A residual that comes again at the same positions is told from noise, friction and a single contact."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from collaudit.core.data.audit_result import FrictionFile
from collaudit.core.detection.position_pattern import position_pattern, settled_pattern_findings
from collaudit.core.friction.motion_points import Settled
from collaudit.fixtures.compare import audit_simulated
from collaudit.fixtures.simulation import SimulatedFiles


def swings(seconds: float = 60.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    t = np.arange(0, seconds, 0.004)
    q = 0.7 * np.sin(0.9 * t) + 0.4 * np.sin(2.3 * t)
    return t, q, np.sign(0.63 * np.cos(0.9 * t) + 0.92 * np.cos(2.3 * t))


def every(t: np.ndarray) -> np.ndarray:
    return np.ones(t.size, dtype=bool)


def noise(n: int, seed: int = 0) -> np.ndarray:
    """Noise that is alike over a third of a second, unit standard deviation."""
    slow = np.convolve(np.random.default_rng(seed).standard_normal(n), np.ones(80) / 80, "same")
    return slow / slow.std()


def test_a_cable_is_found_with_its_stiffness() -> None:
    t, q, way = swings()
    found = position_pattern(t, q, 3.0 * (q - 0.2) + 0.5 * noise(t.size) + 1.0 * way, way, every(t))
    assert found is not None
    assert found.stiffness_nm_per_rad == pytest.approx(3.0, rel=0.1)
    assert found.amplitude_nm == pytest.approx(3.0, rel=0.2)
    assert found.low_rad < -0.8
    assert found.high_rad > 0.8


def test_what_is_no_straight_line_has_no_stiffness() -> None:
    t, q, way = swings()
    found = position_pattern(t, q, 3.0 * np.cos(3 * q) + 0.5 * noise(t.size), way, every(t))
    assert found is not None
    assert found.stiffness_nm_per_rad is None
    assert found.share > 0.8


def test_samples_that_do_not_count_change_nothing() -> None:
    t, q, way = swings()
    rest = 3.0 * (q - 0.2) + 0.5 * noise(t.size) + 1.0 * way
    there = np.random.default_rng(5).random(t.size) < 0.7
    spoilt = [np.where(there, x, value) for x, value in ((q, 9.0), (rest, np.nan), (way, 1.0))]
    found = position_pattern(t, *spoilt, there)
    assert found is not None
    assert found == position_pattern(t[there], q[there], rest[there], way[there], every(t[there]))
    assert position_pattern(t, q, rest, way, np.zeros(t.size, dtype=bool)) is None


@pytest.mark.parametrize("seed", range(20))
def test_noise_friction_and_one_contact_are_no_pattern(seed: int) -> None:
    t, q, way = swings()
    push = np.where((t > 20.0) & (t < 21.5), 15.0, 0.0)
    assert position_pattern(t, q, noise(t.size, seed) + 2.0 * way + push, way, every(t)) is None


def test_an_arm_that_gives_under_touches_visits_no_places() -> None:
    t = np.arange(0, 60.0, 0.005)
    touch = np.where(t % 2.0 < 0.5, np.abs(np.sin(2 * np.pi * t)), 0.0)
    q, way = 0.06 + 0.003 * touch, np.sign(np.gradient(touch))
    assert position_pattern(t, q, 12.0 * touch + 0.2 * noise(t.size), way, every(t)) is None
    assert position_pattern(t, 20.0 * q, 12.0 * touch + 0.2 * noise(t.size), way, every(t)) is not None


def test_springs_that_no_model_knows_are_said_beside_their_alarms(
    made: Callable[..., SimulatedFiles], friction_of: Callable[[str], FrictionFile]
) -> None:
    files = made("free-clean", "paper6", duration_s=60.0, imperfections=("springs",))
    result = audit_simulated(files, friction_of("paper6")).result
    alarmed = {event.joint for event in result.collisions}
    assert alarmed
    said = {f.joint: f for f in result.findings if f.code == "residual-position"}
    assert alarmed <= set(said)
    assert all(said[joint].severity == "warning" for joint in alarmed)
    assert "spring of 4.9 N·m/rad" in said["joint4"].text or "spring of 5 N·m/rad" in said["joint4"].text
    plain = audit_simulated(made("free-clean", "paper6", duration_s=60.0), friction_of("paper6")).result
    assert "residual-position" not in {f.code for f in plain.findings}


@pytest.mark.parametrize("far_s", [0.0, 1e7])
def test_a_pattern_is_told_whatever_the_clock_does(far_s: float) -> None:
    t, q, way = swings()
    rest = 3.0 * (q - 0.2) + 0.5 * noise(t.size)
    found = position_pattern(np.where(t > 30.0, t + far_s, t), q, rest.copy(), way, every(t))
    assert found is not None and found.share > 0.9
    assert found.stiffness_nm_per_rad == pytest.approx(3.0, rel=0.05)


def test_what_is_settled_stays_as_it_is() -> None:
    t, q, way = swings()
    rest = 3.0 * (q - 0.2) + 0.5 * noise(t.size)
    left = Settled(t, q, rest, 2.0 * way, np.abs(way), np.zeros(t.size), np.zeros(t.size), None, np.zeros(t.size))
    before = [x.copy() for x in (t, q, rest)]
    assert settled_pattern_findings("joint1", left)
    for x, as_it_was in zip((t, q, rest), before, strict=True):
        np.testing.assert_array_equal(x, as_it_was)
