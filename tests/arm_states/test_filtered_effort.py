"""Efforts behind a slow low-pass are told from any other error of model, friction or effort, and from contact."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from origins import log_source
from scipy.signal import lfilter

from collaudit.core.arm_states.filtered_effort import FilteredEffort, filtered_effort
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.numeric.arrays import Span

PERIOD_S = 0.004
TIME_S = np.arange(0.0, 40.0, PERIOD_S)
_PHASE = 2 * np.pi * np.outer(TIME_S, [0.19, 0.27])
POSITION = 0.5 * np.sin(_PHASE) + 0.2 * np.sin(1.7 * _PHASE + 1.0)
VELOCITY, ACCELERATION = (np.gradient(x, PERIOD_S, axis=0) for x in (POSITION, np.gradient(POSITION, PERIOD_S, axis=0)))


def gravity(q: np.ndarray) -> np.ndarray:
    return np.column_stack([9.0 * np.cos(q[:, 0]), 2.0 * np.sin(q[:, 1])])


def sliding(v: np.ndarray) -> np.ndarray:
    return np.asarray(np.tanh(50 * v) * (1.5 + np.exp(-np.abs(v) / 0.05)) + 1.2 * v)


def stiff(v: np.ndarray) -> np.ndarray:
    return np.asarray(1.8 * np.sign(v))


RIGID = gravity(POSITION) + ACCELERATION * [1.1, 0.3]
FRICTION = sliding(VELOCITY)


def behind(torque: np.ndarray, lag_s: float) -> np.ndarray:
    share = PERIOD_S / lag_s
    return np.asarray(lfilter([share], [1.0, share - 1.0], torque - torque[0], axis=0) + torque[0])


def found(
    effort: np.ndarray,
    position: np.ndarray = POSITION,
    velocity: np.ndarray = VELOCITY,
    rigid: np.ndarray = RIGID,
    law: Callable[[np.ndarray], np.ndarray] | None = None,
) -> FilteredEffort | None:
    noisy = effort + np.random.default_rng(2).normal(0, 0.1, effort.shape)
    n = TIME_S.size
    acceleration = np.gradient(velocity, PERIOD_S, axis=0)
    series = UniformSeries(
        TIME_S, PERIOD_S, ("a", "b"), position, velocity, acceleration, noisy, "Nm", None, (Span(0, n),),
        np.zeros(n, bool), np.zeros((n, 2), bool), 20.0, log_source(),
    )  # fmt: skip
    return filtered_effort(series, noisy, rigid, gravity, dict.fromkeys((0, 1), law or sliding))


@pytest.mark.parametrize("lag_s", [0.2, 1.0, 4.0])
def test_a_low_pass_is_told_with_its_time_constant(lag_s: float) -> None:
    one = found(behind(RIGID + FRICTION, lag_s))
    assert one is not None
    assert one.joints == (0, 1)
    assert one.lag_s == pytest.approx(lag_s, rel=0.2)
    assert one.left < 0.1


def test_friction_of_another_warmth_does_not_hide_it() -> None:
    assert found(behind(RIGID + 1.2 * FRICTION, 1.0)) is not None


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
    "a stuck effort": lambda rigid, friction: np.full_like(rigid, 3.0),
}


@pytest.mark.parametrize("name", OTHERS)
def test_nothing_else_is_taken_for_one(name: str) -> None:
    assert found(OTHERS[name](RIGID, FRICTION)) is None


def test_a_law_that_turns_with_the_noise_of_rest_is_no_filter() -> None:
    """Half the time at rest, where the velocity's noise turns the law's sign and the drive supplies no friction."""
    going = np.sign(np.sin(2 * np.pi * 0.2 * TIME_S)) * (np.sin(2 * np.pi * 0.4 * TIME_S) > 0)
    exact = np.column_stack([0.05 * going, 0.04 * going])
    position = np.cumsum(exact, axis=0) * PERIOD_S
    velocity = exact + np.random.default_rng(3).normal(0.0, 1e-5, exact.shape)
    effort = gravity(position) + 1.25 * stiff(exact)
    assert found(effort, position, velocity, gravity(position), stiff) is None
