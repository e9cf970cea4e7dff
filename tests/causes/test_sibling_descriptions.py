"""Another description that lies beside the stated one: tried, and named where its torques are the log's."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from origins import NOBODY
from three_joints import arm, log_of, settings

from collaudit.core.audit import audit_log
from collaudit.core.config.schema import Config
from collaudit.core.data.audit_result import AuditResult
from collaudit.core.fitting import fit_logs
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.prepare.preparation import prepare
from collaudit.core.robot.robot_building import sibling_robots

PLAIN = settings(detect={"gamma_nm": "auto"})
SIBLINGS = {"light.urdf": 0.8, "heavy.urdf": 1.3}
URDF = """<robot name="{name}"><link name="base"/>{links}</robot>"""
LINK = """<link name="l{i}"><inertial><mass value="{mass}"/><origin xyz="0.1 0 0"/>
<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="{joint}" type="revolute"><parent link="{parent}"/><child link="l{i}"/><axis xyz="0 1 0"/>
<limit lower="-3" upper="3" effort="100" velocity="3"/></joint>"""


def result_of(scale: float, force_n: FloatArray | None = None) -> AuditResult:
    """Of a log of the arm with this scale, fitted and judged as one of scale 1; with a steady force at the tool."""
    friction = fit_logs(
        [prepare(log_of(arm(PLAIN), np.ones(3), seed=3, seconds=120.0), arm(PLAIN), PLAIN)], PLAIN, NOBODY
    )
    log = log_of(arm(settings(scale)), np.ones(3), seed=8, seconds=90.0)
    if force_n is not None and log.effort is not None:
        log = replace(log, effort=log.effort - arm(PLAIN).base_torque_per_newton(log.position_rad, "tool0") @ force_n)
    siblings = [(name, arm(settings(size))) for name, size in SIBLINGS.items()]
    return audit_log(prepare(log, arm(PLAIN), PLAIN), PLAIN, friction, NOBODY, siblings=siblings).result


def test_the_description_that_the_log_goes_with_is_named_with_the_line_to_state() -> None:
    result = result_of(SIBLINGS["heavy.urdf"])
    assert result.verdict != "pass"
    first = result.causes[0]
    assert (first.code, first.speaks, first.line) == ("description", True, '[robot] urdf = "heavy.urdf"')


def test_an_arm_between_two_descriptions_is_neither() -> None:
    """Six tenths of the way to a sibling: the torques of that one are not the log's either."""
    result = result_of(0.87)
    assert result.verdict != "pass"
    assert all(cause.code != "description" for cause in result.causes)


def test_a_hand_is_no_other_arm() -> None:
    result = result_of(1.0, np.array([0.0, 0.0, -40.0]))
    assert result.verdict != "pass"
    assert not any(cause.code == "description" and cause.line and cause.speaks for cause in result.causes)


def test_descriptions_in_the_folder_with_the_same_joints_are_at_hand(tmp_path: Path) -> None:
    def write(name: str, masses: tuple[float, ...], first: str = "a") -> None:
        links = "".join(
            LINK.format(i=i, mass=mass, joint=f"{first}{i}", parent="base" if i == 0 else f"l{i - 1}")
            for i, mass in enumerate(masses)
        )
        (tmp_path / name).write_text(URDF.format(name=name, links=links), encoding="utf-8")

    write("arm.urdf", (1.0, 2.0))
    write("arm_b.urdf", (1.5, 3.0))
    write("other_joints.urdf", (1.0, 2.0), "b")
    write("longer.urdf", (1.0, 2.0, 3.0))
    (tmp_path / "broken.urdf").write_text("<robot", encoding="utf-8")
    robot = Config.of({"robot": {"urdf": "arm.urdf"}}).robot
    found = dict(sibling_robots(robot, tmp_path, ("a0", "a1")))
    assert list(found) == ["arm_b.urdf", "longer.urdf"], "of a longer one the third joint is locked"
    assert found["arm_b.urdf"].inertial_parameters[[0, 10]].tolist() == [1.5, 3.0]
