"""Rule (6): against a direct reading of its definition, and its invariants."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from plain_rule import collisions

from collaudit.core.config.schema import DetectConfig
from collaudit.core.cycles.null_level import NullEvidence
from collaudit.core.detection.rule import persistence_samples, rule_events
from collaudit.core.detection.rule_settings import stated_persistence
from collaudit.core.numeric.arrays import run_bounds
from collaudit.core.recommend.arm_evidence import sustained_level

RESIDUALS = arrays(np.float64, st.integers(1, 200), elements=st.one_of(st.floats(-10, 10), st.just(np.nan)))
MASKS = st.integers(0, 2**32 - 1)


def mask_for(x: np.ndarray, seed: int) -> np.ndarray:
    return np.asarray(np.random.default_rng(seed).random(x.size) > 0.1)


def fires(x: np.ndarray, evidence: np.ndarray, gamma: float, n: int) -> list[int]:
    """The paper's rule sample by sample: indices at which the run reaches n."""
    m, out = 0, []
    for k in range(x.size):
        m = m + 1 if evidence[k] and abs(x[k]) > gamma else 0
        if m == n:
            out.append(k)
    return out


@given(RESIDUALS, MASKS, st.floats(0.1, 9), st.integers(1, 12))
def test_the_rule_is_the_papers(x: np.ndarray, seed: int, gamma: float, n: int) -> None:
    evidence = mask_for(x, seed)
    events = collisions(x, evidence, gamma, n)
    assert [e.detected for e in events] == fires(x, evidence, gamma, n)


@given(RESIDUALS, MASKS, st.floats(0.1, 9), st.integers(1, 12), st.sampled_from([0.25, 2.0, 1024.0]))
def test_scaling_residual_and_gamma_together_changes_nothing(
    x: np.ndarray, seed: int, gamma: float, n: int, scale: float
) -> None:
    evidence = mask_for(x, seed)
    one = [(e.span, e.detected) for e in collisions(x, evidence, gamma, n, 5)]
    other = [(e.span, e.detected) for e in collisions(scale * x, evidence, scale * gamma, n, 5)]
    assert one == other


@given(RESIDUALS, MASKS, st.floats(0.1, 5), st.floats(0, 4), st.integers(1, 12))
def test_raising_gamma_never_adds_alarmed_time(x: np.ndarray, seed: int, gamma: float, more: float, n: int) -> None:
    evidence = mask_for(x, seed)
    low = collisions(x, evidence, gamma, n)
    for event in collisions(x, evidence, gamma + more, n):
        assert any(o.span.start <= event.span.start and event.span.stop <= o.span.stop for o in low)


@given(RESIDUALS, MASKS, st.floats(0.1, 9), st.integers(1, 12), st.integers(0, 30))
def test_a_run_shorter_than_n_never_alarms(x: np.ndarray, seed: int, gamma: float, n: int, merge: int) -> None:
    evidence = mask_for(x, seed)
    for event in collisions(x, evidence, gamma, n, merge):
        assert event.longest >= n
        assert event.detected >= event.span.start + n - 1
    starts, stops = run_bounds(evidence & (np.abs(x) > gamma))
    if starts.size == 0 or (stops - starts).max() < n:
        assert collisions(x, evidence, gamma, n, merge) == []


@given(RESIDUALS, st.floats(0.1, 9), st.integers(1, 12), st.integers(0, 199))
def test_nothing_counts_across_a_gap(x: np.ndarray, gamma: float, n: int, at: int) -> None:
    evidence = np.ones(x.size, dtype=bool)
    evidence[at % x.size] = False
    for event in collisions(x, evidence, gamma, n):
        assert not event.span.start <= at % x.size < event.span.stop


@given(RESIDUALS, MASKS, st.floats(0.5, 9), st.integers(1, 12))
def test_rule_events_are_near_and_are_no_collisions(x: np.ndarray, seed: int, gamma: float, n: int) -> None:
    evidence = mask_for(x, seed)
    hits = collisions(x, evidence, gamma, n)
    same, amplitude, persistence = rule_events(x, evidence, gamma, n, 0.8 * gamma, 0.5)
    assert same == hits
    for miss in amplitude + persistence:
        assert not any(miss.span.start < h.span.stop and h.span.start < miss.span.stop for h in hits)
    for miss in persistence:
        assert 0.5 * n <= miss.longest < n
        assert abs(miss.peak) > gamma
    for miss in amplitude:
        assert miss.longest < 0.5 * n
        assert abs(miss.peak) > 0.8 * gamma


@pytest.mark.parametrize(
    ("milliseconds", "period", "n"),
    [(25, 0.002, 13), (24, 0.002, 12), (24, 0.0019999997, 12), (25, 0.008, 4), (25, 1 / 30, 1), (0.1, 0.002, 1)],
)
def test_persistence_rounds_up(milliseconds: float, period: float, n: int) -> None:
    assert persistence_samples(milliseconds / 1e3, period) == n


@pytest.mark.parametrize(("period", "n"), [(0.001, 13), (0.002, 7), (0.008, 3), (0.01, 3), (1 / 30, 1)])
def test_a_causal_rule_waits_less_where_thresholds_are_automatic(period: float, n: int) -> None:
    """Half as long, three samples, but no longer than any other rule."""
    usual, _ = stated_persistence(DetectConfig(), period)
    assert stated_persistence(DetectConfig(causal=True, gamma_nm="auto"), period) == (n, None)
    assert stated_persistence(DetectConfig(gamma_nm="auto"), period) == (usual, 25.0)
    assert stated_persistence(DetectConfig(causal=True), period) == (usual, 25.0), "whoever states γ means usual n"
    stated = DetectConfig(causal=True, gamma_nm="auto", persistence_ms=25.0)
    assert stated_persistence(stated, period) == (usual, 25.0)
    assert stated_persistence(DetectConfig(causal=True, gamma_nm="auto", n=40), period) == (40, None)


@given(arrays(np.float64, st.integers(20, 200), elements=st.floats(-10, 10)), MASKS, st.integers(1, 12))
def test_the_sustained_level_is_the_threshold_at_which_alarms_stop(x: np.ndarray, seed: int, n: int) -> None:
    clean = mask_for(x, seed)
    level = sustained_level(NullEvidence(x, clean, 0.002), n)
    peaks = level[np.isfinite(level)]
    if peaks.size == 0:
        starts, stops = run_bounds(clean)
        assert starts.size == 0 or (stops - starts).max() < n, "a window fits and no level was given"
        return
    level = float(peaks.max())
    assert collisions(x, clean, level, n) == []
    if level > 1e-6:
        assert collisions(x, clean, level * (1 - 1e-9), n) != []
