"""Turns are no evidence of degrees by themselves, and a unit that is stated holds."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from arms import dh_robot, dh_row
from synthetic import PERIOD, make_log

from collaudit.core.conditioning.conditioning import condition
from collaudit.core.config.schema import ConditioningConfig, RobotConfig, UnitsConfig
from collaudit.core.findings import Finding
from collaudit.core.prepare.position_check import position_findings
from collaudit.core.robot.robot_building import build_robot

T = PERIOD * np.arange(3000)
NAMES = ("joint1", "joint2", "joint3", "joint4")


def said(position: np.ndarray, tmp_path, limits: tuple[Any, ...] = (), unit: str = "rad", stated: bool = False):  # type: ignore[no-untyped-def]
    names = NAMES[: position.shape[1]]
    rows = [dh_row(1.0, (0, 0, 0), (0.1, 0.1, 0.1), a=0.3) for _ in names]
    robot = build_robot(RobotConfig.of(dh_robot(rows)), tmp_path, names)
    if limits:
        bounds = np.array([[-limit, limit] if np.ndim(limit) == 0 else limit for limit in limits])
        object.__setattr__(robot, "position_limits", bounds)
    series = condition(make_log(T, position, None, None, names), ConditioningConfig())
    return position_findings(series, robot, UnitsConfig.of({"position": unit} if stated or unit != "rad" else {}))


def arm(wrist: np.ndarray) -> np.ndarray:
    return np.column_stack([np.sin(T), 0.5 * np.cos(T), 1.2 + 0.3 * np.sin(2 * T), wrist])


def severities(findings: list[Finding]) -> list[tuple[str, str | None]]:
    assert {f.code for f in findings} <= {"log-unit-suspect"}
    return [(f.severity, f.joint) for f in findings]


def test_a_wrist_that_turned_on_is_no_degrees(tmp_path) -> None:  # type: ignore[no-untyped-def]
    turned = arm(14.8 + 0.2 * np.sin(T))
    assert said(turned, tmp_path) == []
    (found,) = said(turned, tmp_path, (6.28,) * 4)
    assert severities([found]) == [("warning", "joint4")]
    assert "at a speed that is possible in radians only" in found.text
    spinning = arm(2.0 * np.pi * T)
    assert said(spinning, tmp_path, (3.0, 3.0, 3.0, np.nan)) == []


@pytest.mark.parametrize("one", [(-6.28, np.nan), (np.nan, 6.28)], ids=["lower", "upper"])
def test_a_single_limit_counts(tmp_path, one: tuple[float, float]) -> None:  # type: ignore[no-untyped-def]
    (found,) = said(arm(14.8 + 0.2 * np.sin(T)), tmp_path, (6.28, 6.28, 6.28, one))
    assert severities([found]) == [("warning", "joint4")]


@pytest.mark.parametrize("limits", [(), (3.0,) * 4, (180.0,) * 4])
def test_degrees_are_noticed_at_once(tmp_path, limits: tuple[float, ...]) -> None:  # type: ignore[no-untyped-def]
    degrees = np.rad2deg(arm(0.4 * np.sin(T)))
    found = said(degrees, tmp_path, limits)
    assert {f.severity for f in found} == {"error"}
    assert 'position = "deg"' in found[0].text and 'position = "rad"' in found[0].text
    one_fast = arm(57.3 * 0.8 * np.sin(T))
    assert severities(said(one_fast, tmp_path, limits)) == [("error", "joint4")]
    for place in (90.0, -90.0):
        standing = arm(np.full_like(T, place))
        assert ("error", "joint4") in severities(said(standing, tmp_path, (3.0,) * 4))


def test_a_stated_unit_is_never_a_veto(tmp_path) -> None:  # type: ignore[no-untyped-def]
    degrees = np.rad2deg(arm(0.4 * np.sin(T)))
    found = said(degrees, tmp_path, stated=True)
    assert found
    assert {f.severity for f in found} == {"warning"}
    assert all("as [log.units] states" in f.text and not f.forbids_pass for f in found)
    tiny = np.deg2rad(arm(0.4 * np.sin(T)))
    assert severities(said(tiny, tmp_path, unit="deg")) == [("warning", None)]


def of(position: np.ndarray, kinds: str, speeds: list[float], tmp_path, **units: str) -> list[Finding]:  # type: ignore[no-untyped-def]
    """What is said of an arm whose joints are revolute (r) or prismatic (p), with limits of speed."""
    names = NAMES[: position.shape[1]]
    rows = [dh_row(1.0, (0, 0, 0), (0.1, 0.1, 0.1), a=0.3) | ({"joint": "prismatic"} if kind == "p" else {})
            for kind in kinds]  # fmt: skip
    robot = replace(build_robot(RobotConfig.of(dh_robot(rows)), tmp_path, names), speed_limits=np.array(speeds))
    series = condition(make_log(T, position, None, None, names), ConditioningConfig(), robot.sliding)
    return position_findings(series, robot, UnitsConfig.of(units))


@pytest.mark.parametrize("metres", [np.sin(T), 8.0 + 4.0 * np.sin(0.5 * T), 0.02 + 0.02 * np.sin(3 * T)])
def test_millimetres_are_noticed(tmp_path, metres: np.ndarray) -> None:  # type: ignore[no-untyped-def]
    """A rail, a gantry and a gripper's finger, which is short and is told by its speed."""
    nothing = [np.nan, np.nan]
    assert of(np.column_stack([np.sin(T), metres]), "rp", nothing, tmp_path) == []
    long = np.column_stack([np.sin(T), 1e3 * metres])
    assert severities(of(long, "rp", nothing, tmp_path)) == [("error", "joint2")]
    assert severities(of(long, "rp", nothing, tmp_path, length="m")) == [("warning", "joint2")]


@pytest.mark.parametrize("times", [10.0, 30.0, 100.0])
def test_time_that_passes_too_slowly_is_noticed_by_the_speeds(tmp_path, times: float) -> None:  # type: ignore[no-untyped-def]
    moving = np.column_stack([np.sin(T), 0.8 * np.cos(T), 0.9 * np.sin(0.9 * T)])
    fast = np.column_stack([np.sin(times * T), 0.8 * np.cos(times * T), 0.9 * np.sin(0.9 * times * T)])
    limits = [1.5, 1.5, np.nan]
    assert of(moving, "rrr", limits, tmp_path) == []
    assert severities(of(fast, "rrr", limits, tmp_path)) == [("error", None)]
    assert of(fast, "rrr", [np.nan] * 3, tmp_path) == [], "nothing says what is too fast"
    one = np.column_stack([fast[:, 0], moving[:, 1:]])
    slow = np.column_stack([0.25 * np.sin(times * T), 0.2 * np.cos(times * T), 0.4 * np.sin(times * T)])
    assert severities(of(slow, "rrr", [1.5] * 3, tmp_path)) == [("error", None)], "a quarter of the limits, ten times"
    flips = moving + 0.0015 * (np.arange(T.size)[:, None] % 2)
    assert of(flips, "rrr", [1.5] * 3, tmp_path) == [], "steps of an encoder are no speed"
    assert of(one, "rrr", [1.5, 1.5, 1.5], tmp_path) == [], "an encoder, not the time"
