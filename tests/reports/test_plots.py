"""Plots lose no spike, hide nothing in silence, and draw no text from a log."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
import samples
from hypothesis import given, settings
from hypothesis import strategies as st

from collaudit.core.data.signals import State
from collaudit.core.friction.friction_model import FrictionModel
from collaudit.reports.page.selection import select
from collaudit.reports.page.view import make_view
from collaudit.reports.plots.coverage_bar import coverage_bar
from collaudit.reports.plots.downsample import column_shares, thin
from collaudit.reports.plots.friction_band import band, curve
from collaudit.reports.plots.plot_events import draw_event
from collaudit.reports.plots.plot_friction import draw_friction
from collaudit.reports.plots.plot_overview import _peak_time, draw_overview
from collaudit.reports.plots.plot_residual import trace


@settings(deadline=None)
@given(
    st.integers(1, 3000),
    st.integers(0, 2**32 - 1),
    st.floats(0, 1),
    st.integers(4, 200),
)
def test_thinning_keeps_every_extreme_and_every_break(n: int, seed: int, missing: float, points: int) -> None:
    rng = np.random.default_rng(seed)
    values = rng.standard_normal(n)
    values[rng.random(n) < missing] = np.nan
    if seed % 3 == 0:
        values[: n // 2] = np.nan
    if seed % 5 == 0:
        values[rng.integers(n)] = np.inf
    time_s = np.arange(n) * 0.002
    kept_time, kept = thin(time_s, values, points)
    finite = np.isfinite(values)
    assert np.isfinite(kept).any() == finite.any()
    if finite.any():
        assert np.nanmax(kept) == values[finite].max()
        assert np.nanmin(kept) == values[finite].min()
    index = np.searchsorted(time_s, kept_time[np.isfinite(kept)])
    np.testing.assert_array_equal(values[index], kept[np.isfinite(kept)])
    drawn = np.isfinite(kept)
    for a, b in zip(np.flatnonzero(drawn[:-1] & drawn[1:]), np.flatnonzero(drawn[:-1] & drawn[1:]) + 1, strict=True):
        start, stop = np.searchsorted(time_s, kept_time[[a, b]])
        assert finite[start : stop + 1].all(), "a line was drawn across missing samples"


def test_a_one_sample_spike_survives_a_million_samples() -> None:
    values = np.zeros(1_000_000)
    values[123_456], values[123_457] = 9.0, -8.0
    _, kept = thin(np.arange(len(values)) * 1e-3, values, 2000)
    assert kept.max() == 9.0
    assert kept.min() == -8.0
    assert len(kept) <= 2000


@given(st.lists(st.booleans(), min_size=1, max_size=300), st.integers(1, 50))
def test_column_shares_add_up(mask: list[bool], columns: int) -> None:
    array = np.array(mask)
    shares = column_shares(array, columns)
    sizes = np.diff(np.linspace(0, len(mask), min(columns, len(mask)) + 1).astype(int))
    assert (shares * sizes).sum() == pytest.approx(array.sum())


def test_the_bar_shows_each_state_where_it_holds() -> None:
    state = np.repeat([State.JUDGED, State.GAP, State.SATURATED, State.FRICTION_INTERVAL], 500).astype(np.int8)
    drawn = str(coverage_bar(state, "label"))
    assert '<path class="judged" d="M0 0H250V100H0Z"/>' in drawn
    assert '<path class="gap" d="M250 0H500V100H250Z"/>' in drawn
    assert '<path class="out" d="M500 0H750V100H500Z"/>' in drawn
    assert '<path class="standing" d="M750 0H1000V100H750Z"/>' in drawn


def test_no_text_of_the_log_is_drawn() -> None:
    audit = samples.hostile()
    event = audit.result.collisions[0]
    svg, _ = draw_event(audit.signals, audit.result.rule, event, "N·m", "x", "label")
    words = set(re.findall(r"<text[^>]*>([^<]*)</text>", svg))
    assert {"onset", "detected", "residual, N·m", "torque, N·m", "time, s"} <= words
    assert all(
        re.fullmatch(r"[−\d.]+", word)
        for word in words - {"onset", "detected", "residual, N·m", "torque, N·m", "time, s"}
    )


def test_labels_are_escaped() -> None:
    audit = samples.failed(2000)
    svg, _ = draw_overview(audit.result, audit.signals, "elbow", "N·m", "x", '"><script>')
    assert "<script>" not in svg
    assert "&#34;&gt;&lt;script&gt;" in svg


def test_what_the_axis_leaves_out_is_said() -> None:
    audit = samples.failed(2000)
    residual = audit.signals.residual_nm.copy()
    state = audit.signals.state.copy()
    residual[100:103, 1], state[100:103, 1] = 5000.0, State.SATURATED
    signals = replace(audit.signals, residual_nm=residual, state=state)
    _, note = draw_overview(audit.result, signals, "shoulder_lift", "N·m", "x", "label")
    assert note == "3 samples that were not judged lie outside the axis, the largest at 5000"


def test_a_judged_spike_is_never_left_out() -> None:
    audit = samples.failed(2000)
    residual = audit.signals.residual_nm.copy()
    state = audit.signals.state.copy()
    residual[500, 1], state[500, 1] = 5000.0, State.JUDGED
    signals = replace(audit.signals, residual_nm=residual, state=state)
    assert draw_overview(audit.result, signals, "shoulder_lift", "N·m", "x", "label")[1] is None


@pytest.mark.parametrize("onset", [-1.0, 0.0, 3.999, 100.0])
def test_events_at_the_ends_of_a_log_are_drawn(onset: float) -> None:
    audit = samples.failed(2000)
    event = replace(audit.result.collisions[0], onset_s=onset, detected_s=onset + 0.024)
    svg, _ = draw_event(audit.signals, audit.result.rule, event, "N·m", "x", "label")
    assert svg.startswith("<svg")


def test_two_samples_are_enough() -> None:
    audit = samples.failed(2000)
    s = audit.signals
    short = {
        name: getattr(s, name)[:2]
        for name in ("time_s", "position_rad", "velocity_rad_s", "measured_nm", "model_nm", "residual_nm", "state")
    }
    assert draw_overview(audit.result, replace(s, **short), "elbow", "N·m", "x", "label")[0].startswith("<svg")


def test_the_band_is_the_delta_method() -> None:
    fit = samples.friction_file().joints["elbow"]  # A + D·v: var = Saa + 2 v Sad + v² Sdd, 8 - 2 - 1 degrees left
    law = FrictionModel.of(fit)
    assert law is not None
    speed = np.array([0.05, 0.3])
    edges = band(fit, speed)
    assert edges is not None
    (aa, ad), (_, dd) = fit.covariance
    half = 2.5705818366147395 * np.sqrt(aa + 2 * speed * ad + speed**2 * dd)
    np.testing.assert_allclose(edges[1] - curve(law, speed), half, rtol=1e-6)
    np.testing.assert_allclose(curve(law, speed) - edges[0], half, rtol=1e-6)
    assert curve(law, np.array([0.0]))[0] == pytest.approx(fit.parameters["A_nm"])


def test_no_covariance_means_no_band() -> None:
    fit = samples.friction_file().joints["shoulder_lift"]
    assert band(fit, np.array([0.1])) is None


def test_points_without_a_model_are_drawn() -> None:
    fit = replace(samples.friction_file().joints["elbow"], model=None, parameters={}, ci95={}, covariance=None)
    assert draw_friction(fit, "N·m", "rad/s", "x", "label").startswith("<svg")


def test_the_worst_is_always_drawn() -> None:
    events = samples.many_events(300).result.collisions
    chosen = select(events, 10)
    assert len(chosen.drawn) == 10
    assert {298, 299} <= chosen.drawn
    assert set(range(8)) <= chosen.drawn
    assert select(events, 300).note is None


def test_views_of_runs_read_back_are_the_same(tmp_path) -> None:
    from collaudit.reports.files.run_files import read_run, write_run

    audit = samples.failed(5000)
    write_run(tmp_path, audit, None)
    assert make_view(audit, "a", 9, 9) == make_view(read_run(tmp_path), "a", 9, 9)


def test_a_lone_judged_sample_is_drawn() -> None:
    audit = samples.failed(2000)
    state = np.full_like(audit.signals.state, State.FRICTION_INTERVAL)
    residual = np.zeros_like(audit.signals.residual_nm)
    quiet = replace(audit.result, collisions=(), near_misses=())
    signals = replace(audit.signals, residual_nm=residual, state=state)
    without, _ = draw_overview(quiet, signals, "elbow", "N·m", "x", "label")
    residual[700, 2], state[700, 2] = 9.0, State.JUDGED
    drawn, _ = draw_overview(quiet, signals, "elbow", "N·m", "x", "label")
    assert drawn.count("#0b4f8a") > without.count("#0b4f8a")


def test_marks_stand_on_the_curve() -> None:
    audit = samples.failed(20_000)
    event = audit.result.collisions[0]
    at = _peak_time(trace(audit.signals, 0), event)
    assert event.onset_s < at < event.onset_s + event.duration_s
    assert abs(np.interp(at, audit.signals.time_s, audit.signals.residual_nm[:, 0])) > 8


def test_the_band_of_the_exponential_law_is_the_delta_method_too() -> None:
    fit = samples.friction_file().joints["shoulder_pan"]
    speed = np.array([0.03, 0.1, 0.5])
    edges = band(fit, speed)
    assert edges is not None
    b, c = fit.parameters["B_nm"], fit.parameters["C_s_per_rad"]
    decay = np.exp(-c * speed)
    g = np.stack([np.ones(3), decay, -b * speed * decay, speed], axis=1)
    half = 3.1824463052842638 * np.sqrt(np.einsum("ni,ij,nj->n", g, np.array(fit.covariance), g))  # t, 8 - 4 - 1
    np.testing.assert_allclose(edges[1] - edges[0], 2 * half, rtol=1e-5)
