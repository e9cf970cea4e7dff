"""Columns as robot software heads them, by public documentation: what is measured, and what comes with it."""

from __future__ import annotations

import random
from collections.abc import Sequence

import numpy as np

from collaudit.core.numeric.arrays import FloatArray

FORCE = ("actual_TCP_force_#", "actual_TCP_pose_#", "joint_mode_#")
#: Name to time column, (position, velocity, effort) stems and stems that hold something else; # is the number.
VOCABULARIES: dict[str, tuple[str, tuple[str, ...], tuple[str, ...]]] = {
    "libfranka": ("time", ("q#", "dq#", "tau_J#"), ("q_d#", "dq_d#", "tau_J_d#", "tau_ext_hat_filtered#", "dtau_J#")),
    "libfranka log": ("time", ("state.q[#]", "state.dq[#]", "state.tau_J[#]"), ("state.q_d[#]", "cmd.tau_J_d[#]",
                      "state.theta[#]")),
    "ur rtde": ("timestamp", ("actual_q_#", "actual_qd_#", "actual_current_#"), ("target_q_#", "target_current_#",
                "target_moment_#", "target_qd_#", *FORCE)),
    "ur realtime": ("time", ("q_actual_#", "qd_actual_#", "i_actual_#"), ("q_target_#", "i_target_#", "m_target_#")),
    "kuka fri": ("t", ("measuredJointPosition#", "", "measuredTorque#"), ("commandedJointPosition#",
                 "externalTorque#", "commandedTorque#", "ipoJointPosition#")),
    "lbr fri": ("t", ("measured_joint_position_#", "", "measured_torque_#"), ("external_torque_#",
                "commanded_joint_position_#", "commanded_torque_#")),
    "kuka rsi": ("t", ("AIPos.A#", "", "MACur.A#"), ("ASPos.A#",)),
    "abb egm": ("t", ("feedBack.joints.joints[#]", "", "motorCurrents[#]"), ("planned.joints.joints[#]",)),
    "doosan": ("time", ("actual_joint_position_#", "actual_joint_velocity_#", "raw_joint_torque_#"),
               ("target_joint_position_#", "external_joint_torque_#", "actual_motor_torque_#",
                "actual_joint_position_abs_#", "actual_joint_velocity_abs_#", "actual_joint_torque_#")),
    "kinova": ("t", ("actuators[#].position", "actuators[#].velocity", "actuators[#].torque"),
               ("actuators[#].current_motor", "actuators[#].voltage")),
    "units": ("t_s", ("q_deg_#", "dq_degps_#", "i_A_#"), ("tau_model_nm_#",)),
    "act and des": ("t", ("q_act_#", "dq_act_#", "tau_#"), ("q_des_#", "dq_des_#", "tau_cmd_#", "sensor_torque_#")),
    "rostopic echo": ("%time", ("field.position#", "field.velocity#", "field.effort#"), ()),
    "plotjuggler": ("__time", tuple(f"/joint_states/{q}[#]" for q in ("position", "velocity", "effort")), ()),
    "controller state": ("__time", ("/c/actual/positions[#]", "/c/actual/velocities[#]", "/c/actual/effort[#]"),
                         ("/c/desired/positions[#]", "/c/error/positions[#]", "/c/desired/effort[#]")),
    "theta and dots": ("time", ("theta#", "theta_dot#", "torque#"), ("theta_ddot#", "torque_cmd#", "tau_ext#")),
    "flobaroid": ("times", ("positions_raw#", "velocities_raw#", "torques_raw#"), ("positions#", "velocities#",
                  "torques#", "accelerations#", "target_positions#")),
}  # fmt: skip


def header(name: str, joints: int, base: int, seed: int) -> list[str]:
    """Time first, the others in any order."""
    time, wanted, others = VOCABULARIES[name]
    numbers = range(base, base + joints)
    columns = [stem.replace("#", str(k)) for stem in (*wanted, *others) if stem for k in numbers]
    return [time, *random.Random(seed).sample(columns, len(columns))]


#: Vocabularies whose positions and velocities are in degrees, and those whose efforts are currents.
DEGREES = frozenset({"kuka rsi", "abb egm", "doosan", "kinova", "units"})
CURRENTS = frozenset({"ur rtde", "ur realtime", "kuka rsi", "abb egm", "units"})
#: Torque of every joint in N·m for each ampere of :func:`table_of`.
TORQUE_CONSTANT = 2.5


def table_of(name: str, base: int, time_s: FloatArray, signals: Sequence[FloatArray]) -> dict[str, FloatArray]:
    """Columns of an arm's log in a vocabulary, in the units of its source; columns beside them hold other values.

    Args:
        name: of :data:`VOCABULARIES`.
        base: the number of the first joint.
        time_s: (n,).
        signals: (n, j) positions in rad, velocities in rad/s, efforts in N·m.
    """
    time, wanted, others = VOCABULARIES[name]
    angle = np.rad2deg if name in DEGREES else np.positive
    scaled = (angle(signals[0]), angle(signals[1]), signals[2] / (TORQUE_CONSTANT if name in CURRENTS else 1.0))
    columns = {time: time_s}
    for stem, values in zip(wanted, scaled, strict=True):
        columns |= {stem.replace("#", str(base + k)): values[:, k] for k in range(values.shape[1]) if stem}
    joints = signals[0].shape[1]
    for place, stem in enumerate(others):
        columns |= {stem.replace("#", str(base + k)): np.cos(time_s * (place + 2) + k) for k in range(joints)}
    return columns
