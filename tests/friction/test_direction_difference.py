"""Friction that differs between the directions, where pairs of sections average both."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from synthetic import PERIOD, lugre, make_log

from collaudit.core.conditioning.conditioning import condition
from collaudit.core.config.schema import ConditioningConfig, SectionsConfig
from collaudit.core.friction.friction_fitting import fit_friction
from collaudit.core.friction.friction_points import friction_points
from collaudit.core.friction.gear.direction_difference import PairSum, direction_difference
from collaudit.core.friction.joint_fits import friction_findings
from collaudit.core.friction.law_candidates import FrictionUnits
from collaudit.core.friction.sections import find_sections

SPEEDS = np.geomspace(0.02, 1.2, 30)


def pairs(viscous: float, fading: float, seed: int, noise: float = 0.02) -> list[PairSum]:
    """An experiment through rising speeds: a zero that drifts, gravity 5 % off, and what the directions differ by."""
    rng = np.random.default_rng(seed)
    time = 2.7 * np.arange(30)
    q = 0.5 * np.sin(4.0 * np.pi * np.arange(30) / 29)
    drift = 0.35 * np.sin(2.0 * np.pi * time / 180.0 + rng.uniform(0.0, 6.0)) + rng.uniform(-1.0, 1.0)
    model = 12.0 * np.cos(q - 0.8)
    apart = viscous * SPEEDS + fading * np.exp(-15.0 * SPEEDS)
    half = 0.5 * apart + drift + 0.05 * model + noise * rng.standard_normal(30)
    return [
        PairSum(float(v), float(h), noise, float(t), float(x), float(m))
        for v, h, t, x, m in zip(SPEEDS, half, time, q, model, strict=True)
    ]


def test_directions_that_are_alike_are_not_said_to_differ() -> None:
    """A zero that drifts by a sine is no polynomial: one of a hundred joints at most is said to differ."""
    assert sum(direction_difference([pairs(0.0, 0.0, seed)]) is not None for seed in range(100)) <= 1


def test_a_difference_in_viscous_friction_lies_in_its_interval() -> None:
    held = 0
    for seed in range(60):
        found = direction_difference([pairs(6.0, 0.0, seed)])
        assert found is not None
        held += found.ci95[0] <= 6.0 * (SPEEDS[-1] - SPEEDS[0]) <= found.ci95[1]
    assert 60 * 0.95 - 3 * np.sqrt(60 * 0.95 * 0.05) <= held


def test_a_difference_near_standstill_is_found() -> None:
    found = [direction_difference([pairs(0.0, 3.0, seed)]) for seed in range(20)]
    assert sum(x is not None for x in found) >= 18


def test_few_pairs_and_one_speed_tell_nothing() -> None:
    assert direction_difference([pairs(9.0, 0.0, 0)[:12]]) is None
    assert direction_difference([[replace(p, speed_rad_s=0.3) for p in pairs(9.0, 0.0, 0)]]) is None


@pytest.mark.parametrize("more_forward", [0.0, 6.0])
def test_from_strokes_to_the_finding(more_forward: float) -> None:
    """Forward friction with 6 N·m·s/rad more than backward friction: the sign, the size, and the words."""
    pieces = []
    for k, v in enumerate(np.geomspace(0.03, 1.0, 24)):
        ramp = np.arange(0.0, v, 6.0 * PERIOD)
        up = np.concatenate([ramp, np.full(round(0.8 / PERIOD), v), ramp[::-1]])
        to = np.full(100, (0.5 * np.sin(2.5 * k) - 0.45 * v) / (100 * PERIOD))  # else place goes along with speed
        pieces += [to, np.zeros(60), up, np.zeros(60), -up, np.zeros(60), -to, np.zeros(60)]
    velocity = np.concatenate(pieces)
    q = np.cumsum(velocity) * PERIOD
    gravity = 4.0 * np.sin(q)
    noise = 0.1 * np.random.default_rng(2).standard_normal(q.size)
    effort = lugre(velocity, 6.0, 1.5, 20.0, 4.0) + 0.5 * more_forward * np.abs(velocity) + gravity + 0.7 + noise
    log = make_log(np.arange(q.size) * PERIOD, q[:, None], velocity[:, None], effort[:, None])
    series = condition(log, ConditioningConfig())
    model = np.interp(series.time_s, log.time_s, gravity)[:, None]
    sections = find_sections(series, SectionsConfig()).of("joint1")
    points, sums = friction_points(series, sections, model)
    fit = fit_friction(points, FrictionUnits.of("revolute", "Nm"), "static-lugre")
    fit = replace(fit, directions=direction_difference([sums]))
    said = [f.text for f in friction_findings({"joint1": fit}) if "between the directions" in f.text]
    assert len(said) == (more_forward > 0)
    if fit.directions is not None:
        low, high = fit.directions.ci95
        assert low < 6.0 * 0.95 < high
        for ci95, words in (((2.0, 9.0), "changes by"), ((-1.0, 9.0), "by how much is not determined")):
            told = replace(fit, directions=replace(fit.directions, ci95=ci95))
            text = next(f.text for f in friction_findings({"joint1": told}) if "between the directions" in f.text)
            assert words in text
