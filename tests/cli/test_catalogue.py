"""Descriptions that init proposes for a log without one, over the arms of example-robot-data's wheel."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from origins import log_source

from collaudit.cli.drafts import catalogue
from collaudit.cli.drafts.catalogue import catalogue_folders, proposals
from collaudit.core.config.schema import RobotConfig
from collaudit.core.data.joint_log import JointLog
from collaudit.core.robot.robot_description import describe_robot
from collaudit.core.robot.urdf_file import JointFacts

#: Files of arms and, of other robots, the joints of an arm.
ARMS = {
    "TwoDofs": "", "borinot_flying_arm_2": "", "hextilt_flying_arm_5": "", "kinova": "", "panda": "joint",
    "panda_collision": "joint", "so100": "", "so101": "", "talos_left_arm": "", "xarm7": "", "z1": "", "finger_edu": "",
    "ur3_robot": "", "ur3_gripper": "", "ur3_joint_limited_robot": "", "ur5_robot": "", "ur5_gripper": "",
    "ur5_joint_limited_robot": "", "ur10_robot": "", "ur10_joint_limited_robot": "", "anymal-kinova": "j2s6s200",
    "b1-z1": "^joint", "baxter": "left_[swe]", "centauro": "j_arm1", "g1_29dof_rev_1_0": "left_(sh|el|wr)",
    "pr2": "l_(shoulder|upper|elbow|forearm|wrist)", "romeo": "^L(Sh|El|Wr)", "talos_full_v2": "arm_left",
    "tiago": "^arm_\\d", "tiago_no_hand": "^arm_\\d", "tiago_dual": "arm_left_\\d", "tiago_pro": "arm_left",
}  # fmt: skip


def log_of(joints: list[JointFacts], names: list[str], seed: int) -> JointLog:
    """Motion over four fifths of the limits, at half of speed and effort at most, as the description has them."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0.0, 60.0, 600)
    wave = np.sin(t[:, None] * rng.uniform(0.3, 0.9, len(joints)) + rng.uniform(0, 6, len(joints)))
    room = np.array([0.4 * (j.upper - j.lower) if np.isfinite(j.upper - j.lower) else 1.0 for j in joints])
    middle = np.array([0.5 * (j.upper + j.lower) if np.isfinite(j.upper - j.lower) else 0.0 for j in joints])
    speed = np.array([0.5 * j.speed_limit if j.speed_limit > 0 else 1.0 for j in joints])
    effort = np.array([0.5 * j.effort_limit if j.effort_limit > 0 else 10.0 for j in joints])
    return JointLog(t, tuple(names), middle + room * wave, speed * wave, effort * wave, "Nm", None, log_source())


def arms() -> dict[str, tuple[Path, list[JointFacts]]]:
    out = {}
    for path in sorted(path for folder in catalogue_folders() for path in folder.rglob("*.urdf")):
        if path.stem in ARMS:
            description = describe_robot(RobotConfig(urdf=path), Path())
            assert description is not None
            own = [j for j in description.joints if j.leader is None and re.search(ARMS[path.stem], j.name)]
            out[path.stem] = path, own
    return out


@pytest.mark.skipif(not catalogue_folders(), reason="example-robot-data is not installed")
def test_the_right_description_is_among_the_first_three(monkeypatch: pytest.MonkeyPatch) -> None:
    described = cache(lambda urdf: describe_robot(RobotConfig(urdf=urdf), Path()))  # each file once, not for every arm
    monkeypatch.setattr(catalogue, "describe_robot", lambda config, _base: described(config.urdf))
    every, folders = arms(), catalogue_folders()
    assert len(every) >= 20
    found = {}
    for seed, (name, (path, joints)) in enumerate(every.items()):
        first = proposals(folders, log_of(joints, [joint.name for joint in joints], seed))
        found[name] = path in [one.path for one in first]
    missed = [name for name, there in found.items() if not there]
    assert len(missed) <= 0.1 * len(found), missed


def test_none_is_taken_unasked(collaudit, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a log that is exactly one description's too: lines behind #, their hash beside them, exit code 3."""
    folder = tmp_path / "robots"
    folder.mkdir()
    urdf = '<robot name="r"><link name="a"/><link name="b"/><joint name="elbow" type="revolute"><parent link="a"/>'
    urdf += '<child link="b"/><axis xyz="0 0 1"/><limit lower="-2" upper="2" effort="10" velocity="2"/></joint></robot>'
    (folder / "one.urdf").write_text(urdf)
    t = np.arange(0, 20, 0.01)
    rows = np.column_stack([t, np.sin(t), np.cos(t), 3 * np.sin(t)])
    header = "time,elbow_position,elbow_velocity,elbow_effort"
    np.savetxt(tmp_path / "run.csv", rows, delimiter=",", header=header, comments="")
    monkeypatch.setenv("ROBOT_DESCRIPTIONS_CACHE", str(folder))
    made = collaudit("init", tmp_path / "run.csv", "-o", tmp_path / "made.toml")
    text = (tmp_path / "made.toml").read_text()
    assert made.code == 3 and "--urdf" in made.err and re.search(r"^# urdf = .*one\.urdf.*sha256", text, re.MULTILINE)
    assert not re.search(r"^urdf", text, re.MULTILINE)
