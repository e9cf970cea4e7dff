"""Types by their whole public definitions: what was measured is read, and nothing desired, commanded or estimated."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import log_writers as w
import numpy as np
import public_definitions as p
import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from collaudit.core.config.schema import LogConfig
from collaudit.core.logs.log_reading import read_log
from collaudit.core.logs.topics.log_topics import profile_of

COUNT = 25
CURRENT = {"torque_constant_nm_per_a": dict.fromkeys(profile_of("ur_msgs/msg/RobotStateRTMsg").fixed_names, 1.0)}
MEASURED = ("measured_joint_state.position", "measured_joint_state.velocity", "measured_joint_state.effort")
FEEDBACK = ("feedback.positions", "feedback.velocities", "feedback.effort")
ACTUAL = ("actual.positions", "actual.velocities", "actual.effort")
LBR = ("measured_joint_position", None, "measured_torque")
#: Case: type, definition, joints, fields that hold what was measured, arrays that stay empty.
CASES: dict[str, tuple[str, str, int, tuple[str | None, ...], str]] = {
    "franka-ros1": ("franka_msgs/msg/FrankaState", p.FRANKA_ROS1, 7, ("q", "dq", "tau_J"), ""),
    "franka-ros2-first": ("franka_msgs/msg/FrankaState", p.FRANKA_ROS2_FIRST, 7, ("q", "dq", "tau_j"), ""),
    "franka-ros2": ("franka_msgs/msg/FrankaRobotState", p.FRANKA_ROS2, 7, MEASURED, ""),
    "controller-now": (p.CONTROLLER_STATE, p.CONTROLLER_NOW, 6, FEEDBACK, ""),
    "controller-both": (p.CONTROLLER_STATE, p.CONTROLLER_BOTH, 6, FEEDBACK, ""),
    "controller-both-old": (p.CONTROLLER_STATE, p.CONTROLLER_BOTH, 6, ACTUAL, "feedback"),
    "controller-ros1": (p.CONTROLLER_STATE, p.CONTROLLER_ROS1, 6, ACTUAL, ""),
    "ur": ("ur_msgs/msg/RobotStateRTMsg", p.UR_REAL_TIME, 6, ("q_actual", "qd_actual", "i_actual"), ""),
    "lbr": ("lbr_fri_idl/msg/LBRState", p.LBR_IDL, 7, LBR, ""),
    "lbr-old": ("lbr_fri_msgs/msg/LBRState", p.LBR_MSGS, 7, LBR, ""),
}  # fmt: skip


class Filler:
    """Messages whose numbers are all different, made by the definition alone."""

    def __init__(self, definitions: dict[str, str], joints: int, empty: str = "") -> None:
        self.store = get_typestore(Stores.ROS2_HUMBLE)
        for name, text in definitions.items():
            self.store.fielddefs.pop(name, None)
            self.store.register(get_types_from_msg(text, name))
        self.joints = joints
        self.empty = empty
        self.rng = np.random.default_rng(5)

    def message(self, name: str, stamp_ns: int, path: str = "") -> Any:
        if name == "std_msgs/msg/Header":
            return w.header(self.store, stamp_ns)
        fields = {}
        for key, desc in self.store.fielddefs[name][1]:
            here = f"{path}.{key}".strip(".")
            stamp = {"time_stamp_sec": stamp_ns // 10**9, "time_stamp_nano_sec": stamp_ns % 10**9, "robot_mode": 2}
            fields[key] = stamp[key] if key in stamp else self.value(desc, stamp_ns, here)
        return self.store.types[name](**fields)

    def value(self, desc: Any, stamp_ns: int, path: str) -> Any:
        kind, inner = int(desc[0]), desc[1]
        if kind == 2:
            return self.message(inner, stamp_ns, path)
        if kind == 1:
            return self.scalar(inner[0])
        item, length = inner
        if int(item[0]) == 1 and item[1][0] == "string":
            return [] if "multi_dof" in path else [f"arm_joint_{k + 1}" for k in range(self.joints)]
        if int(item[0]) == 2:
            return []
        count = length if kind == 3 else 0 if self.empty and path.startswith(self.empty) else self.joints
        zero = any(word in path for word in ("collision", "contact"))
        return np.zeros(count) if zero else self.rng.normal(0, 0.1, count)

    def scalar(self, kind: str) -> Any:
        if kind == "string":
            return ""
        return 0 if kind == "bool" else float(self.rng.normal(0, 0.1)) if kind.startswith("float") else 1


def field(message: Any, path: str) -> np.ndarray[Any, Any]:
    for name in path.split("."):
        message = getattr(message, name)
    return np.asarray(message)


@pytest.mark.parametrize("case", CASES)
def test_only_what_was_measured_is_read(case: str, tmp_path: Path) -> None:
    kind, text, joints, paths, empty = CASES[case]
    filler = Filler({**p.PARTS, kind: text}, joints, empty)
    stamps = [w.EPOCH + k * w.PERIOD for k in range(COUNT)]
    messages = [filler.message(kind, stamp) for stamp in stamps]
    said = [w.Said("/state", kind, stamp, message) for stamp, message in zip(stamps, messages, strict=True)]
    path = w.write_mcap(tmp_path / "log.mcap", said, store=filler.store)
    settings = LogConfig.of({"units": CURRENT} if case == "ur" else {})
    log = read_log((path,), settings, robot_joints=None)
    assert len(log.joint_names) == joints
    for values, where in zip((log.position_rad, log.velocity_rad_s, log.effort), paths, strict=True):
        if where is None:
            assert values is None
        else:
            assert values is not None
            np.testing.assert_array_equal(values, [field(message, where) for message in messages], err_msg=where)
    assert not [finding for finding in log.findings if finding.code == "log-left-out"]


@pytest.mark.parametrize("axes", ["JointQuantity", "Axes"])
def test_iiwa_quantities_of_both_eras(axes: str, tmp_path: Path) -> None:
    kinds = {name: f"iiwa_msgs/msg/Joint{name}" for name in ("Position", "Velocity", "Torque")}
    definitions = {**p.PARTS, **{kind: p.iiwa(name.lower(), axes) for name, kind in kinds.items()}}
    filler = Filler(definitions, 7)
    said, expected = [], {name: [] for name in kinds}
    for k in range(COUNT):
        stamp = w.EPOCH + k * w.PERIOD
        for number, (name, kind) in enumerate(kinds.items()):
            message = filler.message(kind, stamp)
            said.append(w.Said(f"/iiwa/state/Joint{name}", kind, stamp + 1000 * number, message))
            inner = getattr(message, name.lower())
            expected[name].append([getattr(inner, f"a{axis}") for axis in range(1, 8)])
    log = read_log((w.write_mcap(tmp_path / "log.mcap", said, store=filler.store),), LogConfig(), robot_joints=None)
    found = {"Position": log.position_rad, "Velocity": log.velocity_rad_s, "Torque": log.effort}
    for name, values in found.items():
        assert values is not None
        np.testing.assert_allclose(values, expected[name], atol=1e-7, err_msg=name)
