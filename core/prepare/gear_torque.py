"""Torque that reaches a joint's link: by a sensor behind the gear where the log has one, else by the model.

A log with the drive's torque and a joint torque sensor gives friction directly, as their difference, less what
accelerates the rotor: tau_drive - tau_sensor = f(dq) + B ddq (Albu-Schäffer, Ott and Hirzinger, Int. J. Robotics
Research 26, 2007, eq. (1)-(2)). No error of inertials, tool or contact is in it.
"""

from __future__ import annotations

import numpy as np

from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.prepare.prepared import Prepared


def sensed(prepared: Prepared, joint: str) -> bool:
    """Whether the log has both torques of a joint, in N·m."""
    series = prepared.series
    if series.joint_torque_nm is None or series.effort is None or series.effort_unit != "Nm":
        return False
    return bool(np.isfinite(series.joint_torque_nm[:, series.column(joint)]).any())


def gear_torque(prepared: Prepared, joint: str) -> FloatArray | None:
    """(n,) torque that the drive must bring up besides friction, N·m; None without sensor and model.

    Args:
        prepared: the log.
        joint: its name.
    """
    series = prepared.series
    j = series.column(joint)
    if sensed(prepared, joint):
        assert series.joint_torque_nm is not None
        return np.asarray(series.joint_torque_nm[:, j] + _rotor(prepared, joint) * series.acceleration_rad_s2[:, j])
    if prepared.rigid_nm is None:
        return None
    known = prepared.rigid_nm[:, j]
    return known if prepared.contact_nm is None else known + prepared.contact_nm[:, j]


def _rotor(prepared: Prepared, joint: str) -> float:
    """Rotor inertia of a joint as known, kg·m²."""
    bodies = prepared.robot.bodies
    return 0.0 if bodies is None else float(prepared.robot.armature[bodies.joint_names.index(joint)])
