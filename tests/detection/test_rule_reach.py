"""Thresholds and persistences that nothing can exceed are named, and forbid a pass where they are hopeless."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from collaudit.core.config.schema import Config
from collaudit.core.detection.rule_settings import make_rule, reach_findings
from collaudit.core.errors import NotJudgedError

TORQUE = 20.0, 6.0  # largest of each joint on record


def found(gamma: tuple[float, float], limits: tuple[float, float], unit: str = "Nm") -> list[Any]:
    time_s = np.arange(2000) * 0.002
    effort = np.outer(np.sin(2 * time_s), TORQUE)
    series: Any = SimpleNamespace(effort=effort, effort_unit=unit, joint_names=("a", "b"))
    robot: Any = SimpleNamespace(joint_names=("a", "b"), effort_limit_nm=np.array(limits))
    rule: Any = SimpleNamespace(gamma_nm=dict(zip("ab", gamma, strict=True)), watch=("a", "b"))
    prepared: Any = SimpleNamespace(series=series, judged_series=series, robot=robot)
    return reach_findings(prepared, rule)


NONE = (np.nan, np.nan)


@pytest.mark.parametrize(
    ("gamma", "limits", "effect", "words"),
    [
        ((3.5, 1.0), NONE, None, ""),
        ((3.5, 1.5), NONE, "excludes", "b 1.5 of 12"),
        ((3.5, 7.0), NONE, "excludes", "b 7 of 12"),
        ((3.5, 61.0), (100.0, 60.0), "excludes", "b 61 of 12"),
        ((1e308, 1.0), NONE, "not-judged-joint", "'a'"),
        ((201.0, 1.0), NONE, "not-judged-joint", "more than 10 times"),
        ((150.0, 1.0), (14.0, 14.0), "excludes", "a 150 of"),  # the log itself exceeds that limit of 14
        ((3.5, 80.0), (100.0, 7.0), "not-judged-joint", "limit is 7"),
    ],
)
def test_thresholds_out_of_reach(gamma: Any, limits: Any, effect: str | None, words: str) -> None:
    findings = found(gamma, limits)
    assert [f.effect for f in findings] == ([] if effect is None else [effect])
    assert all(f.code == "rule-unfit" and words in f.text for f in findings)


def test_a_persistence_longer_than_the_log_is_refused() -> None:
    def made(n: int) -> None:
        detect = Config().detect.changed({"n": n})
        series: Any = SimpleNamespace(time_s=np.arange(2000) * 0.002, period_s=0.002, joint_names=())
        make_rule(series, np.zeros(2000, np.int8), Config().changed({"detect": detect}))

    made(2000)
    with pytest.raises(NotJudgedError, match="longer than the log"):
        made(10**18)


def test_raw_efforts_are_compared_with_nothing() -> None:
    assert not found((1e9, 1e9), NONE, unit="raw")
