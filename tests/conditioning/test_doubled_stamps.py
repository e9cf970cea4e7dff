"""Samples of one stamp that contradict each other count as missing, whichever stands first; others are said."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from synthetic import PERIOD, make_log

from collaudit.core.conditioning.conditioning import condition
from collaudit.core.conditioning.stamp_order import without_contradictions
from collaudit.core.config.schema import ConditioningConfig
from collaudit.core.data.joint_log import JointLog

PUSH = slice(1500, 1530)


def twice(push: float, calm_first: bool, every: int = 1) -> JointLog:
    """Samples of which every ``every``-th stands twice; one course holds a push, each has noise of its own."""
    t = PERIOD * np.arange(4000)
    q, v = 0.5 * np.sin(t)[:, None], 0.5 * np.cos(t)[:, None]
    rng = np.random.default_rng(3)
    courses = [5.0 * np.sin(t) + rng.normal(0, 0.3, t.size) for _ in range(2)]
    courses[1 if calm_first else 0][PUSH] += push
    again = np.flatnonzero(np.arange(t.size) % every == 0)
    order = np.argsort(np.concatenate([np.arange(t.size), again + 0.5]), kind="stable")
    rows = np.concatenate([np.arange(t.size), again])[order]
    effort = np.concatenate([courses[0], courses[1][again]])[order]
    return make_log(t[rows], q[rows], v[rows], effort[:, None])


@pytest.mark.parametrize("calm_first", [True, False])
@pytest.mark.parametrize(("push", "every"), [(12.0, 1), (12.0, 3), (3.0, 1), (1.5, 1)])
def test_neither_counts_where_they_contradict_each_other(push: float, every: int, calm_first: bool) -> None:
    found = without_contradictions(twice(push, calm_first, every))
    (finding,) = found.findings
    assert (finding.code, finding.effect) == ("log-publishers-conflict", "not-judged-part")
    assert found.effort is not None
    rows = found.time_s[np.isnan(found.effort[:, 0])] / PERIOD
    inside = (rows >= PUSH.start - 1) & (rows < PUSH.stop + 1)
    doubled = len(range(PUSH.start, PUSH.stop, every))
    assert np.unique(rows[inside].round()).size > 0.6 * doubled, "both samples of most of these stamps"
    assert np.count_nonzero(~inside) <= 40


def test_those_that_agree_within_noise_are_left_out_with_the_size_of_what_they_differ_by() -> None:
    log = twice(0.0, True)
    assert without_contradictions(log) is log
    (said,) = [f for f in condition(log, ConditioningConfig()).findings if f.code == "time-duplicate"]
    assert said.effect == "excludes" and "4000 samples" in said.text and "efforts of up to" in said.text


def test_the_same_twice_is_a_note() -> None:
    log = twice(0.0, True)
    assert log.effort is not None
    effort = log.effort.copy()
    effort[1::2] = effort[::2]
    (said,) = [f for f in condition(replace(log, effort=effort), ConditioningConfig()).findings if "left out" in f.text]
    assert (said.code, said.severity) == ("time-duplicate", "info") and "the same" in said.text


@pytest.mark.parametrize("step", [0.004, 0.01])
def test_stamps_coarser_than_the_samples_contradict_nothing(step: float) -> None:
    log = twice(0.0, True, 10_000)
    assert log.effort is not None
    effort = log.effort.copy()
    effort[PUSH] += 12.0
    coarse = replace(log, time_s=np.floor(log.time_s / step + 1e-9) * step, effort=effort)
    assert not without_contradictions(coarse).findings
