"""Plots lose no spike, hide nothing in silence, and draw no text from a log."""

from __future__ import annotations

import re
import zlib
from base64 import b64decode
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import samples
from hypothesis import given, settings
from hypothesis import strategies as st

from collaudit.core.data.audit_result import Audit, AuditResult
from collaudit.core.data.detection_result import Contact, ContactScene
from collaudit.core.data.signals import State
from collaudit.core.friction.friction_model import FrictionModel
from collaudit.reports.files.run_files import open_run, read_run, write_run
from collaudit.reports.files.signals_file import in_memory
from collaudit.reports.page.html import html_text
from collaudit.reports.plots.arm_pose import draw_pose, drawn_arm
from collaudit.reports.plots.joint_trace import JointTrace, column_edges, column_shares, thin
from collaudit.reports.plots.plot_contact import contact_window, draw_contact, model_range
from collaudit.reports.plots.plot_friction import band, curve, draw_friction
from collaudit.reports.plots.plot_residual import autocorrelation, coverage_bar, draw_overview
from collaudit.reports.plots.signal_data import kept_samples, packed
from collaudit.reports.plots.svg import polyline, strokes, tick_text, ticks
from collaudit.reports.values.first_words import strongest


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
    edges = column_edges(len(mask), columns)
    assert (column_shares(array, edges) * np.diff(edges)).sum() == pytest.approx(array.sum())


def only(audit: Audit, **signals: np.ndarray) -> JointTrace:
    return in_memory(replace(audit.signals, **signals)).trace(1)


def overview(trace: JointTrace, result: AuditResult) -> tuple[str, float, str | None]:
    alarms = [event for event in result.collisions if event.joint == trace.joint]
    return draw_overview(trace, alarms, [], "x", "label")


def test_the_bar_shows_each_state_where_it_holds() -> None:
    audit = samples.failed(2000)
    state = np.repeat([State.JUDGED, State.GAP, State.SATURATED, State.FRICTION_INTERVAL], 500).astype(np.int8)
    trace = replace(in_memory(audit.signals).trace(1), state=state)
    drawn = str(coverage_bar(trace, "label"))
    assert [shown(drawn, x) for x in (0, 249, 251, 499, 501, 749, 751, 999)] == [
        "judged", "judged", "gap", "gap", "out", "out", "standing", "standing"
    ]  # fmt: skip


def test_a_column_of_the_bar_is_shared_by_what_happened_in_it() -> None:
    audit = samples.failed(2000)
    state = np.full(2000, State.JUDGED, dtype=np.int8)
    state[1] = State.SATURATED  # the second sample of the first of a thousand columns
    drawn = str(coverage_bar(replace(in_memory(audit.signals).trace(1), state=state), "label"))
    assert [shown(drawn, 0, height) for height in (10, 40, 60, 90)] == ["judged", "judged", "out", "out"]
    assert shown(drawn, 1, 90) == "judged"


def shown(drawn: str, x: int, height: int = 50) -> str:
    """The kind that is seen in a column of a bar at a height above its floor: the last drawn that reaches it."""
    seen = ""
    for kind, steps in re.findall(r'<path class="(\w+)" d="M0 100(.*?)V100z"/>', drawn):
        at, top = 0, 0
        for rise, run in re.findall(r"v(-?\d+)h(\d+)", steps):
            top -= int(rise)
            if at <= x < at + int(run) and top > height:
                seen = kind
            at += int(run)
    return seen


def card(audit: Audit, contact: Contact) -> str:
    source = in_memory(audit.signals)
    windows = [contact_window(source.trace(k), contact) for k in range(len(source.joint_names))]
    return draw_contact([w for w in windows if w is not None], contact, contact.joints[0], "N·m", None, "x", "label")


def test_no_text_of_the_log_is_drawn() -> None:
    audit = samples.hostile()
    svg = card(audit, audit.result.contacts[0])
    words = set(re.findall(r"<text[^>]*>([^<]*)</text>", svg))
    expected = {"residual ÷ γ, all joints", "torque, N·m", "time, s"}
    assert expected <= words
    assert all(re.fullmatch(r"[−\d.]+", word) for word in words - expected)


def test_the_model_is_a_band_where_friction_is_a_range() -> None:
    """Measured less the residual looks like a perfect model there: the residual is zero by construction."""
    audit = samples.failed(20_000)
    s = audit.signals
    contact = audit.result.contacts[0]
    state = np.full_like(s.state, State.FRICTION_INTERVAL)
    least = np.full(s.residual_nm.shape, -3.0, dtype=np.float32)
    open_ = replace(s, state=state, residual_nm=np.zeros_like(s.residual_nm), least_nm=least, most_nm=-least)
    window = contact_window(in_memory(open_).trace(0), contact)
    assert window is not None
    known = np.isfinite(window.measured_nm)
    low, high = model_range(window, slice(None))
    np.testing.assert_allclose((high - low)[known], 6.0, rtol=1e-6)
    np.testing.assert_allclose((high - window.measured_nm)[known], 3.0, rtol=1e-5)
    assert 'class="model-range"' in card(replace(audit, signals=open_), contact)
    untold = contact_window(in_memory(replace(open_, least_nm=None, most_nm=None)).trace(0), contact)
    assert untold is not None
    assert np.isnan(model_range(untold, slice(None))[0]).all(), "what does not tell the range: no line, no band"


