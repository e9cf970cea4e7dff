"""A link whose mass the description lacks: no torque of the joints that carry it is known."""

from __future__ import annotations

from pathlib import Path

import pytest
from arms import LEVEL, dh_robot, dh_row

from collaudit.core.config.schema import RobotConfig
from collaudit.core.findings import joints_not_judged
from collaudit.core.prepare.calibration import weightless_findings
from collaudit.core.robot.robot_building import build_robot

NAMES = ("joint1", "joint2", "joint3")


@pytest.mark.parametrize("lacking", [0, 1, 2])
def test_joints_beyond_it_are_judged_and_those_that_carry_it_are_not(lacking: int) -> None:
    rows = [dh_row(0.0 if j == lacking else 2.0, (0, 0, 0), (0, 0, 0.01), a=0.3) for j in range(3)]
    robot = build_robot(RobotConfig.of(dh_robot(rows, **LEVEL)), Path(), NAMES)
    found = weightless_findings(robot, None, NAMES)
    assert {finding.code for finding in found} == {"model-approximate"}
    assert joints_not_judged(found, NAMES) == set(NAMES[: lacking + 1])
