"""Thresholds and persistences that nothing can exceed are named, and forbid a pass where they are hopeless."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from collaudit.core.detection.rule_reach import (
    check_persistence,
    coarse_findings,
    persistence_findings,
    reach_findings,
)
from collaudit.core.errors import NotJudgedError

TORQUE = 20.0, 6.0  # largest of each joint on record


def found(gamma: tuple[float, float], limits: tuple[float, float], n: int = 13, unit: str = "Nm") -> list[Any]:
    time_s = np.arange(2000) * 0.002
    effort = np.outer(np.sin(2 * time_s), TORQUE)
    series: Any = SimpleNamespace(time_s=time_s, effort=effort, effort_unit=unit, joint_names=("a", "b"))
    robot: Any = SimpleNamespace(joint_names=("a", "b"), effort_limit_nm=np.array(limits))
    rule: Any = SimpleNamespace(
        gamma_nm=dict(zip("ab", gamma, strict=True)), n=n, persistence_s=n * 0.002, watch=("a", "b")
    )
    return [*persistence_findings(rule), *reach_findings(series, robot, rule)]


NONE = (np.nan, np.nan)


@pytest.mark.parametrize(
    ("gamma", "limits", "effect", "words"),
    [
        ((4.0, 4.0), NONE, None, ""),
        ((4.0, 7.0), NONE, "excludes", "b 7 (largest 6)"),
        ((4.0, 61.0), (100.0, 60.0), "excludes", "b 61 (limit 60)"),
        ((1e308, 4.0), NONE, "not-judged-joint", "'a'"),
        ((201.0, 4.0), NONE, "not-judged-joint", "more than 10 times"),
        ((150.0, 4.0), (14.0, 14.0), "excludes", "largest 20"),  # the log itself exceeds that limit of 14
        ((4.0, 80.0), (100.0, 7.0), "not-judged-joint", "limit is 7"),
    ],
)
def test_thresholds_out_of_reach(gamma: Any, limits: Any, effect: str | None, words: str) -> None:
    findings = found(gamma, limits)
    assert [f.effect for f in findings] == ([] if effect is None else [effect])
    assert all(f.code == "rule-unfit" and words in f.text for f in findings)


@pytest.mark.parametrize(("n", "effect"), [(13, None), (125, None), (126, "excludes"), (2000, "excludes")])
def test_persistence_out_of_reach(n: int, effect: str | None) -> None:
    findings = found((4.0, 4.0), NONE, n)
    assert [f.effect for f in findings] == ([] if effect is None else [effect])
    assert all(f.code == "rule-unfit" for f in findings)


def test_a_persistence_longer_than_the_log_is_refused() -> None:
    series: Any = SimpleNamespace(time_s=np.arange(2000) * 0.002, period_s=0.002)
    check_persistence(series, 2000)
    with pytest.raises(NotJudgedError, match="longer than the log"):
        check_persistence(series, 10**18)


def test_raw_efforts_are_compared_with_nothing() -> None:
    assert not found((1e9, 1e9), NONE, unit="raw")


def test_thresholds_that_are_large_beside_the_joints_torque_are_said() -> None:
    time_s = np.arange(2000) * 0.002
    series: Any = SimpleNamespace(effort=np.outer(np.sin(3 * time_s), TORQUE), effort_unit="Nm", joint_names=("a", "b"))
    rule: Any = SimpleNamespace(gamma_nm={"a": 3.5, "b": 1.5}, watch=("a", "b"))
    (said,) = coarse_findings(series, rule)
    assert (said.code, said.effect) == ("rule-unfit", "excludes")
    assert "b 1.5 of 12" in said.text and "a 3.5" not in said.text
    still: Any = SimpleNamespace(effort=np.ones((2000, 2)), effort_unit="Nm", joint_names=("a", "b"))
    assert not coarse_findings(still, rule)
