"""Samples of one stamp that contradict each other forbid a judgement; coarse stamps do not contradict."""

from __future__ import annotations

import numpy as np
import pytest

from collaudit.core.findings import Finding
from collaudit.core.logs.signals.stamp_conflicts import contradictions


def found(stamps: np.ndarray, effort: np.ndarray) -> list[Finding]:
    return contradictions(stamps, ("joint1",), np.zeros((stamps.size, 1)), effort[:, None])


def course(count: int = 2000) -> np.ndarray:
    return 10 * np.sin(0.01 * np.arange(count)) + np.random.default_rng(1).normal(0, 0.05, count)


@pytest.mark.parametrize("calm_first", [True, False])
def test_two_publishers_with_and_without_a_push(calm_first: bool) -> None:
    calm = course()
    pushed = calm.copy()
    pushed[900:950] += 12.0
    pair = (calm, pushed) if calm_first else (pushed, calm)
    (one,) = found(np.repeat(0.002 * np.arange(2000), 2), np.stack(pair, axis=1).ravel())
    assert (one.code, one.effect, one.joint) == ("log-publishers-conflict", "not-judged-log", "joint1")


@pytest.mark.parametrize("step", [0.01, 0.1])
def test_coarse_stamps_and_rows_written_twice_are_no_contradiction(step: float) -> None:
    effort = course()
    effort[900:950] += 12.0
    time_s = 0.002 * np.arange(2000)
    assert not found(np.floor(time_s / step) * step, effort)
    assert not found(np.repeat(time_s, 2), np.repeat(effort, 2))


@pytest.mark.parametrize("calm_first", [True, False])
@pytest.mark.parametrize("every", [1, 3, 8])
def test_two_publishers_with_clocks_of_their_own(every: int, calm_first: bool) -> None:
    calm = course()
    pushed = calm.copy()
    pushed[900:980] += 12.0
    pair = (calm, pushed) if calm_first else (pushed, calm)
    time_s = 0.002 * np.arange(2000)
    stamps = np.concatenate([time_s, time_s[::every] + 0.0007])
    order = np.argsort(stamps)
    effort = np.concatenate([pair[0], pair[1][::every]])
    (one,) = found(stamps[order], effort[order])
    assert one.code == "log-publishers-conflict"


@pytest.mark.parametrize("known", [0, 1], ids=["no value", "one value"])
def test_a_channel_that_is_not_known_contradicts_nothing(known: int) -> None:
    effort = np.full(400, np.nan)
    effort[:known] = 1.0
    assert not found(np.repeat(0.002 * np.arange(200), 2), effort)


def test_spikes_jumps_and_chatter_are_no_contradiction() -> None:
    rng = np.random.default_rng(4)
    time_s = 0.002 * np.arange(2000)
    spikes = course()
    spikes[rng.choice(2000, 40, replace=False)] += 12.0
    jumps = course() + 6.0 * np.sign(np.sin(np.arange(2000) / 20))
    chatter = course() + 0.4 * (-1.0) ** np.arange(2000)
    hard = course() + 15.0 * np.exp(-np.arange(2000) % 300 / 10) * np.cos(np.arange(2000) % 300 / 2)
    for effort in (spikes, jumps, chatter, hard):
        assert not found(time_s, effort)
