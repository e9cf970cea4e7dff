"""Gravity's direction by the effort: named before signs, whatever the arm carries, and no hand is taken for it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from three_joints import arm, log_of, settings

from collaudit.core.data.joint_log import JointLog
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.prepare.mounting import mounting
from collaudit.core.prepare.preparation import prepare
from collaudit.core.prepare.prepared import Prepared

PLAIN = settings()
TOOL = {"mass_kg": 1.5, "com_m": [0.03, -0.02, 0.06]}
SIGNS = np.array([1.0, -1.0, -1.0])


def mounted(rpy_deg: tuple[float, float, float], sign: FloatArray | None = None, **extra: object) -> JointLog:
    """A log of an arm on another base than is stated."""
    config = settings(**extra)
    turned = config.changed({"robot": config.robot.changed({"base_rpy_deg": rpy_deg})})
    return log_of(arm(turned), np.ones(3) if sign is None else sign)


def prepared(log: JointLog) -> Prepared:
    return prepare(log, arm(PLAIN), PLAIN)


def line(findings: tuple[Finding, ...]) -> list[float]:
    """The value to paste."""
    (said,) = (f.text for f in findings if f.code == "base-mounting")
    return [float(x) for x in said.split("base_rpy_deg = [")[1].split("]")[0].split(",")]


def inverted(findings: tuple[Finding, ...]) -> list[str | None]:
    return [f.joint for f in findings if f.kind.setting == "log.units.effort_sign"]


@pytest.mark.parametrize("tool", [None, TOOL])
@pytest.mark.parametrize("rpy_deg", [(180.0, 0.0, 0.0), (0.0, 80.0, 0.0), (-90.0, 0.0, 0.0), (35.0, -50.0, 0.0)])
def test_the_line_to_paste_is_within_two_degrees_and_no_sign_is_advised(
    rpy_deg: tuple[float, float, float], tool: object
) -> None:
    found = prepared(mounted(rpy_deg, tool=tool)).findings
    off = np.abs(np.array(line(found)) - rpy_deg)
    assert np.all(np.minimum(off, 360.0 - off) < 2.0)
    assert any(f.effect == "not-judged-log" for f in found), "nothing passes with gravity elsewhere"
    assert not inverted(found)


def test_a_tilt_of_three_degrees_is_named_and_judged_as_stated() -> None:
    found = prepared(mounted((3.0, 0.0, 0.0))).findings
    assert line(found)[:2] == pytest.approx([3.0, 0.0], abs=0.7)
    assert not any(f.effect == "not-judged-log" for f in found)


def test_efforts_that_are_inverted_are_no_mounting_and_both_are_told_apart() -> None:
    upright = prepared(mounted((0.0, 0.0, 0.0), -np.ones(3))).findings
    assert len(inverted(upright)) == 3 and not any("base_rpy_deg =" in f.text for f in upright)
    both = prepared(mounted((180.0, 0.0, 0.0), SIGNS)).findings
    assert abs(line(both)[0]) == pytest.approx(180.0, abs=2.0)
    assert inverted(both) == ["joint2", "joint3"]


@pytest.mark.parametrize("force_n", [(15.0, -10.0, 0.0), (0.0, 25.0, -10.0), (0.0, 0.0, 30.0)])
def test_somebody_who_leans_on_the_tool_is_no_mounting(force_n: tuple[float, float, float]) -> None:
    log = mounted((0.0, 0.0, 0.0))
    assert log.effort is not None
    pushed = arm(PLAIN).base_torque_per_newton(log.position_rad, "tool0") @ np.array(force_n)
    start = prepared(replace(log, effort=log.effort - pushed)).start
    assert mounting(start.table, arm(PLAIN)) is None


def test_masses_that_are_off_are_no_mounting() -> None:
    for scale in (0.85, 1.15):
        assert mounting(prepared(log_of(arm(settings(scale)), np.ones(3))).start.table, arm(PLAIN)) is None
