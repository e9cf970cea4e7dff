"""A description written with what a fit found: read again it is the fitted model, and says what it stands on."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from collaudit.core.config.schema import Config, RobotConfig
from collaudit.core.data.audit_result import FrictionFile, Provenance
from collaudit.core.data.friction_result import FrictionFit
from collaudit.core.data.identification_result import Identified, IdentifiedBody, IdentifiedJoint
from collaudit.core.errors import CollauditError, ConfigError, RobotError
from collaudit.core.friction import identified_description as writing
from collaudit.core.friction.identified_description import identified_mjcf, identified_urdf
from collaudit.core.prepare.calibration import Calibration, calibrated_robot
from collaudit.core.robot.pinocchio_model import mjcf_model
from collaudit.core.robot.robot_building import build_robot
from collaudit.core.robot.robot_model import RobotModel


def _inertial(mass: float, xyz: str, rpy: str = "0 0 0") -> str:
    return (
        f'<inertial><origin xyz="{xyz}" rpy="{rpy}"/><mass value="{mass}"/>'
        '<inertia ixx="0.02" iyy="0.03" izz="0.025" ixy="0.001" ixz="-0.002" iyz="0.003"/></inertial>'
    )


#: A base, two links, a flange fixed askew, a hand on it that slides when it is not held, and a finger that follows.
ARM = f"""<robot name="arm"><!-- ours --><link name="base">{_inertial(9, "0 0 0.1")}</link>
<link name="upper"><visual/>{_inertial(4, "0.1 0.02 0.2", "0.1 0.2 0.3")}</link>
<link name="lower">{_inertial(2, "0 0.1 0.1")}</link>
<link name="flange">{_inertial(0.5, "0.01 0 0.02")}</link>
<link name="hand">{_inertial(0.3, "0 0 0.04")}</link>
<link name="second">{_inertial(0.2, "0 0.03 0")}</link>
<joint name="a" type="continuous"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.3" rpy="0.2 0 0"/>
  <axis xyz="0 1 0"/><dynamics damping="7" friction="9"/></joint>
<joint name="b" type="revolute"><parent link="upper"/><child link="lower"/>
  <origin xyz="0 0 0.4"/><axis xyz="0.6 0.8 0"/>
  <limit lower="-2" upper="2" effort="50" velocity="3"/></joint>
<joint name="bolt" type="fixed"><parent link="lower"/><child link="flange"/>
  <origin xyz="0 0.1 0.3" rpy="1 0.5 0.2"/></joint>
<joint name="slide" type="prismatic"><parent link="flange"/><child link="hand"/>
  <origin xyz="0 0 0.1"/><axis xyz="1 0 0"/>
  <limit lower="0" upper="0.1" effort="20" velocity="1"/></joint>
<joint name="follows" type="prismatic"><parent link="flange"/><child link="second"/><axis xyz="-1 0 0"/>
  <limit lower="0" upper="0.1" effort="20" velocity="1"/><mimic joint="slide" multiplier="2" offset="0.01"/></joint>
<transmission name="own"><type>transmission_interface/SimpleTransmission</type>
  <joint name="b"/><actuator name="m"/></transmission>
