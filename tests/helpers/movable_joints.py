"""Names of a described robot's joints."""

from __future__ import annotations

from pathlib import Path

from collaudit.core.config.schema import RobotConfig
from collaudit.core.robot.robot_description import describe_robot


def movable_joints(config: RobotConfig, folder: Path) -> tuple[str, ...]:
    """In model order: depth first through the tree in file order, or the order of the DH rows; no mimicking ones."""
    description = describe_robot(config, folder)
    assert description is not None
    return description.movable