def test_labels_are_escaped() -> None:
    svg, _, _ = draw_overview(only(samples.failed(2000)), [], [], "x", '"><script>')
    assert "<script>" not in svg
    assert "&#34;&gt;&lt;script&gt;" in svg


@pytest.mark.parametrize(("told", "note"), [(State.SATURATED, True), (State.JUDGED, False)])
def test_what_the_axis_leaves_out_is_said_and_is_never_judged(told: State, note: bool) -> None:
    audit = samples.failed(2000)
    residual, state = audit.signals.residual_nm.copy(), audit.signals.state.copy()
    residual[100:103, 1], state[100:103, 1] = 5000.0, told
    _, height, said = overview(only(audit, residual_nm=residual, state=state), audit.result)
    words = "3 samples that were not judged lie outside the axis, the largest at 5000"
    assert said == (words if note else None)
    assert (height < 100) == note


@pytest.mark.parametrize("onset", [-1.0, 0.0, 3.999, 100.0])
def test_contacts_at_the_ends_of_a_log_are_drawn(onset: float) -> None:
    audit = samples.failed(2000)
    contact = replace(audit.result.contacts[0], onset_s=onset, detected_s=onset + 0.024, end_s=onset + 0.1)
    assert card(audit, contact).startswith("<svg")


@pytest.mark.parametrize("count", [0, 1, 2, 3])
def test_a_few_samples_are_enough(count: int) -> None:
    audit = samples.failed(2000)
    s = audit.signals
    names = ("time_s", "position_rad", "velocity_rad_s", "measured_nm", "model_nm", "residual_nm", "state", "gamma_nm")
    short = replace(audit, signals=replace(s, **{name: getattr(s, name)[:count] for name in names}))
    assert "FAIL" in html_text([short])
    if count:
        assert overview(only(short), audit.result)[0].startswith("<svg")


def test_a_one_sample_spike_is_drawn_and_kept_for_the_pages_own_plots() -> None:
    audit = samples.failed(100_000)
    residual, state = audit.signals.residual_nm.copy(), audit.signals.state.copy()
    residual[70_007, 1], state[70_007, 1] = -6.25, State.JUDGED
    trace = only(audit, residual_nm=residual, state=state)
    svg, height, _ = draw_overview(trace, [], [], "x", "label")
    bottom = 84 * (1 + 6.25 / height) / 2
    ends = [y for path in re.findall(r'class="curve" d="([^"]*)"', svg) for y in stroke_ends(path)]
    assert max(ends) == pytest.approx(bottom, abs=0.51), "strokes end on whole pixels"
    assert 70_007 in kept_samples(trace, 900, [], 0)


def stroke_ends(path: str) -> list[float]:
    """Where the vertical strokes of a path begin and end, by its relative steps."""
    at, ends = 0.0, []
    for move, length in re.findall(r"m-?[\d.]+?(?: |(?=-))(-?[\d.]+)v(-?[\d.]+)", path):
        ends += [at + float(move), at + float(move) + float(length)]
        at = ends[-1]
    return ends


def test_paths_are_steps_between_rounded_points() -> None:
    """Errors of rounding do not add up, also over many small steps; a number is never read into the one before it."""
    x, y = np.arange(2000) * 0.034, 40 - np.arange(2000) * 0.016
    numbers = [float(text) for text in re.findall(r"-?\d*\.?\d+", polyline(x, y))]
    ends = np.cumsum(np.array(numbers).reshape(-1, 2), axis=0)
    assert np.abs(ends - np.stack([x, y], axis=1)).max() <= 0.0501
    assert polyline(np.array([0.04, 10.0, 10.0]), np.array([-0.5, -0.5, 3.26])) == "M0 -0.5l10 0 0 3.8"
    assert strokes(np.array([5.0, 6.5]), np.array([80.0, 70.0]), np.array([20.0, 69.0])) == "m5 80v-60m1.5 50v-1"


