"""The smallest force along the arm that would have alarmed: torque sensitivity of all joints through J^T.

A pure force f·d at a place gives the joints the torques J_v^T f·d. It alarms when one of them exceeds what is
detectable there: from direction d at f = min_j s_j / |J_v,j · d|. Whatever is beyond a place does not feel it.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np

from collaudit.core.data.sensitivity_result import ForceLevel, ForceSensitivity
from collaudit.core.dataclass import dataclass
from collaudit.core.numeric.arrays import FloatArray, IntArray
from collaudit.core.numeric.stats import in_order
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.robot.robot_model import RobotModel

#: Shares of the time, and of the directions, at which the distribution is given.
_TIME_SHARES = (0.5, 0.8, 0.95)
_MOST_DIRECTIONS, _HALF_DIRECTIONS = 0.95, 0.5
_DIRECTIONS = 120
MOMENTS = 500


@dataclass(frozen=True, slots=True)
class Place:
    """A frame of the arm, with words for it, and how many joints lie between it and the base."""

    words: str
    frame: str
    joints: int


def force_sensitivities(
    prepared: Prepared, detectable_nm: FloatArray, samples: IntArray, tool: str | None
) -> tuple[ForceSensitivity, ...]:
    """What force would have alarmed at the outer end of each link and at the tool.

    Args:
        prepared: the log and its model.
        detectable_nm: (k, j) smallest torque of each judged joint that would have alarmed, at some samples.
        samples: (k,) these samples.
        tool: frame of the tool; None: the frame of the last link that is furthest out.

    Returns:
        One a place, base to tip; none without a kinematic model or samples. At a moment without a position nothing can
        be told.
    """
    robot, judged = prepared.robot, prepared.judged_series.joint_names
    positions = prepared.series.position_rad[samples]
    fine = np.isfinite(positions).all(axis=1)
    if robot.bodies is None or not fine.any():
        return ()
    level = np.full((int(fine.sum()), len(robot.joint_names)), np.inf)
    columns = [robot.joint_names.index(joint) for joint in judged]
    level[:, columns] = detectable_nm[fine]
    return tuple(
        _at(robot, place, positions[fine], level, judged, samples.size)
        for place in places(robot, tool)
        if any(joint in judged for joint in robot.joint_names[: place.joints])
    )


def places(robot: RobotModel, tool: str | None) -> list[Place]:
    """The outer ends of the links, where the next joint is, and the tool; none without a kinematic model."""
    if robot.bodies is None:
        return []
    names, frames = robot.joint_names, robot.bodies.frame_names
    out = []
    for k, following in enumerate(names[1:], 1):
        frame = following if following in frames else robot.link_of(following)
        if frame is not None:
            out.append(Place(f"end of {robot.link_of(names[k - 1]) or names[k - 1]}", frame, k))
    own = [f for f in frames if robot.bodies.frame_joint(f) == names[-1]]
    outer = tool if tool in frames else max(own, key=lambda f: _distance(robot, f), default=None)
    return [*out, Place("tool", outer, len(names))] if outer is not None else out


def _distance(robot: RobotModel, frame: str) -> float:
    """From the joint that moves a frame, m."""
    assert robot.bodies is not None
    return float(np.linalg.norm(robot.bodies.frame_in_joint(frame)[1]))


def _at(
    robot: RobotModel, place: Place, q: FloatArray, level_nm: FloatArray, judged: Sequence[str], moments: int
) -> ForceSensitivity:
    """At one place, over positions (k, j) with the joints' levels (k, j)."""
    arms = np.stack([torque_per_newton(robot, q, axis, place.frame) for axis in range(3)], axis=2)
    felt = slice(0, place.joints)
    with np.errstate(divide="ignore", invalid="ignore"):
        force = level_nm[:, felt, None] / np.abs(arms[:, felt] @ directions())
    smallest = np.where(np.isnan(force), np.inf, force).min(axis=1)
    ordered = np.sort(smallest, axis=1)
    most, half = (ordered[:, _place_of(share, ordered.shape[1])] for share in (_MOST_DIRECTIONS, _HALF_DIRECTIONS))
    return ForceSensitivity(
        place=place.words,
        frame=place.frame,
        joints=tuple(joint for joint in robot.joint_names[: place.joints] if joint in judged),
        moments=moments,
        levels=tuple(
            ForceLevel(share, _at_share(most, moments, share), _at_share(half, moments, share))
            for share in _TIME_SHARES
        ),
    )


def torque_per_newton(robot: RobotModel, q: FloatArray, axis: int, frame: str) -> FloatArray:
    """(k, j) torque of each joint for a newton along one axis of the frame."""
    wrench = np.zeros((q.shape[0], 6))
    wrench[:, axis] = 1.0
    return robot.wrench_torque(q, wrench, frame)


@cache
def directions() -> FloatArray:
    """(3, m) unit vectors, evenly spread (golden-angle spiral) over half a sphere: an opposite force feels alike."""
    z = (np.arange(_DIRECTIONS) + 0.5) / _DIRECTIONS
    angle = np.arange(_DIRECTIONS) * np.pi * (3.0 - np.sqrt(5.0))
    across = np.sqrt(1.0 - z**2)
    return np.stack([across * np.cos(angle), across * np.sin(angle), z])


def _place_of(share: float, count: int) -> int:
    return max(int(np.ceil(share * count - 1e-9)), 1) - 1


def _at_share(force_n: FloatArray, moments: int, share: float) -> float | None:
    """The smallest force that a share of all moments does not exceed; None: in so many no force would alarm."""
    place = _place_of(share, moments)
    if place >= force_n.size:
        return None
    value = in_order(force_n, place)[0]
    return value if np.isfinite(value) else None
