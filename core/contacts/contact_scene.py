"""What the arm was doing at a moment: where its joints and its tool were, and how fast they moved."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from collaudit.core.data.detection_result import ContactScene
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.robot.robot_model import RobotModel

#: The tool's velocity is a difference of its positions this long before and after, at constant joint velocity, s.
_STEP_S = 1e-4


def scene_at(prepared: Prepared, sample: int, frames: Sequence[str]) -> ContactScene | None:
    """Pose and speeds at a sample.

    Args:
        prepared: the log and its model.
        sample: of the uniform series.
        frames: of :func:`stick_frames`.

    Returns:
        None without a kinematic model, or where a position is not known.
    """
    robot, series = prepared.robot, prepared.series
    q, v = series.position_rad[sample], series.velocity_rad_s[sample]
    if not frames or not np.isfinite(q).all():
        return None
    points = robot.frame_positions(q, frames)
    speed = _tool_speed(robot, q, v, frames[-1]) if np.isfinite(v).all() else None
    return ContactScene(
        time_s=float(series.time_s[sample]),
        points_m=tuple((float(x), float(y), float(z)) for x, y, z in points),
        tool_frame=frames[-1],
        tool_speed_m_s=speed,
        joint_speed_rad_s={
            joint: float(v[k]) if np.isfinite(v[k]) else None
            for joint, k in zip(prepared.judged, prepared.columns(), strict=True)
        },
    )


def stick_frames(robot: RobotModel, tool: str | None) -> list[str]:
    """A frame at every joint, base to tip, and the tool's; none without a description.

    Args:
        robot: with or without a description.
        tool: its frame; None: the frame of the last link that is furthest out.
    """
    if robot.bodies is None:
        return []
    known = robot.bodies.frame_names
    joints = [joint if joint in known else robot.link_of(joint) for joint in robot.joint_names]
    last = [frame for frame in known if robot.bodies.frame_joint(frame) == robot.joint_names[-1]]
    outer = tool if tool in known else max(last, key=robot.distance_in_joint, default=None)
    return [frame for frame in (*joints, outer) if frame is not None]


def _tool_speed(robot: RobotModel, q: FloatArray, v: FloatArray, frame: str) -> float:
    """Speed of a frame's origin: central difference along the joints' velocity, m/s."""
    before, after = (robot.frame_positions(q + step * v, [frame])[0] for step in (-_STEP_S, _STEP_S))
    return float(np.linalg.norm(after - before) / (2 * _STEP_S))
