"""How far efforts are smoothed is told whatever smooths them, and from no other error of model, friction or effort."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from origins import log_source
from scipy.signal import butter, lfilter, sosfiltfilt
from scipy.special import erf

from collaudit.core.data.joint_log import UniformSeries
from collaudit.core.numeric.arrays import Span
from collaudit.core.prepare.effort_smoothing import _WINDOWS_S, Smoothing, _Explained, effort_smoothing
from collaudit.core.torque_table.log_samples import TorqueTable

PERIOD_S = 0.004
TIME_S = np.arange(0.0, 40.0, PERIOD_S)


def moves(seed: int) -> np.ndarray:
    """(n,) angle, rad, of moves from rest to rest, of 0.6 to 2 s each, with a pause after each: as arms work."""
    rng = np.random.default_rng(seed)
    knots, at = [(0.0, 0.0)], 0.0
    while at < TIME_S[-1]:
        at += rng.uniform(0.6, 2.0)
        knots += [(at, rng.uniform(-1.2, 1.2))]
        at += 0.2
        knots += [(at, knots[-1][1])]
    where = np.searchsorted([t for t, _ in knots], TIME_S, side="right") - 1
    start, stop = (np.array(knots)[np.clip(where + k, 0, len(knots) - 1)] for k in (0, 1))
    share = np.clip((TIME_S - start[:, 0]) / np.maximum(stop[:, 0] - start[:, 0], 1e-9), 0, 1)
    return np.asarray(start[:, 1] + (stop - start)[:, 1] * share**3 * (10 - 15 * share + 6 * share**2))


POSITION = np.column_stack([moves(1), moves(2)])


def derivatives(position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    velocity = np.gradient(position, PERIOD_S, axis=0)
    return velocity, np.gradient(velocity, PERIOD_S, axis=0)


def rigid_of(position: np.ndarray, inertia: tuple[float, float] = (1.1, 0.3)) -> np.ndarray:
    gravity = np.column_stack([9.0 * np.cos(position[:, 0]), 2.0 * np.sin(position[:, 1])])
    return gravity + derivatives(position)[1] * inertia


def sliding(v: np.ndarray) -> np.ndarray:
    return np.asarray(np.tanh(50 * v) * (1.5 + np.exp(-np.abs(v) / 0.05)) + 1.2 * v)


RIGID = rigid_of(POSITION)
FRICTION = sliding(derivatives(POSITION)[0])


def told(
    effort: np.ndarray, noise_nm: float = 0.1, position: np.ndarray = POSITION, rigid: np.ndarray = RIGID
) -> dict[str, Smoothing]:
    noisy = effort + np.random.default_rng(2).normal(0, noise_nm, effort.shape)
    n, velocity, acceleration = TIME_S.size, *derivatives(position)
    series = UniformSeries(
        TIME_S, PERIOD_S, ("a", "b"), position, velocity, acceleration, noisy, "Nm", None, (Span(0, n),),
        np.zeros(n, bool), np.zeros((n, 2), bool), 20.0, log_source(),
    )  # fmt: skip
    return effort_smoothing(TorqueTable.of(series, rigid), dict.fromkeys(("a", "b"), sliding))


def behind(torque: np.ndarray, lag_s: float) -> np.ndarray:
    share = PERIOD_S / lag_s
    return np.asarray(lfilter([share], [1.0, share - 1.0], torque - torque[0], axis=0) + torque[0])


def mean(torque: np.ndarray, seconds: float) -> np.ndarray:
    count = round(seconds / PERIOD_S)
    sums = np.cumsum(np.r_[np.repeat(torque[:1], count, axis=0), torque], axis=0)
    return np.asarray((sums[count:] - sums[:-count]) / count)


def held(torque: np.ndarray, seconds: float) -> np.ndarray:
    count = round(seconds / PERIOD_S)
    return torque[np.arange(len(torque)) // count * count]


def both_ways(torque: np.ndarray, cut_hz: float) -> np.ndarray:
    return np.asarray(sosfiltfilt(butter(2, 2 * cut_hz * PERIOD_S, output="sos"), torque, axis=0))


#: What smooths, and the standard deviation of its pulse response, s: of a first-order lag the time constant, of a mean
#: and of values that are held 1/sqrt(12) of the length. A Butterworth filter's is 0; of two passes it is that of a
#: Gaussian window which is as much down at half of the corner frequency, about.
FILTERS: dict[str, tuple[Callable[[np.ndarray], np.ndarray], float]] = {
    "lag of 0.1 s": (lambda x: behind(x, 0.1), 0.1),
    "lag of 0.3 s": (lambda x: behind(x, 0.3), 0.3),
    "mean over 0.3 s": (lambda x: mean(x, 0.3), 0.087),
    "mean over 1 s": (lambda x: mean(x, 1.0), 0.29),
    "held for 0.4 s": (lambda x: held(x, 0.4), 0.115),
    "zero-phase 1 Hz": (lambda x: both_ways(x, 1.0), 0.13),
}


@pytest.mark.parametrize("name", [name for name in FILTERS if not name.startswith("held")])
def test_a_push_keeps_no_more_height_than_the_window_says(name: str) -> None:
    push = np.zeros_like(RIGID)
    push[(TIME_S >= 20.0) & (TIME_S < 20.2)] = 1.0
    filtered, _ = FILTERS[name]
    kept = float(filtered(push).max())
    for one in told(filtered(RIGID + FRICTION)).values():
        assert 0.45 * kept < erf(0.1 / (np.sqrt(2.0) * one.high_s)) < 1.1 * kept


@pytest.mark.parametrize("name", FILTERS)
def test_what_smooths_is_told_without_knowing_it(name: str) -> None:
    filtered, window_s = FILTERS[name]
    for one in told(filtered(RIGID + FRICTION)).values():
        assert one.shown or name.startswith("held")  # which is no filter: what it leaves changes from move to move
        assert one.low_s / 1.6 < window_s < 1.6 * one.high_s
        assert one.high_s < (3.5 if name.startswith("held") else 3.0) * window_s


def test_a_lag_beyond_the_windows_is_not_bounded() -> None:
    for one in told(behind(RIGID + FRICTION, 4.0)).values():
        assert one.shown
        assert np.isinf(one.high_s)


def test_one_joint_that_is_smoothed_alone_is_told() -> None:
    effort = RIGID + FRICTION
    effort[:, 1] = behind(effort, 0.3)[:, 1]
    found = told(effort)
    assert found["b"].low_s > found["a"].high_s


def pushed(torque: np.ndarray, start_s: float, stop_s: float, size_nm: float) -> np.ndarray:
    out = torque.copy()
    out[(start_s <= TIME_S) & (stop_s > TIME_S), 0] += size_nm
    return out


OTHERS: dict[str, Callable[[np.ndarray, np.ndarray], np.ndarray]] = {
    "nothing": lambda rigid, friction: rigid + friction,
    "a filter of the drive": lambda rigid, friction: behind(rigid + friction, 0.02),
    "a delay": lambda rigid, friction: np.roll(rigid + friction, 12, axis=0),
    "a push": lambda rigid, friction: pushed(rigid + friction, 20.0, 20.3, 12.0),
    "a clamp": lambda rigid, friction: pushed(rigid + friction, 20.0, 26.0, 6.0),
    "half the friction": lambda rigid, friction: rigid + 0.5 * friction,
    "twice the friction": lambda rigid, friction: rigid + 2.0 * friction,
    "no friction": lambda rigid, friction: rigid,
    "friction that warms up": lambda rigid, friction: rigid + friction * (1.6 - 0.02 * TIME_S[:, None]),
    "another payload": lambda rigid, friction: 1.4 * rigid + friction,
    "another gain": lambda rigid, friction: 0.6 * (rigid + friction),
    "an inverted effort": lambda rigid, friction: -(rigid + friction),
    "an offset": lambda rigid, friction: rigid + friction + 3.0,
    "a spring": lambda rigid, friction: rigid + friction - 4.0 * POSITION,
}


@pytest.mark.parametrize("name", OTHERS)
def test_nothing_else_is_taken_for_smoothing(name: str) -> None:
    for one in told(OTHERS[name](RIGID, FRICTION)).values():
        assert not one.shown
        assert one.high_s < 0.1 or name == "a spring"  # a model that lacks so much bounds less


def test_a_noisy_model_torque_is_no_smoothing() -> None:
    """Acceleration from a coarse encoder: a window calms it, and so explains more of an effort that passed none."""
    noise = np.random.default_rng(5).normal(0.0, 0.3 * RIGID.std(axis=0), RIGID.shape)
    for one in told(RIGID + FRICTION, rigid=RIGID + noise).values():
        assert not one.shown and one.high_s < 0.2


def test_friction_that_turns_gradually_is_no_smoothing_where_nothing_moves_one_way() -> None:
    """Swings of a quarter of a second each way: bounded, and never said to be smoothed."""
    rate_hz = 1.8 + 1.2 * np.sin(0.4 * TIME_S)[:, None] ** 2 + [0.0, 0.3]
    swing = 0.01 * np.sin(2 * np.pi * np.cumsum(rate_hz, axis=0) * PERIOD_S)
    velocity, _ = derivatives(swing)
    rigid = rigid_of(swing, inertia=(0.01, 0.01))  # as wrists have it: friction is nearly all of their torque
    for one in told(rigid + mean(sliding(velocity), 0.2), position=swing, rigid=rigid).values():
        assert one.best_s > 0.02 and not one.shown
        assert np.isfinite(one.high_s)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("scale", [1.0, 1e-9])
def test_an_effort_that_is_explained_exactly_is_not_smoothed(scale: float) -> None:
    for effort in (RIGID + FRICTION, RIGID):
        assert all(one.high_s < 0.05 for one in told(scale * effort, 0.0).values())


def test_efforts_that_never_change_tell_nothing() -> None:
    assert told(np.full_like(RIGID, 3.0), 0.0) == {}


def test_what_differs_between_windows_by_chance_is_that_of_the_samples() -> None:
    """Sums of r d over blocks, r what the best window leaves and r + d what another does, from residuals themselves."""
    rng = np.random.default_rng(7)
    count, shifts = 400, 5
    effort, block = rng.normal(size=(count, shifts)), np.arange(count) // 20
    windows = [rng.normal(size=(count, 2)) + effort[:, [1]] for _ in _WINDOWS_S]
    delays = rng.integers(0, shifts, len(windows))
    left = []
    for window, delay in zip(windows, delays, strict=True):
        columns = np.column_stack([np.ones(count), window])
        left.append(effort[:, delay] - columns @ np.linalg.lstsq(columns, effort[:, delay], rcond=None)[0])
    found = _Explained.of(effort, windows, block)
    expected = [np.bincount(block, left[3] * (one - left[3])) for one in left]
    np.testing.assert_allclose(found.chance(3, delays), expected, atol=1e-9)
    np.testing.assert_allclose(found.totals[np.arange(len(left)), delays], [one @ one for one in left])


def test_the_bound_holds_under_noise_that_hides_the_smoothing() -> None:
    """Without what chance makes of the windows the best one alone would be its own bound: a third of them holds."""
    lag_s, smoothed = 0.05, behind(RIGID + FRICTION, 0.05)
    noisy = (smoothed + np.random.default_rng(100 + seed).normal(0.0, 2.0, RIGID.shape) for seed in range(10))
    found = [one for effort in noisy for one in told(effort, 0.0).values()]
    assert len(found) == 20
    assert sum(one.low_s <= lag_s <= one.high_s for one in found) >= 17, "of 20 intervals at 95 %"
