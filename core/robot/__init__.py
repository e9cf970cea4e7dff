"""The robot as a rigid-body model: torques from motion.

In: the ``[robot]`` table and the URDF or DH rows that it names. Out: joint names, and a RobotModel.
Elsewhere: signals of a log, and what is made of its torques (conditioning, prepare).

:func:`robot_joints` is cheap and reads text only; :func:`load_robot` reaches Pinocchio, which is imported
in ``core/robot/pinocchio_model.py`` and nowhere else.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from collaudit.core.config.schema import RobotConfig
from collaudit.core.robot.robot_description import describe_robot

if TYPE_CHECKING:
    from collaudit.core.robot.robot_model import RobotModel

__all__ = ["load_robot", "robot_joints"]


def robot_joints(config: RobotConfig, base_dir: Path) -> tuple[str, ...]:
    """Names of the robot's movable joints in model order; empty when no robot is configured.

    Model order is depth first through the URDF's tree in file order, or the order of the DH rows. Joints
    that mimic another are not movable on their own and are left out.

    Args:
        config: the ``[robot]`` table.
        base_dir: folder that relative paths start from.

    Raises:
        RobotError: the description cannot be read.
    """
    description = describe_robot(config, base_dir)
    return description.movable if description else ()


def load_robot(config: RobotConfig, base_dir: Path, joints: Sequence[str]) -> RobotModel:
    """Build the rigid-body model for the joints a log has.

    Args:
        config: the ``[robot]`` table.
        base_dir: folder that relative paths start from.
        joints: the log's joints that the model has, in any order; model order is restored. Other movable
            joints are locked at zero, with finding ``model-joint-locked``.

    Returns:
        The model; without any robot description, one that knows the joint names only.

    Raises:
        RobotError: the description, or a name in the configuration, cannot be used.
    """
    from collaudit.core.robot.robot_building import build_robot

    return build_robot(config, base_dir, joints)