</robot>"""
LAW = {"A_nm": 4.0, "D_nm_s_per_rad": 5.0}


def of(
    tmp_path: Path, joints: tuple[str, ...], tool: float, seed: int | None
) -> tuple[Config, FrictionFile, RobotModel]:
    """Settings, a fit that changed every body and rotor unless the seed is None, and the model that follows."""
    (tmp_path / "arm.urdf").write_text(ARM)
    settings: dict[str, Any] = {"urdf": "arm.urdf", "armature_kg_m2": {"a": 0.3}, "base_rpy_deg": [20, 0, 0]}
    if tool:
        settings["tool"] = {"frame": "flange", "mass_kg": tool, "com_m": [0, 0.02, 0.1]}
    config = Config.of({"robot": settings})
    robot = build_robot(config.robot, tmp_path, joints)
    fit = FrictionFit("coulomb-viscous", LAW, {"A_nm": (3.5, 4.5), "D_nm_s_per_rad": None}, None, True, (), (), 9, 9,
                      (0.05, 1.2), 0.1, "N·m", ())  # fmt: skip
    fits = dict.fromkeys(joints, fit) | {"b": replace(fit, model=None, parameters={}, speed_range_rad_s=None)}
    identified = None
    if seed is not None:
        random = np.random.default_rng(seed)
        bodies, drives = {}, {}
        for name, ten in zip(robot.bodies.joint_names, robot.inertial_parameters.reshape(-1, 10), strict=True):  # type: ignore[union-attr]
            found = ten * random.uniform(1.0, 1.3, 10)
            bodies[name] = IdentifiedBody(found[0], tuple(found[1:4] / found[0]), tuple(found), tuple(ten), name != "a")
        for name in joints:
            drives[name] = IdentifiedJoint(1.0, None, 0.0, (None, None), 0.4, 0.3, 100, None, None, (0.35, 0.45))
        identified = Identified(
            ("friction", "inertials", "rotor"), drives, bodies, (), None, "", 1.0, False, "", 100, 40.0, "linear"
        )
    friction = FrictionFile(
        "collaudit/friction/1", fits, (), Provenance("9.9", {}, logs={"run.csv": "ab" * 32}), identified
    )
    return config, friction, calibrated_robot(robot, Calibration.of(friction, config), config, False)[0]


def again(written: bytes, config: Config, robot: RobotModel, tmp_path: Path) -> RobotModel:
    (tmp_path / "written.urdf").write_bytes(written)
    rotors = dict(zip(robot.bodies.joint_names, robot.armature.tolist(), strict=True))  # type: ignore[union-attr]
    given = {"urdf": "written.urdf", "armature_kg_m2": {name: rotors[name] for name in robot.joint_names}}
    return build_robot(RobotConfig.of({**given, "base_rpy_deg": [20, 0, 0]}), tmp_path, robot.joint_names)


@pytest.mark.parametrize("joints", [("a", "b"), ("a", "b", "slide")])
@pytest.mark.parametrize("tool", [0.0, 1.5])
@pytest.mark.parametrize("seed", [None, 0, 1, 2])
def test_read_again_it_gives_the_same_torque(
    joints: tuple[str, ...], tool: float, seed: int | None, tmp_path: Path
) -> None:
    """With links fixed askew, a hand that is held or moves, one that follows it, and the tool as stated."""
    config, friction, robot = of(tmp_path, joints, tool, seed)
    model = again(identified_urdf(friction, config, tmp_path), config, robot, tmp_path)
    motion = np.random.default_rng(9).uniform(-2, 2, (3, 50, len(joints)))
    np.testing.assert_allclose(model.inverse_dynamics(*motion), robot.inverse_dynamics(*motion), rtol=0, atol=1e-9)
    plain = build_robot(_plain(), tmp_path, joints)
    assert (seed is None and not tool) == bool(
        np.allclose(plain.inverse_dynamics(*motion), robot.inverse_dynamics(*motion), atol=1e-6)
    )


def _plain() -> RobotConfig:
    """As it was described."""
    return RobotConfig.of({"urdf": "arm.urdf", "armature_kg_m2": {"a": 0.3}, "base_rpy_deg": [20, 0, 0]})


def test_it_says_what_it_stands_on(tmp_path: Path) -> None:
    config, friction, _ = of(tmp_path, ("a", "b"), 1.5, 0)
    text = identified_urdf(friction, config, tmp_path).decode()
    head = text.partition("-->")[0]
    parts = (
        "run.csv (sha256 " + "ab" * 32,
        "a: coulomb-viscous, 0.05 to 1.2 rad/s: A_nm 4 [3.5, 4.5]",
        "b: no friction",
        "[0.35, 0.45]",
        'armature_kg_m2 = { "a" = 0.4, "b" = 0.4 }',
        "No rigid body has the inertials of: a",
    )
    for said in parts:
        assert said in head, said
    root = ET.fromstring(text)
    dynamics = {joint.get("name"): joint.find("dynamics") for joint in root.findall("joint")}
    assert float(dynamics["a"].get("friction")) == pytest.approx(4.0)  # type: ignore[union-attr,arg-type]
    assert float(dynamics["a"].get("damping")) == pytest.approx(5.0)  # type: ignore[union-attr,arg-type]
    assert dynamics["b"] is None, "nothing was fitted"
    rotors = {
        one.get("name"): one.find("actuator/{http://drake.mit.edu}rotor_inertia") for one in root.iter("transmission")
    }
    assert {name: found.get("value") for name, found in rotors.items() if found is not None} == {
        "own": "0.4",
        "a_transmission": "0.4",
    }
    assert "drake:rotor_inertia" in text and "<visual" in text and "<!-- ours -->" in text and "<mimic" in text


def test_a_file_that_gives_another_torque_is_not_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    config, friction, _ = of(tmp_path, ("a", "b"), 0.0, 0)
    right = writing._with_bodies
    monkeypatch.setattr(writing, "_with_bodies", lambda data, bodies, merged: right(data, {"a": bodies["a"]}, merged))
    with pytest.raises(CollauditError, match="does not give the fitted torque"):
        identified_urdf(friction, config, tmp_path)


def test_bodies_that_no_link_can_have_are_refused(tmp_path: Path) -> None:
    config, friction, _ = of(tmp_path, ("a", "b"), 0.0, 0)
    assert friction.identified is not None
    body = friction.identified.bodies["b"]
    bodies = friction.identified.bodies | {"b": replace(body, parameters=(-1.0, *body.parameters[1:]))}
    with pytest.raises(RobotError, match="no mass that a URDF could state"):
        identified_urdf(replace(friction, identified=replace(friction.identified, bodies=bodies)), config, tmp_path)
    with pytest.raises(ConfigError, match="only a robot that a URDF describes"):
        identified_urdf(friction, Config.of({}), tmp_path)


def without_followers(tmp_path: Path, seed: int | None, tool: float) -> tuple[Any, ...]:
    """The arm of the URDF's tests without its hand."""
    config, friction, _ = of(tmp_path, ("a", "b"), tool, seed)
    text = (tmp_path / "arm.urdf").read_text()
    for name in ("slide", "follows"):
        begin = text.index(f'<joint name="{name}" type="prismatic">')
        text = text[:begin] + text[begin:].replace('type="prismatic"', 'type="fixed"', 1)
    text = text.replace('<mimic joint="slide" multiplier="2" offset="0.01"/>', "")
    (tmp_path / "arm.urdf").write_text(text)
    return config, friction, writing._fitted_robot(friction, config, tmp_path)


