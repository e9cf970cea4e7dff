"""Segmentation of known trapezoids."""

from __future__ import annotations

import numpy as np
import pytest
from synthetic import PERIOD, make_log, strokes

from collaudit.core.conditioning.conditioning import condition
from collaudit.core.config.schema import ConditioningConfig, SectionsConfig
from collaudit.core.friction.sections import find_sections

SPEEDS = (0.05, 0.1, 0.3, 0.8)


def sections_of(position, velocity, **settings):  # type: ignore[no-untyped-def]
    t = PERIOD * np.arange(position.shape[0])
    effort = np.sin(37 * t)[:, None] * np.ones_like(position)
    names = [f"joint{i + 1}" for i in range(position.shape[1])]
    series = condition(make_log(t, position, velocity, effort, names), ConditioningConfig())
    return series, find_sections(series, SectionsConfig(**settings))


def test_each_cruise_is_one_section_of_its_speed() -> None:
    rng = np.random.default_rng(3)
    q, v = strokes(SPEEDS)
    noisy = v + rng.normal(0, 0.002, v.size)
    _, found = sections_of(q[:, None], noisy[:, None])
    means = [s.velocity_rad_s for s in found.sections]
    expected = [sign * speed for speed in SPEEDS for sign in (1, -1)]
    assert means == pytest.approx(expected, abs=2e-3)
    for section in found.sections:
        true = v[section.span.slice]
        assert np.ptp(true) < 0.05 * abs(section.velocity_rad_s), "a ramp got into the section"


def test_most_of_the_cruise_is_used() -> None:
    q, v = strokes(SPEEDS)
    _, found = sections_of(q[:, None], v[:, None])
    for section in found.sections:
        cruise = np.count_nonzero(np.isclose(v, section.velocity_rad_s, atol=1e-3))
        assert len(section.span) > cruise - 2 * (SectionsConfig().settle_s + 0.1) / PERIOD


def test_a_short_cruise_loses_less_to_settling_than_a_long_one() -> None:
    for cruise_s, lost_s in ((0.32, 0.05), (0.6, 0.075), (3.0, 0.1)):
        q, v = strokes((0.2,), travel=0.1 * (cruise_s + 0.05))
        whole, kept = (sections_of(q[:, None], v[:, None], settle_s=s)[1].sections for s in (0.0, 0.1))
        assert len(whole) == len(kept) == 2
        for a, b in zip(whole, kept, strict=True):
            assert (b.span.start - a.span.start) * PERIOD == pytest.approx(lost_s, abs=0.02)
            assert (a.span.stop - b.span.stop) * PERIOD == pytest.approx(lost_s, abs=0.02)


def test_moving_neighbours_are_marked() -> None:
    q, v = strokes((0.2,))
    other = 0.3 * np.sin(2 * PERIOD * np.arange(q.size))
    rate = np.gradient(other, PERIOD)
    _, found = sections_of(np.column_stack([q, other]), np.column_stack([v, rate]))
    assert all(s.others_moving == ("joint2",) for s in found.of("joint1"))
    _, still = sections_of(np.column_stack([q, 0 * q]), np.column_stack([v, 0 * v]))
    assert all(s.others_moving == () for s in still.of("joint1"))


def test_every_rejection_has_its_reason() -> None:
    t = PERIOD * np.arange(5000)
    sine = 0.5 * np.sin(2 * np.pi * 0.5 * t)
    _, found = sections_of(sine[:, None], np.gradient(sine, PERIOD)[:, None], min_duration_s=0.4)
    assert found.sections == ()
    assert next(iter(found.rejection_counts("joint1"))) == "speed not constant"
    q, v = strokes((0.8,), travel=0.2)
    _, found = sections_of(q[:, None], v[:, None], min_duration_s=0.6)
    assert found.sections == ()
    assert "too short" in found.rejection_counts("joint1")


def test_a_section_never_spans_a_gap() -> None:
    q, v = strokes((0.05,))
    t = PERIOD * np.arange(q.size)
    keep = np.r_[0:4000, 4200 : q.size]
    effort = np.sin(37 * t[keep])[:, None]
    log = make_log(t[keep], q[keep, None], v[keep, None], effort)
    series = condition(log, ConditioningConfig())
    for section in find_sections(series, SectionsConfig()).sections:
        assert any(g.start <= section.span.start and section.span.stop <= g.stop for g in series.segments)


def test_standing_still_is_no_section() -> None:
    q = np.full((3000, 1), 0.3)
    _, found = sections_of(q, np.zeros_like(q))
    assert found.sections == ()
    assert found.rejected == ()


def test_cruises_shorter_than_settling_are_rejected() -> None:
    q, v = strokes(SPEEDS)
    counts = []
    for settle_s in (0.05, 0.3, 0.5, 1.0, 5.0, 30.0):
        _, found = sections_of(q[:, None], v[:, None], settle_s=settle_s)
        counts.append(len(found.sections))
        assert all(len(s.span) * PERIOD >= 0.15 for s in found.sections)
    assert counts == sorted(counts, reverse=True)
    assert counts[-1] == 0
