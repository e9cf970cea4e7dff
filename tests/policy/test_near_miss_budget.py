"""The budget of near misses is broken where the lower bound of a robot's rate over the night exceeds it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import samples
from scipy.stats import poisson

from collaudit.cli.batch.log_jobs import LogJob, Outcome
from collaudit.cli.fleet.night_policy import Decisions, NightPolicy
from collaudit.core.config import parse_config
from collaudit.core.verdict.verdict import least_per_hour, near_miss_breach
from collaudit.reports.values.entries import entry_of

LIMIT = 10.0


@pytest.fixture(scope="module")
def quiet():
    """A passed log, and a near miss of another."""
    return samples.passed(2000).result, samples.failed(2000).result.near_misses[0]


def _night(quiet, *logs: tuple[str, int, float], policy: str = "") -> Decisions:
    """The decision over logs of (robot, near misses, seconds)."""
    loaded = parse_config(f"[policy]\nmax_near_misses_per_hour = {LIMIT}\n{policy}", None)
    result, near = quiet
    jobs, outcomes = [], []
    for k, (robot, count, recorded_s) in enumerate(logs):
        one = replace(
            result,
            near_misses=(near,) * count,
            coverage=replace(result.coverage, recorded_s=recorded_s),
            log=replace(result.log, name=f"{robot}/{k}.csv"),
        )
        jobs.append(LogJob((Path(f"{robot}/{k}.csv"),), f"{robot}/{k}.csv", f"{robot}_{k}", loaded, robot))
        outcomes.append(Outcome(entry_of(one), one))
    return NightPolicy(loaded.config.policy, None).decide(jobs, outcomes)


def test_the_bound_is_that_of_poisson_counts() -> None:
    for count in (1, 2, 7, 100):
        assert poisson.sf(count - 1, least_per_hour(count, 3600.0)) == pytest.approx(0.05)
    assert least_per_hour(0, 3600.0) == least_per_hour(3, 0.0) == 0.0


def test_a_robot_that_keeps_the_limit_is_seldom_accused() -> None:
    counts = np.random.default_rng(4).poisson(LIMIT * 0.5, 2000)
    broken = np.mean([bool(near_miss_breach(int(count), 1800.0, LIMIT)) for count in counts])
    assert 0.005 < broken < 0.05


def test_one_near_miss_in_twenty_seconds_breaks_nothing(quiet) -> None:
    kept = _night(quiet, ("A", 1, 20.0))
    assert [entry.verdict for entry in kept.entries] == ["pass"]
    (rule,) = (rule for rule in kept.file.logs[0].rules if rule.rule == "near_misses")
    assert (
        rule.state == "kept"
        and rule.text == "1 near miss in 20 s: 180 an hour, at least 9.23 (95 %; policy: at most 10)."
    )
    broken = _night(quiet, ("A", 4, 20.0))
    assert broken.verdicts == ("fail",) and "at least 246 (95 %; policy: at most 10)" in broken.entries[0].reasons[0]


def test_the_logs_of_a_robot_count_together(quiet) -> None:
    """Each log by itself tells nothing; of A they break the limit together, of B they keep it."""
    logs = [*[("A", 1, 60.0)] * 6, ("A", 0, 60.0), *[("B", 1, 3600.0)] * 6]
    night = _night(quiet, *logs)
    assert [entry.verdict for entry in night.entries] == 6 * ["fail"] + 7 * ["pass"]
    assert (
        night.entries[0].reasons[0].startswith("6 near misses in 7 min, 7 logs of robot A: 51.4 an hour, at least 22.4")
    )
    calm = _night(quiet, ("A", 4, 20.0), ("A", 0, 7200.0))
    assert calm.verdicts == ("pass", "pass")
    assert any("4 near misses" in reason for reason in calm.entries[0].reasons)


def test_what_is_switched_off_is_still_told(quiet) -> None:
    night = _night(quiet, *[("A", 1, 60.0)] * 6, policy='levels = { near_misses = "off" }')
    assert night.verdicts == ("pass",) * 6
    assert "Switched off by the policy: 6 near misses" in " ".join(night.entries[0].reasons)


def test_fail_fast_counts_what_came_so_far(quiet) -> None:
    loaded = parse_config(f"[policy]\nmax_near_misses_per_hour = {LIMIT}\n", None)
    one = replace(quiet[0], near_misses=(quiet[1],), coverage=replace(quiet[0].coverage, recorded_s=60.0))
    policy, job = NightPolicy(loaded.config.policy, None), LogJob((Path("a.csv"),), "a.csv", "a", loaded, "A")
    assert [policy.verdict_of(job, Outcome(entry_of(one), one)) for _ in range(3)] == ["pass", "fail", "fail"]
