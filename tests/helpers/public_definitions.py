"""Fields of message types as their publishers define them (names and order; without comments and constants).

Sources, each at the commit named: franka_msgs of frankaemika/franka_ros @360e93d (ROS 1) and frankaemika/franka_ros2
@20bd617 and @429b37a, control_msgs of ros-controls/control_msgs @20b6107 and of ROS 1 (indigo to noetic), ur_msgs of
ros-industrial/ur_msgs (noetic), lbr_fri_idl of lbr-stack/lbr_fri_idl @e3fc2b1 and lbr_fri_msgs before it, iiwa_msgs of
IFL-CAMP/iiwa_stack @3425e56.
"""

from __future__ import annotations

from collections.abc import Iterable


def _fields(groups: Iterable[tuple[str, str]]) -> str:
    """A definition from (type, names) in order."""
    return "\n".join(f"{kind} {name}" for kind, names in groups for name in names.split())


_SEVEN, _SIX, _POSE, _TWO = "float64[7]", "float64[6]", "float64[16]", "float64[2]"
_GENERATOR = "motion_generator"
_ERRORS_ROS1 = [
    ("bool", "joint_position_limits_violation cartesian_position_limits_violation self_collision_avoidance_violation"),
    ("bool", "joint_velocity_violation cartesian_velocity_violation force_control_safety_violation"),
    ("bool", "joint_reflex cartesian_reflex max_goal_pose_deviation_violation max_path_pose_deviation_violation"),
    ("bool", "cartesian_velocity_profile_safety_violation"),
    ("bool", f"joint_position_{_GENERATOR}_start_pose_invalid joint_{_GENERATOR}_position_limits_violation"),
    ("bool", f"joint_{_GENERATOR}_velocity_limits_violation joint_{_GENERATOR}_velocity_discontinuity"),
    ("bool", f"joint_{_GENERATOR}_acceleration_discontinuity cartesian_position_{_GENERATOR}_start_pose_invalid"),
    ("bool", f"cartesian_{_GENERATOR}_elbow_limit_violation cartesian_{_GENERATOR}_velocity_limits_violation"),
    ("bool", f"cartesian_{_GENERATOR}_velocity_discontinuity cartesian_{_GENERATOR}_acceleration_discontinuity"),
    ("bool", f"cartesian_{_GENERATOR}_elbow_sign_inconsistent cartesian_{_GENERATOR}_start_elbow_invalid"),
    ("bool", f"cartesian_{_GENERATOR}_joint_position_limits_violation"),
    ("bool", f"cartesian_{_GENERATOR}_joint_velocity_limits_violation"),
    ("bool", f"cartesian_{_GENERATOR}_joint_velocity_discontinuity"),
    ("bool", f"cartesian_{_GENERATOR}_joint_acceleration_discontinuity"),
    ("bool", f"cartesian_position_{_GENERATOR}_invalid_frame force_controller_desired_force_tolerance_violation"),
    ("bool", "controller_torque_discontinuity start_elbow_sign_inconsistent communication_constraints_violation"),
    ("bool", "power_limit_violation"),
]
#: Franka's flags: 33 in ROS 1, three more in ROS 2.
_ERRORS = _fields(
    [*_ERRORS_ROS1, ("bool", "joint_p2p_insufficient_torque_for_planning tau_j_range_violation instability_detected")]
)
_MODE = [("uint8", "robot_mode"), ("franka_msgs/Errors", "current_errors last_motion_errors")]
FRANKA_ROS1 = _fields(
    [
        ("std_msgs/Header", "header"), (_SIX, "cartesian_collision cartesian_contact"),
        (_SEVEN, "q q_d dq dq_d theta dtheta tau_J dtau_J tau_J_d"), (_SIX, "K_F_ext_hat_K"), (_TWO, "elbow elbow_d"),
        (_SEVEN, "joint_collision joint_contact"), (_SIX, "O_F_ext_hat_K"), (_SEVEN, "tau_ext_hat_filtered"),
        ("float64", "m_ee"), ("float64[3]", "F_x_Cee"), ("float64[9]", "I_ee"),
        ("float64", "m_load"), ("float64[3]", "F_x_Cload"), ("float64[9]", "I_load"),
        ("float64", "m_total"), ("float64[3]", "F_x_Ctotal"), ("float64[9]", "I_total"),
        (_POSE, "O_T_EE O_T_EE_d F_T_EE EE_T_K"), ("float64", "time"), *_MODE,
    ]
)  # fmt: skip
FRANKA_ROS2_FIRST = _fields(
    [
        ("std_msgs/Header", "header"), (_SIX, "cartesian_collision cartesian_contact"),
        (_SEVEN, "q q_d dq dq_d ddq_d theta dtheta tau_j dtau_j tau_j_d"), (_SIX, "k_f_ext_hat_k"),
        (_TWO, "elbow elbow_d elbow_c delbow_c ddelbow_c"), (_SEVEN, "joint_collision joint_contact"),
        (_SIX, "o_f_ext_hat_k o_dp_ee_d o_dp_ee_c o_ddp_ee_c"), (_SEVEN, "tau_ext_hat_filtered"),
        ("float64", "m_ee"), ("float64[3]", "f_x_cee"), ("float64[9]", "i_ee"),
        ("float64", "m_load"), ("float64[3]", "f_x_cload"), ("float64[9]", "i_load"),
        ("float64", "m_total"), ("float64[3]", "f_x_ctotal"), ("float64[9]", "i_total"),
        (_POSE, "o_t_ee o_t_ee_d o_t_ee_c f_t_ee ee_t_k"), ("float64", "time control_command_success_rate"), *_MODE,
    ]
)  # fmt: skip
FRANKA_ROS2 = _fields(
    [
        ("std_msgs/Header", "header"), ("franka_msgs/CollisionIndicators", "collision_indicators"),
        ("sensor_msgs/JointState", "measured_joint_state desired_joint_state measured_joint_motor_state"),
        (_SEVEN, "ddq_d dtau_j"), ("sensor_msgs/JointState", "tau_ext_hat_filtered"), ("franka_msgs/Elbow", "elbow"),
        ("geometry_msgs/WrenchStamped", "k_f_ext_hat_k o_f_ext_hat_k"),
        ("geometry_msgs/InertiaStamped", "inertia_ee inertia_load inertia_total"),
        ("geometry_msgs/PoseStamped", "o_t_ee o_t_ee_d o_t_ee_c f_t_ee ee_t_k"),
        ("geometry_msgs/TwistStamped", "o_dp_ee_d o_dp_ee_c"), ("geometry_msgs/AccelStamped", "o_ddp_ee_c"),
        ("float64", "time control_command_success_rate"), *_MODE,
    ]
)  # fmt: skip
_POINT, _MULTI = "trajectory_msgs/JointTrajectoryPoint", "trajectory_msgs/MultiDOFJointTrajectoryPoint"
_NOW, _BEFORE = "reference feedback error output", "desired actual"