def unpacked(data: dict[str, Any]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Sample numbers, residual and state as the page's script reads them."""
    raw, n = zlib.decompress(b64decode(data["data"])), data["kept"]
    planes = np.frombuffer(raw, np.uint8).reshape(7, 4, n)
    columns = np.ascontiguousarray(np.moveaxis(planes, 1, 2)).view("<f4")[..., 0]
    return np.cumsum(columns[0]).astype(int), columns[1], columns[6]


def test_the_pages_own_data_are_the_signals_and_never_cross_gamma() -> None:
    audit = samples.failed(200_000)
    residual = audit.signals.residual_nm.copy()
    residual[150_000:150_040, 1] = 4.0 + np.linspace(-1e-6, 1e-6, 40)
    residual[:, 1][150_020] = 4.0  # at γ is not above it
    trace = only(audit, residual_nm=residual)
    kept = kept_samples(trace, 900, [(299.9, 300.2)], 600)
    index, shown, state = unpacked(packed(trace, kept))
    np.testing.assert_array_equal(index, kept)
    true = trace.residual_nm[index]
    np.testing.assert_array_equal(np.isnan(shown), np.isnan(true))
    known = np.isfinite(true)
    np.testing.assert_array_equal(shown, true)
    np.testing.assert_array_equal(np.abs(shown[known]) > 4.0, np.abs(true[known]) > 4.0)
    np.testing.assert_array_equal(state == 0, trace.judged[index])


def test_autocorrelation_is_that_of_the_process() -> None:
    rng = np.random.default_rng(1)
    x = np.zeros(200_000)
    shocks = rng.standard_normal(x.size)
    for k in range(1, x.size):
        x[k] = 0.98 * x[k - 1] + shocks[k]
    audit = samples.failed(2000)
    judged = (rng.random(x.size) < 0.7).astype(np.int8) ^ 1
    trace = replace(only(audit), time_s=np.arange(x.size) * 0.002, residual_nm=x, state=judged)
    lags, values = autocorrelation(trace)
    expected = 0.98 ** np.round(lags / 0.002)
    np.testing.assert_allclose(values, expected, atol=0.06)
    assert autocorrelation(replace(trace, state=np.full(x.size, State.GAP)))[0].size == 0


def test_ticks_are_round_and_within() -> None:
    assert ticks(0.0, 57.5, 8) == pytest.approx([0, 5, 10, 15, 20, 25, 30, 35, 40, 45, 50, 55])
    assert tick_text(ticks(-0.5, 0.5, 4)) == ["−0.4", "−0.2", "0", "0.2", "0.4"]
    assert ticks(1.0, 1.0, 4) == []


def test_the_pose_marks_the_joints_that_alarmed() -> None:
    points = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.4), (0.3, 0.3, 0.4), (0.5, 0.5, 0.2))
    scene = ContactScene(1.0, points, "tool", 0.3, {})
    svg = draw_pose(drawn_arm(scene, None), [1], [1], "x", "label")
    assert svg is not None and "arm-axis" not in svg
    assert svg.count('class="arm-hit"') == 2, "once from the side, once from above"
    assert draw_pose(drawn_arm(replace(scene, points_m=points[:1]), None), [], [], "x", "label") is None


def test_with_its_kinematics_the_arm_is_drawn_with_axes_base_and_scale() -> None:
    scene = ContactScene(1.0, ((0.0, 0.0, 0.0),) * 7, "tool", 0.3, {}, dict.fromkeys(samples.JOINTS, 0.3))
    drawn = drawn_arm(scene, samples.arm())
    assert drawn.parents == (-1, 0, 1, 2, 3, 4, 5)
    assert np.linalg.norm(drawn.axes, axis=1) == pytest.approx(np.ones(6))
    svg = draw_pose(drawn, [], [], "x", "label")
    assert svg is not None
    for kind in ("arm-base", "arm-axis", "arm-scale"):
        assert svg.count(f'class="{kind}"') == 2
    assert "0.5 m" in svg


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


def test_those_furthest_above_their_thresholds_have_cards_in_order_of_time() -> None:
    result = samples.failed(2000).result
    alarm = result.collisions[0]

    def of(*heights: float) -> list[int]:
        alarms = tuple(
            replace(alarm, onset_s=float(k), detected_s=k + 0.1, duration_s=0.2, peak_nm=height * alarm.gamma_nm)
            for k, height in enumerate(heights)
        )
        return list(strongest(samples.with_alarms(result, alarms), 2))

    assert of(1.5, 3.0, 1.1, 9.0) == [2, 4]
    assert of(3.0, 9.0, 3.0, 1.0) == [1, 2], "of equals the earlier"
    assert of(2.0) == [1]
    assert of() == []


def test_every_contact_has_samples_of_its_own_and_its_peak_among_them() -> None:
    audit = samples.failed(30_000)
    residual, state = audit.signals.residual_nm.copy(), audit.signals.state.copy()
    peaks = np.arange(1500, 28_500, 1500)
    residual[peaks, 1], state[:, 1] = 3.9, State.JUDGED
    residual[20_000:20_500, 1] = 30 * np.sin(np.arange(500))  # takes the extremes of its neighbourhood
    trace = only(audit, residual_nm=residual, state=state)
    windows = [(0.002 * k - 0.3, 0.002 * k + 0.3) for k in peaks]
    kept = kept_samples(trace, 300, windows, 1200)
    assert set(peaks) <= set(kept)
    for start, stop in windows:
        inside = (trace.time_s[kept] >= start) & (trace.time_s[kept] <= stop)
        assert np.count_nonzero(inside) >= 40
    assert len(kept) <= 300 + 1200 + len(windows)


def test_pages_of_runs_read_back_are_the_same(tmp_path: Path) -> None:
    audit = samples.failed(5000)
    wrench = np.linspace(0, 9, 30_000).reshape(5000, 6)
    audit = replace(audit, signals=replace(audit.signals, wrench=wrench))
    write_run(tmp_path, audit, None)
    assert html_text([audit]) == html_text([read_run(tmp_path)]) == html_text([open_run(tmp_path)])


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
