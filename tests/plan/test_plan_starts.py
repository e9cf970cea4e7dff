"""Every arm that is shipped or known is planned for without a stated start, and the terminal says it in 300 words."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from collaudit.core.config import load_config
from collaudit.core.errors import ConfigError
from collaudit.core.plan.planning import PlanRequest, make_plan, move_check
from collaudit.fixtures.arms import robot_named
from collaudit.fixtures.experiments import Experiment
from collaudit.fixtures.truth import config_text
from collaudit.reports.terminal.command_texts import plan_text

JOINTS = {"tiago_no_hand.urdf": [f"arm_{k}_joint" for k in range(1, 8)]}


def shipped(name: str, folder: Path) -> Path:
    """The configuration that ``collaudit simulate`` writes."""
    robot = robot_named(name)
    description = robot.describe(lambda: 0.0)
    if description.urdf is not None:
        (folder / "arm.urdf").write_text(description.urdf, encoding="utf-8")
    none = np.zeros((1, len(robot.joints)))
    text = config_text(robot, description, Experiment(none, none, none), "csv", description.urdf and "arm.urdf")
    (folder / "arm.toml").write_text(text, encoding="utf-8")
    return folder / "arm.toml"


@pytest.mark.parametrize("name", ["paper6", "seven"])
def test_a_shipped_arm_is_planned_for(name: str, tmp_path: Path) -> None:
    check, _ = move_check(load_config(shipped(name, tmp_path)), None, 1.0)
    assert check.shapes.touching(check.limits.start[None]) is None


@pytest.mark.parametrize(
    "file",
    ["fr3", "med7dock", "panda", "so101_new_calib", "tiago_no_hand", "tx40_mdh_modified", "ur10_robot", "ur3_robot"],
)
def test_a_known_arm_is_planned_for(file: str, data_dir: Path, tmp_path: Path) -> None:
    urdf = data_dir / "urdf" / f"{file}.urdf"
    joints = JOINTS.get(urdf.name)
    keys = f'urdf = "{urdf}"' + (f"\njoints = {joints}" if joints else "")
    (tmp_path / "arm.toml").write_text(f"[robot]\n{keys}\n", encoding="utf-8")
    check, _ = move_check(load_config(tmp_path / "arm.toml"), None, 1.0)
    limits = check.limits
    assert check.shapes.touching(limits.start[None]) is None and limits.inside(limits.start[None]).all()
    assert any(text.startswith("start") for text in limits.assumed), "what nobody stated is said"


def test_a_start_that_is_stated_is_never_moved(data_dir: Path, tmp_path: Path) -> None:
    urdf = data_dir / "urdf" / "ur10_robot.urdf"
    (tmp_path / "arm.toml").write_text(f'[robot]\nurdf = "{urdf}"\n[plan]\nstart_rad = {{ wrist_1_joint = 0.0 }}\n')
    with pytest.raises(ConfigError, match="cannot start where it is to"):
        move_check(load_config(tmp_path / "arm.toml"), None, 1.0)


def test_a_plan_is_told_in_300_words(tmp_path: Path) -> None:
    loaded = load_config(shipped("seven", tmp_path))
    plan = make_plan(loaded, None, [], PlanRequest(1.0), loaded.provenance(None, None))
    text = plan_text(plan.file, brief=True)
    assert len(text.split()) <= 300
    assert "A person must check it on the robot" in text and "start of every joint: not stated" in text
    assert all(joint in text for joint in plan.robot.joint_names)
