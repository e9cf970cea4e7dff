"""Knocks shorter than the persistence are near misses by impulse; what a kernel does to a push is said."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.lib.stride_tricks import sliding_window_view

from collaudit.core.detection.detector_run import RATIOS, shortest_pushes
from collaudit.core.detection.events import _impulse_ratio, knock_width, knocks
from collaudit.core.detection.rule import rule_events
from collaudit.core.numeric.arrays import Span
from collaudit.core.numeric.kernel import identity
from collaudit.core.residual.detectors.direct import direct_kernel

T, N, GAMMA, SHARE = 0.002, 13, 4.0, 0.4
KERNEL = direct_kernel(20.0, False)
WIDTH = knock_width(N, KERNEL.settle_s, T)
TIME = T * np.arange(4000)


def smoothed(torque: np.ndarray, noise: float = 0.0) -> np.ndarray:
    rough = torque + np.random.default_rng(1).normal(0.0, noise, torque.size)
    return KERNEL.apply(rough[:, None], [Span(0, torque.size)], T)[:, 0]


def push(at: float, seconds: float, height: float) -> np.ndarray:
    return height * ((at - 1e-9 <= TIME) & (at + seconds - 1e-9 > TIME))


def found(residual: np.ndarray, gamma: float = GAMMA) -> list[float]:
    """Ratios of the knocks in a residual."""
    return [ratio for _, ratio in knocks(residual, np.isfinite(residual), gamma, N, WIDTH, SHARE)]


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("milliseconds", [10, 12])
def test_a_hard_knock_has_its_impulse(milliseconds: int, sign: int) -> None:
    """Twice gamma for 10 ms: neither above 0.8 gamma for n samples nor above gamma for half of them."""
    residual = smoothed(sign * push(4.0, 1e-3 * milliseconds, 2.0 * GAMMA), noise=0.5)
    assert not any(rule_events(residual, np.isfinite(residual), GAMMA, N, 0.8, 0.5))
    ((event, ratio),) = knocks(residual, np.isfinite(residual), GAMMA, N, WIDTH, SHARE)
    assert ratio == pytest.approx(2.0 * milliseconds / (1e3 * N * T), rel=0.15)
    assert TIME[event.span.start] == pytest.approx(4.0, abs=0.02)
    assert event.peak * sign > 0


NO_KNOCKS = {
    "noise": np.zeros(TIME.size),
    "a torque that comes and stays": push(4.0, 10.0, 0.95 * GAMMA),
    "a slow bump": 0.9 * GAMMA * np.exp(-0.5 * ((TIME - 4.0) / 0.08) ** 2),
    "ripple": 0.6 * GAMMA * np.sin(2 * np.pi * 25.0 * TIME),
    "a knock too weak": push(4.0, 0.012, 0.6 * GAMMA),
}


@pytest.mark.parametrize("case", NO_KNOCKS)
def test_what_is_no_knock(case: str) -> None:
    assert not found(smoothed(NO_KNOCKS[case], noise=0.5))


def test_scale_changes_nothing_and_unjudged_samples_count_for_nothing() -> None:
    residual = smoothed(push(4.0, 0.012, 2.0 * GAMMA), noise=0.5)
    assert found(3.0 * residual, 3.0 * GAMMA) == pytest.approx(found(residual))
    evidence = np.ones(residual.size, dtype=bool)
    evidence[2003] = False
    assert not knocks(residual, evidence, GAMMA, N, WIDTH, SHARE)
    assert not knocks(residual[:20], evidence[:20], GAMMA, N, WIDTH, SHARE)


def test_one_sample_below_does_not_end_a_near_miss_by_amplitude() -> None:
    residual = np.zeros(200)
    residual[50:64] = 0.9 * GAMMA
    residual[57] = 0.7 * GAMMA
    evidence = np.ones(residual.size, dtype=bool)
    _, (low,), _ = rule_events(residual, evidence, GAMMA, N, 0.8, 0.5)
    assert len(low.span) == 14
    gap = evidence.copy()
    gap[57] = False
    assert not any(rule_events(residual, gap, GAMMA, N, 0.8, 0.5)), "a sample that is not judged ends it"
    residual[57:59] = 0.7 * GAMMA
    assert not any(rule_events(residual, evidence, GAMMA, N, 0.8, 0.5))
    above = 1.2 * residual
    assert not rule_events(above, evidence, GAMMA, N, 0.8, 0.5)[0], "the rule itself tolerates nothing"


def test_what_a_kernel_does_to_the_length_of_a_push_is_said() -> None:
    """An 18 ms push of four thresholds alarms although the rule asks for 26 ms; one just above needs longer."""
    exact = shortest_pushes(identity(False), N, T)
    assert [p.duration_s for p in exact] == pytest.approx([N * T] * 3)
    stretched = {p.ratio: p.duration_s for p in shortest_pushes(KERNEL, N, T)}
    assert stretched[4.0] < N * T < stretched[1.3]
    for ratio, seconds in stretched.items():
        for length, alarms in ((seconds, True), (seconds - T, False)):
            residual = smoothed(push(4.0, length, ratio * GAMMA))
            assert bool(rule_events(residual, np.isfinite(residual), GAMMA, N, 0.8, 0.5)[0]) is alarms


def test_the_shortest_push_is_that_of_trying_every_length() -> None:
    for kernel in (KERNEL, direct_kernel(3.0, True), direct_kernel(60.0, False), identity(True)):
        for n in (1, 2, 13, 70):
            around = max(16, math.ceil(4.0 * kernel.settle_s / T))
            length = np.arange(1, n + around + 1)
            pushes = np.zeros((2 * around + length.size, length.size))
            pushes[around:-around] = np.arange(length.size)[:, None] < length
            seen = kernel.apply(pushes, [Span(0, len(pushes))], T)
            expected = []
            for ratio in RATIOS:
                runs = sliding_window_view(seen > 1.0 / ratio, n, axis=0).all(axis=-1).any(axis=0)
                expected += [(ratio, float(length[runs.argmax()]) * T)] if runs.any() else []
            assert [(p.ratio, p.duration_s) for p in shortest_pushes(kernel, n, T)] == expected


@pytest.mark.parametrize("varies", [False, True])
def test_the_impulse_is_that_of_each_window(varies: bool) -> None:
    """With samples that do not count and thresholds that are none."""
    rng = np.random.default_rng(8)
    x, evidence = rng.normal(size=16_000 + 900), np.ones(16_000 + 900, dtype=bool)
    evidence[[40, 16_000 - 3, 16_000 + 700]], x[9000] = False, np.nan
    gamma = rng.uniform(1.0, 3.0, x.size)
    gamma[3000], gamma[5000] = np.nan, 0.0
    level = gamma if varies else GAMMA
    ratio = _impulse_ratio(x, evidence, level, N, WIDTH)
    usable = sliding_window_view(evidence & np.isfinite(x), WIDTH + 2 * N).all(axis=1)
    for k in (*range(120), *range(16_000 - 120, 16_000 + 60), *range(2900, 3000), *range(8900, 9020)):
        before, inside, after = x[k : k + N], x[k + N : k + N + WIDTH], x[k + N + WIDTH :][:N]
        sign, middle = np.sign(inside.sum()), 0.5 * (before.mean() + after.mean())
        higher = max(sign * before.mean(), sign * after.mean())
        size = abs(inside.sum())
        beyond = min(size - WIDTH * max(sign * middle, 0.0), 2.0 * (size - WIDTH * max(higher, 0.0)))
        here = float(gamma[k + N]) if varies else GAMMA
        expected = max(beyond, 0.0) / (N * here) if usable[k] and here > 0 else 0.0
        assert ratio[k + N] == pytest.approx(expected, abs=1e-9), k
