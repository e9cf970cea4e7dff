"""The budget of near misses is broken where the lower bound of a robot's rate over the night exceeds it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import samples
from scipy.stats import poisson

from collaudit.core.data.audit_result import PolicyLimits
from collaudit.core.verdict.verdict import budget_breaches, least_per_hour, near_miss_breach
from collaudit.reports.formats.registry import formats_of_many, summary_text
from collaudit.reports.page.index import summarise, write_index
from collaudit.reports.values.entries import entry_of
from collaudit.reports.values.night import NightFacts

LIMIT = 10.0


@pytest.fixture(scope="module")
def quiet():
    """A passed log, and a near miss of another."""
    return samples.passed(2000).result, samples.failed(2000).result.near_misses[0]


def _log(quiet, count: int, recorded_s: float):
    """A log of so many near misses in so many seconds."""
    result, near = quiet
    limits = PolicyLimits(0, LIMIT, 0.8)
    coverage = replace(result.coverage, recorded_s=recorded_s)
    return replace(result, near_misses=(near,) * count, coverage=coverage, limits=limits)


def test_the_bound_is_that_of_poisson_counts() -> None:
    for count in (1, 2, 7, 100):
        assert poisson.sf(count - 1, least_per_hour(count, 3600.0)) == pytest.approx(0.05)
    assert least_per_hour(0, 3600.0) == least_per_hour(3, 0.0) == 0.0


def test_a_robot_that_keeps_the_limit_is_seldom_accused() -> None:
    counts = np.random.default_rng(4).poisson(LIMIT * 0.5, 2000)
    broken = np.mean([bool(near_miss_breach(int(count), 1800.0, LIMIT)) for count in counts])
    assert 0.005 < broken < 0.05


def test_one_near_miss_in_twenty_seconds_breaks_nothing() -> None:
    assert near_miss_breach(1, 20.0, LIMIT) == []
    assert "at least 246 (95 %; policy: at most 10)" in near_miss_breach(4, 20.0, LIMIT)[0]


def test_the_logs_of_a_robot_count_together(quiet) -> None:
    """Each log by itself tells nothing; of A they break the limit together, of B they keep it."""
    a, b = [_log(quiet, 1, 60.0)] * 6, [_log(quiet, 1, 3600.0)] * 6
    logs = [*(("A", one) for one in a), *(("B", one) for one in b)]
    (text,) = budget_breaches(logs)
    assert text.startswith("6 near misses in 6 min, 6 logs of robot A: 60 an hour, at least 26.1")
    assert budget_breaches(logs[6:]) == budget_breaches(logs[:1]) == []
    assert budget_breaches([(None, one) for one in a])[0].startswith("6 near misses in 6 min, 6 logs: ")


def test_a_budget_that_is_broken_fails_the_night_in_every_format(quiet, tmp_path: Path) -> None:
    logs = [replace(_log(quiet, 1, 60.0), log=replace(quiet[0].log, name=f"{k}.csv")) for k in range(6)]
    night = NightFacts(breaches=tuple(budget_breaches([("A", one) for one in logs])))
    entries = [entry_of(one) for one in logs]
    assert night.verdict(entries) == "fail" and summarise(entries, night).verdict == "fail"
    write_index(tmp_path, entries, night)
    texts = [
        (tmp_path / "index.html").read_text(),
        *(summary_text(logs, name, (), night) for name in formats_of_many()),
    ]
    assert all("6 near misses in 6 min" in text for text in texts)
    junit = summary_text(logs, "junit", (), night)
    assert junit.count("<failure") == 1 and 'tests="7" failures="1"' in junit
