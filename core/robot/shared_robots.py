"""Robots that were built before: the logs of one worker share a model, and the programs recorded for it.

A model is never changed once it is built, and a configuration, joints and the content of its description make the same
model each time; building it and recording its programs again takes longer than a minute's log needs of them.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence
from pathlib import Path
from threading import Lock

from collaudit.core.config.schema import RobotConfig
from collaudit.core.robot.robot_building import build_robot
from collaudit.core.robot.robot_description import describe_robot
from collaudit.core.robot.robot_model import RobotModel

#: Robots of one fleet that take turns in a worker.
_KEPT = 8
_built: OrderedDict[object, RobotModel] = OrderedDict()
_lock = Lock()


def shared_robot(config: RobotConfig, base_dir: Path, joints: Sequence[str]) -> RobotModel:
    """The model of :func:`build_robot`, built once.

    Raises:
        RobotError: the description, or a name in the configuration, cannot be used.
    """
    description = describe_robot(config, base_dir)
    content = None if description is None else description.content_sha256
    key = repr(config), config.given, base_dir, tuple(joints), content
    with _lock:
        if key not in _built:
            _built[key] = build_robot(config, base_dir, joints)
            if len(_built) > _KEPT:
                _built.popitem(last=False)
        _built.move_to_end(key)
        return _built[key]
