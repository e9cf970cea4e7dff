"""Gain and sign of the effort against the model's torque."""

from __future__ import annotations

import numpy as np
import pytest
from synthetic import PERIOD, make_log

from collaudit.core.conditioning.conditioning import condition
from collaudit.core.config.schema import ConditioningConfig
from collaudit.core.prepare.effort_gain import effort_gain_findings, effort_gains


def run(gain: float, load: float, seed: int = 0):  # type: ignore[no-untyped-def]
    """A joint under gravity with friction, drift and noise; effort = gain x torque."""
    rng = np.random.default_rng(seed)
    t = PERIOD * np.arange(20000)
    q = 0.8 * np.sin(0.9 * t) + 0.3 * np.sin(2.3 * t)
    v = 0.72 * np.cos(0.9 * t) + 0.69 * np.cos(2.3 * t)
    gravity = load * np.cos(q + 0.5)
    drift = 0.3 * np.sin(0.1 * t)
    effort = gain * (gravity + 5 * np.sign(v) + 2 * v) + drift + rng.normal(0, 0.5, t.size)
    log = make_log(t, q[:, None], v[:, None], effort[:, None])
    series = condition(log, ConditioningConfig())
    gains = effort_gains(series, gravity[:, None])
    return gains, effort_gain_findings(gains, ("joint1",), "Nm")


@pytest.mark.parametrize("gain", [1.0, 0.8, 1.3])
def test_a_torque_passes(gain: float) -> None:
    gains, findings = run(gain, 20.0)
    assert gains[0].gain == pytest.approx(gain, rel=0.03)
    assert findings == []


def test_an_inverted_effort_is_noticed_with_its_remedy() -> None:
    gains, findings = run(-1.0, 20.0)
    assert gains[0].inverted
    assert [f.code for f in findings] == ["effort-sign-inverted"]
    assert findings[0].severity == "error"
    assert 'effort_sign = { "joint1" = -1 }' in findings[0].text


def test_a_current_is_noticed_by_its_gain() -> None:
    _, findings = run(0.1, 20.0)
    assert [f.code for f in findings] == ["effort-gain"]


def test_an_unloaded_joint_is_undecided_not_guessed() -> None:
    for seed in range(10):
        gains, findings = run(1.0, 0.01, seed)
        assert not gains[0].inverted
        assert [f.code for f in findings] == ["effort-sign-unknown"]


def test_the_interval_covers_the_gain() -> None:
    hits = sum(g.ci95[0] <= 1.0 <= g.ci95[1] for seed in range(20) for g in run(1.0, 10.0, seed)[0])
    assert hits >= 15