def _multi(names: str) -> str:
    return " ".join(f"multi_dof_{name}" for name in names.split())


_TRAJECTORY = [("std_msgs/Header", "header"), ("string[]", "joint_names")]
_LBR = [
    ("float64", "sample_time"),
    ("int8", "session_state connection_quality safety_state operation_mode drive_state client_command_mode"),
    ("int8", "overlay_type control_mode"), ("uint32", "time_stamp_sec time_stamp_nano_sec"),
]  # fmt: skip
_LBR_OLD = "measured_joint_position commanded_joint_position measured_torque commanded_torque external_torque"
_LBR_NEW = _LBR_OLD.replace("commanded_joint_position ", "")
_AXES = " ".join(f"a{i}" for i in range(1, 8))

#: What the types refer to.
PARTS = {
    "franka_msgs/msg/Errors": _ERRORS,
    "franka_msgs/msg/CollisionIndicators": _fields(
        [
            ("geometry_msgs/Vector3", "is_cartesian_linear_collision is_cartesian_angular_collision"),
            ("geometry_msgs/Vector3", "is_cartesian_linear_contact is_cartesian_angular_contact"),
            (_SEVEN, "is_joint_collision is_joint_contact"),
        ]
    ),
    "franka_msgs/msg/Elbow": _fields(
        [(_TWO, "position desired_position commanded_position commanded_velocity commanded_acceleration")]
    ),
    "iiwa_msgs/msg/Axes": _fields([("float64", _AXES)]),
    "iiwa_msgs/msg/JointQuantity": _fields([("float32", _AXES)]),
}
CONTROLLER_STATE = "control_msgs/msg/JointTrajectoryControllerState"
CONTROLLER_NOW = _fields([*_TRAJECTORY, (_POINT, _NOW), ("string[]", "multi_dof_joint_names"), (_MULTI, _multi(_NOW))])
CONTROLLER_BOTH = _fields(
    [
        *_TRAJECTORY, (_POINT, f"{_NOW} {_BEFORE}"), ("string[]", "multi_dof_joint_names"),
        (_MULTI, _multi(f"{_NOW} {_BEFORE}")),
    ]
)  # fmt: skip
CONTROLLER_ROS1 = _fields([*_TRAJECTORY, (_POINT, f"{_BEFORE} error")])
UR_REAL_TIME = _fields(
    [
        ("float64", "time"), ("float64[]", "q_target qd_target qdd_target i_target m_target"),
        ("float64[]", "q_actual qd_actual i_actual"),
        ("float64[]", "tool_acc_values tcp_force tool_vector tcp_speed"), ("float64", "digital_input_bits"),
        ("float64[]", "motor_temperatures"), ("float64", "controller_timer test_value robot_mode"),
        ("float64[]", "joint_modes"),
    ]
)  # fmt: skip
LBR_IDL = _fields([*_LBR, (_SEVEN, f"{_LBR_NEW} ipo_joint_position"), ("float64", "tracking_performance")])
LBR_MSGS = _fields([*_LBR, (_SEVEN, f"{_LBR_OLD} ipo_joint_position"), ("float64", "tracking_performance")])


def iiwa(quantity: str, axes: str) -> str:
    """A type of one quantity; the numbers were ``JointQuantity`` (float32) first and are ``Axes`` since."""
    return _fields([("std_msgs/Header", "header"), (f"iiwa_msgs/{axes}", quantity)])
