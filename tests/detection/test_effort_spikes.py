"""Alarms that a single sample of the effort makes are said to be that; those of pushes are not."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from collaudit.core.data.audit_result import Collision
from collaudit.core.detection.detection_findings import spike_findings, spikes

N, PERIOD_S = 5_000, 0.004
SPIKE, PUSH, STEP = 1_000, slice(2_000, 2_050), 3_000


def effort() -> np.ndarray:
    """(n,) slow motion, noise of 0.1, a spike of 30, a push of 8 for 0.2 s with sharp edges, a step of 5."""
    time_s = np.arange(N) * PERIOD_S
    x = 20 * np.sin(0.7 * time_s) + 0.1 * np.random.default_rng(1).standard_normal(N)
    x[SPIKE] -= 30.0
    x[PUSH] += 8.0
    x[STEP:] += 5.0
    return x


def series(x: np.ndarray, period_s: float = PERIOD_S) -> Any:
    time_s = np.arange(N) * period_s
    return SimpleNamespace(effort=x[:, None], time_s=time_s, period_s=period_s, joint_names=("elbow",))


def alarm(row: int, samples: int = 12, period_s: float = PERIOD_S) -> Collision:
    onset_s = (row - samples // 2) * period_s
    return Collision("elbow", onset_s, onset_s + 0.03, samples * period_s, 5.0, 2.0, "free")


def test_a_spike_is_a_spike_and_an_edge_is_none() -> None:
    found = spikes(effort())
    assert np.flatnonzero(found).tolist() == [SPIKE]
    assert found[SPIKE] == pytest.approx(30.0, abs=0.5)


def test_of_noise_alone_nothing_sticks_out() -> None:
    """A million samples: twelve times the usual are eight standard deviations."""
    assert not spikes(np.random.default_rng(2).standard_normal(1_000_000)).any()


def test_the_alarms_around_it_are_counted() -> None:
    alarms = [alarm(SPIKE), alarm(2_025, 60), alarm(STEP)]
    (found,) = spike_findings(series(effort()), alarms)
    assert (found.code, found.effect, found.joint) == ("effort-spikes", "doubts-alarms", "elbow")
    assert found.text.startswith("1 of 3 alarms of joint 'elbow'")
    assert found.start_s == alarms[0].onset_s
    assert spike_findings(series(effort()), alarms[1:]) == []
    assert spike_findings(series(effort()), [replace(alarms[0], gamma_nm=31.0)]) == [], "too low for the alarm"
    assert spike_findings(series(effort()), [replace(alarms[0], peak_nm=-31.0)]) == [], "a push is higher than it"


def test_slow_logs_and_missing_values_say_nothing() -> None:
    """A push of 30 ms is one sample at 30 Hz."""
    assert spike_findings(series(effort(), 1 / 30), [alarm(SPIKE, period_s=1 / 30)]) == []
    missing = effort()
    missing[SPIKE - 1] = np.nan
    assert spike_findings(series(missing), [alarm(SPIKE)]) == []
    assert spike_findings(SimpleNamespace(effort=None, period_s=PERIOD_S), [alarm(SPIKE)]) == []
