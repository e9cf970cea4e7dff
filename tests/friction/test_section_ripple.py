"""Gear ripple in constant-velocity sections: told by the strokes together, and taken off those that are too short."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from synthetic import PERIOD, lugre, make_log

from collaudit.core.conditioning.conditioning import condition
from collaudit.core.config.schema import ConditioningConfig, SectionsConfig
from collaudit.core.data.friction_result import FrictionPoint
from collaudit.core.data.joint_log import UniformSeries
from collaudit.core.friction import friction_points as module
from collaudit.core.friction.friction_points import friction_points
from collaudit.core.friction.gear_ripple import section_ripple
from collaudit.core.friction.sections import SectionSet, find_sections
from collaudit.core.numeric.arrays import Span

TRUTH = (6.0, 2.0, 20.0, 4.0)
SPEEDS = np.geomspace(0.03, 1.0, 14)
#: Cycles need not be whole; a fifth of a wave of 0.09 rad is all that the slowest stroke passes.
CYCLES = 70.3


def short_strokes() -> tuple[np.ndarray, np.ndarray]:
    """A second of each speed both ways, at places that wander: position and velocity."""
    pieces = []
    for k, v in enumerate(SPEEDS):
        ramp = np.arange(0.0, v, 6.0 * PERIOD)
        to = np.full(100, 0.3 * np.sin(2.5 * k) / (100 * PERIOD))
        up = np.concatenate([ramp, np.full(round(1.0 / PERIOD), v), ramp[::-1]])
        pieces += [to, np.zeros(100), up, np.zeros(100), -up, np.zeros(100), -to, np.zeros(100)]
    velocity = np.concatenate(pieces)
    return np.cumsum(velocity) * PERIOD, velocity


@pytest.fixture(scope="module")
def quiet() -> tuple[UniformSeries, SectionSet]:
    """The motion with friction and gravity, and its sections."""
    q, v = short_strokes()
    effort = lugre(v, *TRUTH) + 3.0 * np.sin(q)
    log = make_log(np.arange(q.size) * PERIOD, q[:, None], v[:, None], effort[:, None])
    series = condition(log, ConditioningConfig())
    return series, find_sections(series, SectionsConfig())


def with_ripple(series: UniformSeries, amplitude: float, seed: int) -> UniformSeries:
    """Ripple that is partly the same both ways and partly turns with the motion, and noise."""
    rng = np.random.default_rng(seed)
    phase = rng.uniform(0.0, 2.0 * np.pi, 2)
    q, sign = series.position_rad[:, 0], np.sign(series.velocity_rad_s[:, 0])
    wave = amplitude * (np.sin(CYCLES * q + phase[0]) + 0.5 * sign * np.sin(CYCLES * q + phase[1]))
    assert series.effort is not None
    return replace(series, effort=series.effort + (wave + 0.2 * rng.standard_normal(q.size))[:, None])


def pulls(points: tuple[FrictionPoint, ...]) -> list[float]:
    """Errors of slow points in their standard errors."""
    slow = [p for p in points if p.speed_rad_s < 0.15]
    return [float((p.friction_nm - lugre(np.array(p.speed_rad_s), *TRUTH)) / p.se_nm) for p in slow]


def all_pulls(quiet: tuple[UniformSeries, SectionSet], amplitude: float) -> float:
    series, sections = quiet
    found: list[float] = []
    for seed in range(8):
        spoilt = with_ripple(series, amplitude, seed)
        found += pulls(friction_points(spoilt, sections.of("joint1"), None))
    assert len(found) >= 30
    return float(np.sqrt(np.mean(np.square(found))))


def test_points_of_short_strokes_are_off_by_no_more_than_they_say(quiet: tuple[UniformSeries, SectionSet]) -> None:
    assert all_pulls(quiet, 0.6) < 1.7


def test_without_the_waves_they_are(quiet: tuple[UniformSeries, SectionSet], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "section_ripple", lambda *_: None)
    assert all_pulls(quiet, 0.6) > 4.0


def test_no_wave_is_found_in_noise(quiet: tuple[UniformSeries, SectionSet]) -> None:
    series, sections = quiet
    for seed in range(8):
        assert section_ripple(with_ripple(series, 0.0, seed), sections.of("joint1"), 0) is None


def test_the_wave_is_the_one_that_was_put_in(quiet: tuple[UniformSeries, SectionSet]) -> None:
    series, sections = quiet
    found = section_ripple(with_ripple(series, 0.6, 1), sections.of("joint1"), 0)
    assert found is not None
    assert found.cycles == pytest.approx([CYCLES], abs=0.3)
    ahead, back = found.coefficients
    against = np.hypot(*(0.5 * (ahead - back)))
    assert against == pytest.approx(0.3, abs=0.06)
    assert 0.0 < found.sd(found.gradient(np.linspace(0.0, 0.03, 50), 1.0)) < 0.15


def test_motion_in_one_direction_is_no_harm(quiet: tuple[UniformSeries, SectionSet]) -> None:
    series, sections = quiet
    ahead = [s for s in sections.of("joint1") if s.velocity_rad_s > 0]
    found = section_ripple(with_ripple(series, 0.6, 1), ahead, 0)
    assert found is None or np.isfinite(found.covariance).all()


@pytest.mark.parametrize("length", [1, 2, 3])
def test_sections_of_three_samples_at_most_say_nothing(quiet, length: int) -> None:  # type: ignore[no-untyped-def]
    series, found = quiet
    brief = [replace(s, span=Span(s.span.start, s.span.start + length)) for s in found.sections]
    assert section_ripple(series, brief, 0) is None
