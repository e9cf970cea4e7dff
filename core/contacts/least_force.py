"""The least force that explains a joint's torque: the torque over the longest lever arm that a contact can have.

A force at a point turns a joint by at most its size times the point's distance from the joint's axis. Whatever the
direction, and wherever on the links that the joint moves, the force is therefore no smaller than torque / longest
distance. That holds where too few joints react to tell a direction, and needs no assumption about the place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from collaudit.core.contacts.contact_scene import ArmAtSamples
from collaudit.core.data.detection_result import ContactForce, LeastForce
from collaudit.core.numeric.arrays import FloatArray

#: Links are thicker than their frames and reach beyond them: the surface is taken to end this far from them, m.
SURFACE_M = 0.1
#: One-sided 95 % point of the normal distribution, in standard deviations.
_ONE_SIDED = 1.645
#: A joint whose longest lever is shorter tells nothing, m.
_SHORTEST_M = 0.03


def least_force(
    at: ArmAtSamples, joints: Sequence[str], torque_nm: FloatArray, sd_nm: FloatArray, sample: int
) -> LeastForce | None:
    """The largest of the lower bounds that the joints of a contact give.

    Args:
        at: the arm where contacts are looked at, at this sample too.
        joints: those that reacted.
        torque_nm: (k,) their external torque; where friction is only a range, what lies beyond it.
        sd_nm: (k,) its standard deviation.
        sample: of the log, for the pose.

    Returns:
        None without a kinematic model or a pose, or where no torque stands out of its own error.
    """
    robot = at.robot
    if robot.bodies is None or not at.position_known(sample):
        return None
    levers = longest_levers(at, sample)
    bounds = []
    for joint, torque, sd in zip(joints, torque_nm, sd_nm, strict=True):
        lever = levers[robot.joint_names.index(joint)]
        sure = abs(float(torque)) - _ONE_SIDED * float(sd)
        if lever >= _SHORTEST_M and sure > 0.0:
            bounds.append(LeastForce(float(sure / lever), joint, float(lever)))
    return max(bounds, key=lambda bound: bound.force_n, default=None)


def with_least(force: ContactForce | None, least: LeastForce | None) -> ContactForce | None:
    """The force with an interval that begins no lower than the least force; None where it would end below it.

    Then the force does not act as it is taken to, a pure one near a frame, and only its lower bound holds.
    """
    if force is None or least is None:
        return force
    high = force.size_ci95_n[1]
    if high is not None and least.force_n > high:
        return None
    links = tuple(
        replace(link, low_n=max(link.low_n, least.force_n))
        for link in force.links
        if link.high_n is None or least.force_n <= link.high_n
    )
    return replace(force, size_ci95_n=(max(force.size_ci95_n[0], least.force_n), high), links=links)


def longest_levers(at: ArmAtSamples, sample: int) -> FloatArray:
    """(j,) longest distance from each joint's axis to the surface of what it moves, m; 1 for prismatic joints.

    Args:
        at: an arm with a kinematic model.
        sample: at which its position is known.
    """
    robot = at.robot
    turning = np.array([kind != "prismatic" for kind in robot.joint_types])
    out = np.zeros(len(robot.joint_names))
    for frame in at.link_frames:  # a joint beyond the frame feels nothing: its lever there is 0
        out = np.maximum(out, np.linalg.norm(at.lever_arms(frame, sample), axis=0))
    return np.where(turning, out + SURFACE_M, np.minimum(out, 1.0))
