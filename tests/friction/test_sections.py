"""Segmentation of known trapezoids."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from synthetic import PERIOD, make_log, strokes

from collaudit.core.api import load_robot
from collaudit.core.conditioning.conditioning import condition
from collaudit.core.config.load import LoadedConfig
from collaudit.core.config.schema import ConditioningConfig, Config, SectionsConfig
from collaudit.core.friction import sections
from collaudit.core.friction.joint_fits import fit_joints
from collaudit.core.friction.sections import find_sections
from collaudit.core.prepare.preparation import prepare
from collaudit.core.torque_table.log_samples import REVERSAL_TRAVEL_RAD

SPEEDS = (0.05, 0.1, 0.3, 0.8)


def sections_of(position, velocity, **constants):  # type: ignore[no-untyped-def]
    t = PERIOD * np.arange(position.shape[0])
    effort = np.sin(37 * t)[:, None] * np.ones_like(position)
    names = [f"joint{i + 1}" for i in range(position.shape[1])]
    series = condition(make_log(t, position, velocity, effort, names), ConditioningConfig())
    with pytest.MonkeyPatch.context() as patched:
        for name, value in constants.items():
            patched.setattr(sections, name, value)
        return series, find_sections(series, SectionsConfig())


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


def test_what_lies_just_after_a_reversal_is_no_section() -> None:
    """There and back at 8 mrad/s: over 6 mrad friction turns over all the while, of 40 mrad it slides over most."""
    for way_rad, expected in ((0.006, 0), (0.04, 6)):
        speed, half = 0.008, round(way_rad / 0.008 / PERIOD)
        v = np.tile(np.repeat((speed, -speed), half), 3)
        q = PERIOD * np.cumsum(v)
        _, found = sections_of(q[:, None], v[:, None])
        assert len(found.sections) == expected
        for section in found.sections:
            assert np.ptp(section.position_rad) < way_rad - 0.9 * REVERSAL_TRAVEL_RAD


def test_most_of_the_cruise_is_used() -> None:
    q, v = strokes(SPEEDS)
    _, found = sections_of(q[:, None], v[:, None])
    for section in found.sections:
        cruise = np.count_nonzero(np.isclose(v, section.velocity_rad_s, atol=1e-3))
        turning_s = REVERSAL_TRAVEL_RAD / abs(section.velocity_rad_s)  # friction is not that of sliding yet
        assert len(section.span) > cruise - (turning_s + 2 * (sections.SETTLE_S + 0.1)) / PERIOD


def test_a_short_cruise_loses_less_to_settling_than_a_long_one() -> None:
    for cruise_s, lost_s in ((0.32, 0.05), (0.6, 0.075), (3.0, 0.1)):
        q, v = strokes((0.2,), travel=0.1 * (cruise_s + 0.05))
        whole, kept = (sections_of(q[:, None], v[:, None], SETTLE_S=s)[1].sections for s in (0.0, 0.1))
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
    _, found = sections_of(sine[:, None], np.gradient(sine, PERIOD)[:, None], MIN_DURATION_S=0.4)
    assert found.sections == ()
    assert found.rejected["joint1"].most_common(1)[0][0] == "speed not constant"
    q, v = strokes((0.8,), travel=0.2)
    _, found = sections_of(q[:, None], v[:, None], MIN_DURATION_S=0.6)
    assert found.sections == ()
    assert "too short" in found.rejected["joint1"]


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
    assert not found.rejected["joint1"]


def test_cruises_shorter_than_settling_are_rejected() -> None:
    q, v = strokes(SPEEDS)
    counts = []
    for settle_s in (0.05, 0.3, 0.5, 1.0, 5.0, 30.0):
        _, found = sections_of(q[:, None], v[:, None], SETTLE_S=settle_s)
        counts.append(len(found.sections))
        assert all(len(s.span) * PERIOD >= 0.15 for s in found.sections)
    assert counts == sorted(counts, reverse=True)
    assert counts[-1] == 0


def seeds_of(part: np.ndarray, least: int) -> list[tuple[int, int]]:
    """Longest runs of samples about which ``least`` of a stretch lie within tolerance, window by window."""
    half, found = least // 2, []
    for k in range(half, part.size - half):
        window = part[k - half : k - half + least]
        middle = 0.5 * (window.max() + window.min())
        if np.ptp(window) <= 2 * max(sections.SPEED_TOLERANCE * abs(middle), sections.SPEED_TOLERANCE_RAD_S):
            if found and found[-1][1] == k:
                found[-1] = (found[-1][0], k + 1)
            else:
                found.append((k, k + 1))
    return [(max(a - half, 0), b + half) for a, b in found]


@pytest.mark.parametrize("least", [2, 9, 20])
def test_constant_speed_is_looked_for_inside_each_stretch_alone(least: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """What lies beside a stretch, faster motion or nothing known, does not count; its speed wanders here."""
    rng = np.random.default_rng(8)
    v = 0.3 + 0.002 * np.cumsum(rng.normal(size=3000))
    v[700:760] = np.nan
    v[1500:1503] = 9.0
    quiet = sections._quiet(v, least, 0.0)
    for start, stop in ((0, 700), (760, 1500), (1503, 3000), (760, 760 + least)):
        seen: list[tuple[int, int]] = []
        monkeypatch.setattr(sections, "_grow", lambda _, seed, *__: seen.append((seed.start, seed.stop)) or (0, 0))  # noqa: B023
        sections._plateaus(v[start:stop], quiet[start:stop], least, 0.0)
        assert seen == [(a, b) for a, b in seeds_of(v[start:stop], least) if b - a >= least]
        assert seen or stop - start == least


def sweep(noise: float) -> tuple[np.ndarray, ...]:
    """Holds of one second at ten speeds and both directions, 48 Hz: a motor alone, its friction 0.5 + 0.1 |v|."""
    rng = np.random.default_rng(5)
    speeds = np.repeat([0.0, *(sign * speed for speed in np.linspace(0.4, 4.0, 10) for sign in (1, -1)), 0.0], 48)
    q = np.cumsum(speeds) / 48
    tau = np.sign(speeds) * 0.5 + 0.1 * speeds + rng.normal(0, 0.02, q.size)
    return np.arange(q.size) / 48, q, speeds + rng.normal(0, noise, q.size), tau


@pytest.mark.parametrize("noise", [0.0, 0.03, 0.05])
def test_holds_of_a_second_are_sections_in_noise_too(noise: float) -> None:
    t, q, v, tau = sweep(noise)
    log = make_log(t, q[:, None], v[:, None], tau[:, None], ["motor"])
    series = condition(log, ConditioningConfig(velocity="log"))
    found = find_sections(series, SectionsConfig()).sections
    assert len(found) == 20
    expected = [sign * (0.5 + 0.1 * speed) for speed in np.linspace(0.4, 4.0, 10) for sign in (1, -1)]
    assert [float(np.mean(series.effort[s.span.slice, 0])) for s in found] == pytest.approx(expected, abs=0.04)


def test_every_section_gives_a_point_or_a_reason() -> None:
    t, q, v, tau = sweep(0.02)
    far = q + np.cumsum(np.where(v < -0.2, 0.0, 0.02))  # no stroke is passed again
    log = make_log(t, far[:, None], np.gradient(far, t)[:, None], tau[:, None], ["motor"])
    loaded = LoadedConfig(Config.of({"robot": {"joints": ["motor"]}}), Path(), "", None)
    prepared = prepare(log, load_robot(loaded, ["motor"]), loaded.config)
    (fit,) = fit_joints([prepared], loaded.config).values()
    alone = sum(count for reason, count in fit.rejected.items() if "without a model" in reason)
    assert fit.section_count > 0
    assert fit.section_count == 2 * fit.n_pairs + (fit.n_points - fit.n_pairs) + alone
