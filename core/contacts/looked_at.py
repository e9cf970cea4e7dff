"""What contacts ask of a log again and again: links, frames, and lever arms at all samples at once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from collaudit.core.contacts.contact_scene import stick_frames
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.robot.robot_model import RobotModel


class LookedAt:
    """The arm at the samples where contacts are looked at.

    A lever arm costs some hundred calls of NumPy, whether for one sample or for a hundred: those of a frame are
    computed when it is first asked for, for all samples together.
    """

    def __init__(self, prepared: Prepared, samples: Sequence[int] = (), tool: str | None = None) -> None:
        """``samples``: of the log; ``tool``: frame of the tool, None for the last link's frame that is furthest out."""
        robot = prepared.robot
        self.robot, self.judged = robot, prepared.judged
        #: For each judged joint its column among the arm's.
        self.columns = [robot.joint_names.index(joint) for joint in prepared.judged]
        #: Whether phases of the run are known.
        self.phases_known = bool((prepared.phases > 0).any())
        #: For each joint of the arm a frame of the link that it moves.
        self.links = [robot.link_of(joint) for joint in robot.joint_names]
        #: Frames at every joint, base to tip, and the tool's; none without a description.
        self.stick = stick_frames(robot, tool)
        #: A frame of every place on the links; of those at one place the first.
        self.link_frames = _link_frames(robot)
        position = prepared.series.position_rad
        known = [k for k in dict.fromkeys(samples) if np.isfinite(position[k]).all()]
        self._place = {k: place for place, k in enumerate(known)}
        self._position_rad = position[known]
        self._arms: dict[str, FloatArray] = {}

    def rotation(self, frame: str, sample: int) -> FloatArray:
        """(3, 3) axes of a frame in the base at one of the samples."""
        return self.robot.frame_rotation(self._position_rad[self._place[sample]], frame)

    def position_known(self, sample: int) -> bool:
        """Whether the position of every joint is known at one of the samples."""
        return sample in self._place

    def lever_arms(self, frame: str, sample: int) -> FloatArray:
        """(3, j) torque of the arm's joints per newton along each axis of a frame; the position is known there."""
        if frame not in self._arms:
            q = self._position_rad
            unit = np.tile(np.hstack([np.eye(3), np.zeros((3, 3))]), (len(q), 1))
            torque = self.robot.wrench_torque(np.repeat(q, 3, axis=0), unit, frame)
            self._arms[frame] = np.ascontiguousarray(torque).reshape(len(q), 3, -1)
        return np.asarray(self._arms[frame][self._place[sample]])


def _link_frames(robot: RobotModel) -> list[str]:
    found: dict[tuple[object, ...], str] = {}
    bodies = robot.bodies
    if bodies is None:
        return []
    for frame in bodies.frame_names:
        place = np.round(bodies.frame_in_joint(frame)[1], 6)
        found.setdefault((bodies.frame_joint(frame), *place.tolist()), frame)
    return list(found.values())