@pytest.mark.parametrize("seed", [None, 0, 1])
@pytest.mark.parametrize("tool", [0.0, 1.5])
def test_mjcf_read_again_gives_the_same_torque(seed: int | None, tool: float, tmp_path: Path) -> None:
    config, friction, robot = without_followers(tmp_path, seed, tool)
    (tmp_path / "arm.xml").write_bytes(identified_mjcf(friction, config, tmp_path))
    again = mjcf_model(tmp_path / "arm.xml").under_gravity(robot.gravity_base_m_s2)
    motion = np.random.default_rng(9).uniform(-2, 2, (3, 50, 2))
    found = replace(robot, bodies=again).inverse_dynamics(*motion)
    np.testing.assert_allclose(found, robot.inverse_dynamics(*motion), rtol=0, atol=1e-9)
    root = ET.parse(tmp_path / "arm.xml").getroot()
    gravity = np.array([float(x) for x in root.find("option").get("gravity").split()])  # type: ignore[union-attr]
    np.testing.assert_array_equal(gravity, robot.gravity_base_m_s2)
    joints = {joint.get("name"): joint for joint in root.iter("joint")}
    assert float(joints["a"].get("frictionloss", "")) == pytest.approx(4.0)
    assert float(joints["a"].get("damping", "")) == pytest.approx(5.0)


def test_an_arm_of_rows_is_written_too(tmp_path: Path) -> None:
    _, friction, _ = of(tmp_path, ("a", "b"), 0.0, None)
    row = {"d": 0.3, "a": 0.1, "alpha": 1.2, "mass_kg": 3.0, "com_m": [0.0, 0.1, 0.05],
           "inertia_kg_m2": [0.02, 0.03, 0.04, 0.001, 0.0, 0.002]}  # fmt: skip
    rows = RobotConfig.of({"dh_convention": "modified", "dh": [{**row, "name": name} for name in ("a", "b")]})
    plain = replace(friction, identified=None)
    assert b"<worldbody>" in identified_mjcf(plain, Config.of({}).changed({"robot": rows}), tmp_path)


def test_mjcf_that_gives_another_torque_is_not_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    config, friction, _ = without_followers(tmp_path, 0, 0.0)
    right = writing._mjcf_inertial
    monkeypatch.setattr(writing, "_mjcf_inertial", lambda name, ten: right(name, 1.01 * ten))
    with pytest.raises(CollauditError, match="does not give the fitted torque"):
        identified_mjcf(friction, config, tmp_path)


def test_mjcf_of_joints_that_follow_others_are_refused(tmp_path: Path) -> None:
    config, friction, _ = of(tmp_path, ("a", "b", "slide"), 0.0, 0)
    with pytest.raises(RobotError, match="follow others"):
        identified_mjcf(friction, config, tmp_path)
