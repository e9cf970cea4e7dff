"""Other descriptions that lie beside the configured one and have the log's joints: the arm may be one of these."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from collaudit.core.config.schema import RobotConfig
from collaudit.core.errors import CollauditError
from collaudit.core.robot.robot_building import build_robot
from collaudit.core.robot.robot_model import RobotModel

#: A folder of a family has no more; each is a tenth of a second.
_MOST = 20


def sibling_robots(config: RobotConfig, base_dir: Path, joints: Sequence[str]) -> Iterator[tuple[str, RobotModel]]:
    """Name of the file and model, with the tool and the mounting that are stated, of each such description.

    Args:
        config: the ``[robot]`` table.
        base_dir: folder that relative paths start from.
        joints: of the log.
    """
    if config.urdf is None:
        return
    own = base_dir / config.urdf
    for path in sorted(own.parent.glob(f"*{own.suffix}"))[:_MOST]:
        if path.name == own.name:
            continue
        try:
            robot = build_robot(config.changed({"urdf": path}), base_dir, joints)
        except CollauditError:  # of other joints, or no description: nothing to try
            continue
        if robot.has_inertials and robot.joint_names == tuple(joints):
            yield path.name, robot
