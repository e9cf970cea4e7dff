"""Message profiles: which fields of which types are joint signals or a wrench. Data, not code.

A path names a field of a message, dotted. Further forms:

- ``a|b``: the first of several that the type has and the message fills (other versions of a type);
- ``a,b,c``: several fields side by side;
- ``joints[*].position``: one field of every item of a sequence;
- of joint names only, ``names&items[*].interfaces``: each name with each interface that its item lists; items with none
  of motion and effort are no joints;
- of an annotation only, ``mode==6,7``: it holds while the number is one of these, else while it is not zero.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.vendors.vendor_words import CURRENTS, FRANKA_MODE, QUANTITY_WORDS, UR_ROBOT_MODE, UR_SAFETY_MODE

#: Stands before the name of an annotation where quantities are named.
ANNOTATION = "annotation:"
#: Words behind a joint's name, such as the interfaces of ros2_control, to quantities.
INTERFACES = {word: "current" if word in CURRENTS else quantity for quantity in ("position", "velocity", "effort")
              for word in QUANTITY_WORDS[quantity] if len(word) > 1} | {"temperature": "temperature"}  # fmt: skip
Role = Literal["joint_states", "wrench", "label", "phase", "other"]


@dataclass(frozen=True, slots=True)
class Profile:
    """How to read one family of message types.

    Attributes:
        name: what ``inspect`` calls it.
        role: ``joint_states``, ``wrench``, or for annotations and phases on topics of their own ``label``, ``phase``;
            ``other`` where nothing is read.
        types: the message types it reads.
        stamp: paths of the stamp's seconds and nanoseconds, or None.
        names: path of the joint names, or None where the type has none.
        fixed_names: names in the order of the arrays, where the type has none of its own; ``{i}`` counts from 1.
        position, velocity, effort: paths of (j,) numbers.
        temperature: path of (j,) numbers, °C, where the type has them.
        joint_torque: path of (j,) torques behind the gears, N·m, beside the drives' effort.
        current: path of (j,) currents of the drives, A, which are the effort where there is no other.
        wrench: path of the six numbers, force then torque.
        annotations: name to path of numbers that are not zero while it holds (a controller's own alarms).
        family: name of a set of types that each hold one quantity on sibling topics; "" for none.
    """

    name: str
    role: Role
    types: tuple[str, ...]
    stamp: str | None = "header.stamp.sec,header.stamp.nanosec"
    names: str | None = None
    fixed_names: tuple[str, ...] = ()
    position: str | None = None
    velocity: str | None = None
    effort: str | None = None
    current: str | None = None
    wrench: str | None = None
    temperature: str | None = None
    joint_torque: str | None = None
    annotations: tuple[tuple[str, str], ...] = ()
    family: str = ""

    def quantities(self) -> dict[str, str]:
        """Quantity (annotations with ``ANNOTATION`` in front) to field path, of those the profile has."""
        pairs = (
            ("position", self.position), ("velocity", self.velocity), ("effort", self.effort),
            ("current", self.current), ("wrench", self.wrench), ("temperature", self.temperature),
            ("joint_torque", self.joint_torque),
        )  # fmt: skip
        annotated = {f"{ANNOTATION}{name}": path.split("==")[0] for name, path in self.annotations}
        return {key: path for key, path in pairs if path is not None} | annotated

    def raised(self, annotation: str, values: FloatArray) -> BoolArray:
        """Where an annotation holds, by the values of its field."""
        _, equals, wanted = dict(self.annotations)[annotation].partition("==")
        if not equals:
            return np.asarray(np.nan_to_num(values) != 0)
        return np.asarray(np.isin(values, [float(text) for text in wanted.split(",")]))

    def implied_names(self, count: int) -> tuple[str, ...]:
        """Joint names of ``count`` values where the message has none."""
        if len(self.fixed_names) == 1 and "{i}" in self.fixed_names[0]:
            return tuple(self.fixed_names[0].format(i=index + 1) for index in range(count))
        return self.fixed_names


def _wrench(prefix: str) -> str:
    return ",".join(f"{prefix}{part}.{axis}" for part in ("force", "torque") for axis in "xyz")


def _seven(prefix: str) -> str:
    return ",".join(f"{prefix}.a{index}" for index in range(1, 8))


def _modes(field: str, states: Mapping[int, str]) -> tuple[tuple[str, str], ...]:
    """An annotation for each state that a number stands for."""
    numbers = {state: [str(number) for number, other in states.items() if other == state] for state in states.values()}
    return tuple((state, f"{field}=={','.join(own)}") for state, own in numbers.items())


_FRANKA_STOPS = (
    *_modes("robot_mode", FRANKA_MODE),
    ("joint_reflex", "current_errors.joint_reflex"),
    ("cartesian_reflex", "current_errors.cartesian_reflex"),
)
_FRANKA_ALARMS = (("contact", "joint_contact"), ("collision", "joint_collision"), *_FRANKA_STOPS)
_UR_JOINTS = (
    "shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "wrist_2_joint", "wrist_3_joint",
)  # fmt: skip
_IIWA = ("iiwa_joint_{i}",)

PROFILES: tuple[Profile, ...] = (
    Profile(
        name="joint-state",
        role="joint_states",
        types=("sensor_msgs/msg/JointState",),
        names="name",
        position="position",
        velocity="velocity",
        effort="effort",
    ),
    Profile(
        name="wrench-stamped",
        role="wrench",
        types=("geometry_msgs/msg/WrenchStamped",),
        wrench=_wrench("wrench."),
    ),
    Profile(name="wrench", role="wrench", types=("geometry_msgs/msg/Wrench",), stamp=None, wrench=_wrench("")),
    Profile(
        name="trajectory-controller-state",
        role="joint_states",
        types=("control_msgs/msg/JointTrajectoryControllerState",),
        names="joint_names",
        position="feedback.positions|actual.positions",
        velocity="feedback.velocities|actual.velocities",
        effort="feedback.effort|actual.effort",
    ),
    Profile(
        name="dynamic-joint-state",
        role="joint_states",
        types=("control_msgs/msg/DynamicJointState",),
        names="joint_names&interface_values[*].interface_names",
        position="interface_values[*].values",
    ),
    Profile(
        name="franka-state",
        role="joint_states",
        types=("franka_msgs/msg/FrankaState",),
        fixed_names=("panda_joint{i}",),
        position="q",
        velocity="dq",
        effort="tau_J|tau_j",
        annotations=_FRANKA_ALARMS,
    ),
    Profile(
        name="franka-robot-state",
        role="joint_states",
        types=("franka_msgs/msg/FrankaRobotState",),
        names="measured_joint_state.name",
        position="measured_joint_state.position",
        velocity="measured_joint_state.velocity",
        effort="measured_joint_state.effort",
        annotations=(
            ("contact", "collision_indicators.is_joint_contact"),
            ("collision", "collision_indicators.is_joint_collision"),
            *_FRANKA_STOPS,
        ),
    ),
    Profile(
        name="ur-real-time",
        role="joint_states",
        types=("ur_msgs/msg/RobotStateRTMsg",),
        stamp=None,
        fixed_names=_UR_JOINTS,
        position="q_actual",
        velocity="qd_actual",
        current="i_actual",
    ),
    Profile(
        name="lbr-state",
        role="joint_states",
        types=("lbr_fri_idl/msg/LBRState", "lbr_fri_msgs/msg/LBRState"),
        stamp="time_stamp_sec,time_stamp_nano_sec",
        fixed_names=("lbr_A{i}",),
        position="measured_joint_position",
        effort="measured_torque",
    ),
    Profile(
        name="iiwa-position",
        role="joint_states",
        types=("iiwa_msgs/msg/JointPosition",),
        fixed_names=_IIWA,
        position=_seven("position"),
        family="iiwa",
    ),
    Profile(
        name="iiwa-velocity",
        role="joint_states",
        types=("iiwa_msgs/msg/JointVelocity",),
        fixed_names=_IIWA,
        velocity=_seven("velocity"),
        family="iiwa",
    ),
    Profile(
        name="iiwa-torque",
        role="joint_states",
        types=("iiwa_msgs/msg/JointTorque",),
        fixed_names=_IIWA,
        effort=_seven("torque"),
        family="iiwa",
    ),
    Profile(
        name="foxglove-joint-states",
        role="joint_states",
        types=("foxglove.JointStates", "foxglove_msgs/msg/JointStates"),
        stamp="timestamp.seconds,timestamp.nanos|timestamp.sec,timestamp.nsec|timestamp.sec,timestamp.nanosec",
        names="joints[*].name",
        position="joints[*].position",
        velocity="joints[*].velocity",
        effort="joints[*].effort",
    ),
    Profile(
        name="ur-safety-mode",
        role="label",
        types=("ur_dashboard_msgs/msg/SafetyMode",),
        stamp=None,
        annotations=_modes("mode", UR_SAFETY_MODE),
    ),
    Profile(
        name="ur-robot-mode",
        role="label",
        types=("ur_dashboard_msgs/msg/RobotMode",),
        stamp=None,
        annotations=_modes("mode", UR_ROBOT_MODE),
    ),
    Profile(
        name="ur-robot-mode-data",
        role="label",
        types=("ur_msgs/msg/RobotModeDataMsg",),
        stamp=None,
        annotations=(("protective_stop", "is_protective_stopped"), ("emergency_stop", "is_emergency_stopped")),
    ),
)
