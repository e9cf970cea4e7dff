"""What the arm was doing at a moment: where its joints and its tool were, and how fast they moved."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from collaudit.core.data.arm_geometry import ArmGeometry, ArmLink
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
    columns = dict(zip(prepared.judged, prepared.columns(), strict=True))
    speed = _tool_speed(robot, q, v, frames[-1]) if np.isfinite(v).all() else None
    return ContactScene(
        time_s=float(series.time_s[sample]),
        points_m=tuple(_point(point) for point in points),
        tool_frame=frames[-1],
        tool_speed_m_s=speed,
        joint_speed_rad_s={joint: float(v[k]) if np.isfinite(v[k]) else None for joint, k in columns.items()},
        joint_position_rad={joint: float(q[k]) for joint, k in columns.items()},
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


def arm_geometry(prepared: Prepared, tool: str | None) -> ArmGeometry | None:
    """The arm's kinematics for drawings.

    Args:
        prepared: the log and its model.
        tool: as of :func:`stick_frames`.

    Returns:
        None without a description, and where a joint moves whose position the result does not hold.
    """
    robot, bodies = prepared.robot, prepared.robot.bodies
    frames = stick_frames(robot, tool)
    moved_by = [[robot.joint_names[c] for c in np.flatnonzero(row)] for row in robot.expansion]
    if bodies is None or not frames or any(len(names) > 1 or {*names} - {*prepared.judged} for names in moved_by):
        return None
    links = zip(bodies.links, moved_by, robot.expansion.sum(axis=1), robot.offset, strict=True)
    place = bodies.frame_placement(frames[-1])
    return ArmGeometry(
        links=tuple(
            ArmLink(
                joint=names[0] if names else None,
                parent=link.parent,
                prismatic=link.prismatic,
                rotation=tuple(link.rotation.ravel().tolist()),
                translation_m=_point(link.translation),
                factor=float(factor),
                offset=float(offset),
            )
            for link, names, factor, offset in links
        ),
        tool_link=place.link,
        tool_m=_point(place.translation),
    )


def _point(xyz: FloatArray) -> tuple[float, float, float]:
    x, y, z = xyz.tolist()
    return x, y, z


def _tool_speed(robot: RobotModel, q: FloatArray, v: FloatArray, frame: str) -> float:
    """Speed of a frame's origin: central difference along the joints' velocity, m/s."""
    before, after = (robot.frame_positions(q + step * v, [frame])[0] for step in (-_STEP_S, _STEP_S))
    return float(np.linalg.norm(after - before) / (2 * _STEP_S))
