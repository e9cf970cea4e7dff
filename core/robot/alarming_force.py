"""The smallest force at a place of an arm that alarms, by the torque that alarms on each joint.

A pure force f·d at a place gives the joints the torques J_v^T f·d. From direction d it alarms at
f = min_j s_j / |J_v,j · d|, s_j what alarms on joint j. Whatever is beyond a place does not feel it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.robot.arm_places import Place, directions
from collaudit.core.robot.robot_model import RobotModel

#: A force is noticed when it alarms from so many of the directions that load a watched joint. All of them would ask for
#: an infinite force: in any pose some direction nearly crosses every axis.
DIRECTIONS = 0.8
#: A direction loads a joint where a newton gives it at least this share of the arm's longest lever there.
_LOADED = 0.05


@dataclass(frozen=True, slots=True, eq=False)
class AlarmingForces:
    """At one place, pose by pose.

    Attributes:
        felt: (k,) poses in which some direction loads a watched joint.
        force_n: (m,) in those the smallest force that alarms from :data:`DIRECTIONS` of such directions.
        first: (m,) joint that alarms first from the last of them.
        unfelt: share of all directions over all poses that load no watched joint.
        smallest_n: (k, d) that alarms by pose and direction; infinite where none does.
    """

    felt: BoolArray
    force_n: FloatArray
    first: IntArray
    unfelt: float
    smallest_n: FloatArray

    def noticed(self, force_n: float) -> float:
        """Share of all directions over all poses from which a force of this size alarms."""
        return float(np.mean(self.smallest_n <= force_n)) if self.smallest_n.size else 0.0


def alarming_forces(
    robot: RobotModel, place: Place, position_rad: FloatArray, torque_nm: FloatArray, watched: BoolArray
) -> AlarmingForces:
    """The smallest forces that alarm at a place.

    Args:
        robot: the arm.
        place: on it.
        position_rad: (k, j) of all joints of the model.
        torque_nm: (k, j) that alarms on each joint, N·m (N); infinite where none would.
        watched: (k, j) whether the joint is watched.
    """
    felt = list(place.columns)
    lever = robot.torque_per_newton(position_rad, place.frame)[:, felt]
    arm = np.abs(lever @ directions())  # (k, j, d)
    slides = np.array([kind == "prismatic" for kind in (robot.joint_types[k] for k in felt)])
    longest = np.linalg.norm(np.where(slides[:, None], 0.0, lever), axis=2).max(axis=1, initial=0.0)
    least = _LOADED * np.where(slides, 1.0, longest[:, None])  # a sliding joint takes up to a newton a newton
    loads = (arm > least[:, :, None]) & watched[:, felt, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        force = np.where(loads, torque_nm[:, felt, None] / arm, np.inf)
    any_joint: BoolArray = np.asarray(loads.any(axis=1))
    smallest = np.where(any_joint, force.min(axis=1), np.inf)
    here: BoolArray = np.asarray(any_joint.any(axis=1))
    order = np.argsort(smallest, axis=1)
    place_in = np.maximum(np.ceil(DIRECTIONS * any_joint.sum(axis=1) - 1e-9).astype(int), 1) - 1
    column = np.take_along_axis(order, place_in[:, None], axis=1)
    value = np.take_along_axis(smallest, column, axis=1)[:, 0]
    first = np.array(felt)[np.take_along_axis(force.argmin(axis=1), column, axis=1)[:, 0]]
    unfelt = float(1.0 - any_joint.mean()) if any_joint.size else 1.0
    return AlarmingForces(here, value[here], first[here], unfelt, smallest)
