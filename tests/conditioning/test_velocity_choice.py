"""Which velocity is believed: per joint, by what most samples say, and always the one that is asked for."""

from __future__ import annotations

import numpy as np
import pytest
from synthetic import PERIOD, make_log

from collaudit.core.conditioning.conditioning import condition
from collaudit.core.config.schema import ConditioningConfig
from collaudit.core.errors import NotJudgedError

T = PERIOD * np.arange(10_000)
Q = np.column_stack([np.sin(2 * T), 0.5 * np.cos(3 * T)])
V = np.column_stack([2 * np.cos(2 * T), -1.5 * np.sin(3 * T)])
NAMES = ("a", "b")


def spoilt(fault: str) -> np.ndarray:
    velocity = V + 1e-9
    if fault == "degrees":
        velocity[:, 0] = np.rad2deg(velocity[:, 0])
    elif fault == "zero":
        velocity[:, 0] = 0.0
    elif fault == "zero at first":
        velocity[:50, 0] = 0.0
    elif fault == "flipped":
        velocity[:, 0] *= -1
    elif fault == "spikes":
        velocity[100:400:100, 0] = 1e4
    return velocity


@pytest.mark.parametrize("fault", ["degrees", "zero", "zero at first", "flipped", "spikes"])
def test_the_logged_velocity_is_used_where_it_is_asked_for(fault: str) -> None:
    logged = spoilt(fault)
    log = make_log(T, Q, logged, Q, NAMES)
    kept = condition(log, ConditioningConfig(velocity="logged"))
    np.testing.assert_array_equal(kept.raw_velocity_rad_s, logged)
    (said,) = [f for f in kept.findings if f.code.startswith("log-velocity")]
    assert (said.code, said.severity, said.joint) == ("log-velocity", "warning", "a")
    assert "used all the same, as [conditioning] velocity asks" in said.text
    assert "derived" not in said.text.split("It was")[0].replace("derivative", "")
    auto = condition(log, ConditioningConfig())
    assert auto.raw_velocity_rad_s is not None
    assert np.abs(auto.raw_velocity_rad_s - V)[5:-5].max() < 1e-3
    np.testing.assert_array_equal(auto.raw_velocity_rad_s[:, 1], logged[:, 1])


def test_a_velocity_asked_for_and_not_there_is_refused() -> None:
    with pytest.raises(NotJudgedError, match="asks for the logged velocity"):
        condition(make_log(T, Q, None, Q, NAMES), ConditioningConfig(velocity="logged"))
    half = V.copy()
    half[:, 1] = np.nan
    series = condition(make_log(T, Q, half, Q, NAMES), ConditioningConfig(velocity="logged"))
    assert np.isnan(series.velocity_rad_s[:, 1]).all()
    assert any("the joint is not judged" in f.text for f in series.findings)


def test_few_wrong_samples_do_not_cost_the_others() -> None:
    series = condition(make_log(T, Q, spoilt("spikes"), Q, NAMES), ConditioningConfig())
    assert series.raw_velocity_rad_s is not None
    as_logged = series.raw_velocity_rad_s[:, 0] == spoilt("spikes")[:, 0]
    assert as_logged.mean() > 0.9
    (said,) = [f for f in series.findings if f.code.startswith("log-velocity")]
    assert said.code == "log-velocity"
    assert "samples; there it was derived" in said.text


@pytest.mark.parametrize("logged", ["zero", "noise"])
def test_a_joint_that_dithers_is_left_alone(logged: str) -> None:
    rng = np.random.default_rng(5)
    step = np.deg2rad(0.0075)
    q = Q.copy()
    q[:, 1] = 0.3 + step * rng.integers(0, 2, T.size).repeat(25)[: T.size]
    v = V.copy()
    v[:, 1] = 0.0 if logged == "zero" else 0.05 * rng.standard_normal(T.size)
    series = condition(make_log(T, q, v, Q, NAMES), ConditioningConfig())
    assert not [f for f in series.findings if f.code.startswith("log-velocity")]
    assert series.raw_velocity_rad_s is not None
    np.testing.assert_array_equal(series.raw_velocity_rad_s[:, 1], v[:, 1])


def test_a_velocity_in_counts_is_zero_where_it_turns_and_not_stuck() -> None:
    count = 0.05
    logged = count * np.trunc(V / count)
    series = condition(make_log(T, Q, logged, Q, NAMES), ConditioningConfig())
    assert not [f for f in series.findings if f.code.startswith("log-velocity")]
    logged[2000:2010, 0] = 0.0  # at up to 2 rad/s
    series = condition(make_log(T, Q, logged, Q, NAMES), ConditioningConfig())
    (said,) = [f for f in series.findings if f.code == "log-velocity"]
    assert "is exactly zero in 10 samples" in said.text


def test_the_numbers_told_are_medians() -> None:
    logged = V.copy()
    logged[:, 0] *= 0.5
    logged[:1500, 0] *= -20.0
    series = condition(make_log(T, Q, logged, Q, NAMES), ConditioningConfig())
    (said,) = [f for f in series.findings if f.code == "log-velocity"]
    assert said.text.startswith("The logged velocity of joint 'a' is 0.5 times the derivative of its position, ")
