"""Rows cut out of a log whose stamps were closed up: what the joints cannot have done in a step is a break."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from synthetic import PERIOD, make_log

from collaudit.core.conditioning.conditioning import condition
from collaudit.core.conditioning.position_jumps import missing_rows
from collaudit.core.config.schema import ConditioningConfig, DetectConfig
from collaudit.core.data.joint_log import JointLog
from collaudit.core.numeric.arrays import Span


def moving(count: int = 6000, noise: float = 1e-5) -> JointLog:
    t = PERIOD * np.arange(count)
    phase = np.array([0.0, 1.0])
    rng = np.random.default_rng(2)
    q = 0.6 * np.sin(0.8 * t[:, None] + phase) + rng.normal(0, noise, (count, 2))
    v = 0.48 * np.cos(0.8 * t[:, None] + phase)
    return make_log(t, q, v, rng.normal(0, 0.1, (count, 2)), ["a", "b"])


def cut(log: JointLog, start: int, stop: int) -> JointLog:
    keep = np.r_[0:start, stop : log.time_s.size]
    assert log.velocity_rad_s is not None and log.effort is not None
    parts = (log.position_rad[keep], log.velocity_rad_s[keep], log.effort[keep])
    return make_log(log.time_s[: keep.size], *parts, ["a", "b"])


def found(log: JointLog) -> list[int]:
    return missing_rows(log, log.position_rad, {}, DetectConfig())[0].tolist()


@pytest.mark.parametrize("lost", [13, 30, 125, 400])
@pytest.mark.parametrize("velocity", [True, False])
def test_rows_that_were_cut_out_are_a_break_whose_length_is_said(lost: int, velocity: bool) -> None:
    log = cut(moving(), 3000, 3000 + lost)
    log = log if velocity else replace(log, velocity_rad_s=None)
    series = condition(log, ConditioningConfig())
    (said,) = [f for f in series.findings if f.code == "not-measured"]
    assert said.forbids_pass and said.start_s == pytest.approx(3000 * PERIOD)
    stated = float(said.text.partition("as in ")[2].partition(" s ")[0])
    assert stated == pytest.approx(lost * PERIOD, rel=0.35)
    assert series.segments[0] == Span(0, 3000)


def test_a_log_without_cuts_has_none() -> None:
    assert found(moving()) == []
    assert found(cut(moving(), 3000, 3006)) == [], "too short to hide a contact"


def test_what_joints_do_is_no_cut() -> None:
    """A hard stop, a fast start, an encoder's steps, samples that are held, stamps that scatter."""
    t = PERIOD * np.arange(6000)
    v = 0.8 * ((t > 2) & (t < 4)) - 1.2 * ((t > 6) & (t < 7))
    stops = np.stack([np.cumsum(v), np.cumsum(0.5 * v)], axis=1) * PERIOD
    whole = moving()
    held = whole.position_rad[10 * (np.arange(6000) // 10)]
    coarse = 1e-3 * np.round(whole.position_rad / 1e-3)
    for q in (stops, held, coarse):
        assert found(replace(whole, position_rad=q, velocity_rad_s=None)) == []
    late = t + np.random.default_rng(0).exponential(0.3 * PERIOD, t.size)
    assert found(replace(whole, time_s=np.maximum.accumulate(late))) == []


@pytest.mark.parametrize("velocity", [True, False])
def test_an_encoder_between_two_counts_loses_no_rows(velocity: bool) -> None:
    """A joint of 4,096 counts a turn that stands for most of the log shows the next count now and then."""
    t, count = PERIOD * np.arange(6000), 2.0 * np.pi / 4096.0
    rate = np.outer(np.where((t > 2) & (t < 2.6), 0.05, 0.0), [1.0, -1.0])
    q = count * np.round((0.3 * count + PERIOD * np.cumsum(rate, axis=0)) / count)
    q[[200, 900, 2500, 2501, 4000], 0] += count
    log = make_log(t, q, rate, np.zeros((6000, 2)), ["a", "b"])
    assert found(log if velocity else replace(log, velocity_rad_s=None)) == []
    twice = q.copy()
    twice[3000:] += 20 * count
    assert found(replace(log, position_rad=twice, velocity_rad_s=rate if velocity else None)) == [3000]
