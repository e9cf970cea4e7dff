"""Other message types, made by their definitions: each becomes the same joint log."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import log_writers as w
import numpy as np
import pytest
from foxglove_messages import foxglove_states
from mcap.writer import Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from collaudit.core.config.schema import LogConfig
from collaudit.core.data.joint_log import JointLog
from collaudit.core.errors import ConfigError
from collaudit.core.logs.log_description import describe
from collaudit.core.logs.log_reading import read_log

COUNT = 50
TRAJECTORY = "trajectory_msgs/JointTrajectoryPoint"
DEFINITIONS = {
    "control_msgs/msg/JointTrajectoryControllerState": (
        "std_msgs/Header header\nstring[] joint_names\ntrajectory_msgs/JointTrajectoryPoint reference\n"
        "trajectory_msgs/JointTrajectoryPoint feedback\ntrajectory_msgs/JointTrajectoryPoint error\n"
        "trajectory_msgs/JointTrajectoryPoint output\n"
    ),
    "control_msgs/msg/InterfaceValue": "string[] interface_names\nfloat64[] values\n",
    "control_msgs/msg/DynamicJointState": (
        "std_msgs/Header header\nstring[] joint_names\ncontrol_msgs/InterfaceValue[] interface_values\n"
    ),
    "franka_msgs/msg/FrankaState": (
        "std_msgs/Header header\nfloat64[6] cartesian_contact\nfloat64[7] q\nfloat64[7] q_d\nfloat64[7] dq\n"
        "float64[7] tau_J\nfloat64[7] joint_collision\nfloat64[7] joint_contact\nuint8 robot_mode\n"
    ),
    "franka_msgs/msg/FrankaRobotState": (
        "std_msgs/Header header\nsensor_msgs/JointState measured_joint_state\n"
        "sensor_msgs/JointState desired_joint_state\nuint8 robot_mode\n"
    ),
    "ur_msgs/msg/RobotStateRTMsg": (
        "float64 time\nfloat64[] q_target\nfloat64[] q_actual\nfloat64[] qd_actual\nfloat64[] i_actual\n"
    ),
    "lbr_fri_idl/msg/LBRState": (
        "int8 session_state\nuint32 time_stamp_sec\nuint32 time_stamp_nano_sec\n"
        "float64[7] measured_joint_position\nfloat64[7] measured_torque\n"
    ),
    "iiwa_msgs/msg/JointQuantity": "".join(f"float32 a{i}\n" for i in range(1, 8)),
    "iiwa_msgs/msg/JointPosition": "std_msgs/Header header\niiwa_msgs/JointQuantity position\n",
    "iiwa_msgs/msg/JointVelocity": "std_msgs/Header header\niiwa_msgs/JointQuantity velocity\n",
    "iiwa_msgs/msg/JointTorque": "std_msgs/Header header\niiwa_msgs/JointQuantity torque\n",
}


@pytest.fixture(scope="module")
def store() -> Any:
    made = get_typestore(Stores.ROS2_HUMBLE)
    for name, text in DEFINITIONS.items():
        if name not in made.fielddefs:
            made.register(get_types_from_msg(text, name))
    return made


def signals(joints: int) -> list[np.ndarray[Any, Any]]:
    base = np.arange(COUNT)[:, None] * 0.01 + np.arange(joints)
    return [np.sin(base), 0.01 * np.cos(base), 5 * base]


def header(store: Any, k: int) -> Any:
    return w.header(store, w.EPOCH + k * w.PERIOD)


def read(path: Path, settings: dict[str, Any] | None = None, robot: tuple[str, ...] | None = None) -> JointLog:
    return read_log((path,), LogConfig.of(settings or {}), robot_joints=robot)


def check(log: JointLog, names: tuple[str, ...], *, velocity: bool = True, atol: float = 0.0) -> None:
    position, speed, effort = signals(len(names))
    assert log.joint_names == names
    np.testing.assert_allclose(log.time_s, np.arange(COUNT) * w.PERIOD / 1e9, atol=1e-9)
    np.testing.assert_allclose(log.position_rad, position, rtol=0, atol=atol)
    assert log.effort is not None
    np.testing.assert_allclose(log.effort, effort, rtol=0, atol=atol * 100)
    if velocity:
        assert log.velocity_rad_s is not None
        np.testing.assert_allclose(log.velocity_rad_s, speed, rtol=0, atol=atol)
    else:
        assert log.velocity_rad_s is None


def write(path: Path, store: Any, kind: str, make: Any, topic: str = "/state") -> Path:
    said = [w.Said(topic, kind, w.EPOCH + k * w.PERIOD, make(k)) for k in range(COUNT)]
    return w.write_mcap(path, said, store=store)


@pytest.mark.parametrize("efforts", ["feedback", "output", "both", "none"])
@pytest.mark.parametrize("era", ["feedback", "actual"])
def test_trajectory_controller_state_of_both_eras(era: str, efforts: str, store: Any, tmp_path: Path) -> None:
    """What the controller puts out is no measured effort, with or without one beside it."""
    kind = "control_msgs/msg/JointTrajectoryControllerState"
    text = DEFINITIONS[kind]
    if era == "actual":
        text = text.replace("feedback", "actual").replace("reference", "desired")
    own = get_typestore(Stores.ROS2_HUMBLE)
    own.fielddefs.pop(kind, None)
    own.register(get_types_from_msg(text, kind))
    point = own.types["trajectory_msgs/msg/JointTrajectoryPoint"]
    zero = own.types["builtin_interfaces/msg/Duration"](sec=0, nanosec=0)
    none = np.empty(0)
    position, speed, effort = signals(3)

    def of(positions: Any, velocities: Any, efforts: Any) -> Any:
        return point(
            positions=positions, velocities=velocities, accelerations=none, effort=efforts, time_from_start=zero
        )

    def make(k: int) -> Any:
        measured = of(position[k], speed[k], effort[k] if efforts in ("feedback", "both") else none)
        put_out = of(none, none, 3.0 * effort[k] if efforts in ("output", "both") else none)
        first, second = ("reference", "feedback") if era == "feedback" else ("desired", "actual")
        fields = {first: of(none, none, none), second: measured, "error": of(none, none, none), "output": put_out}
        return own.types[kind](header=header(own, k), joint_names=["a", "b", "c"], **fields)

    log = read(write(tmp_path / "x.mcap", own, kind, make))
    if efforts in ("feedback", "both"):
        check(log, ("a", "b", "c"))
    else:
        np.testing.assert_allclose(log.position_rad, position)
        assert log.effort is None


def test_dynamic_joint_state_by_interface_name(store: Any, tmp_path: Path) -> None:
    kind = "control_msgs/msg/DynamicJointState"
    item = store.types["control_msgs/msg/InterfaceValue"]
    columns = dict(zip(("position", "velocity", "effort"), signals(3), strict=True))

    def make(k: int) -> Any:
        order = ["effort", "position", "velocity"] if k % 2 else ["velocity", "temperature", "position", "effort"]
        values = [
            item(interface_names=order, values=np.array([columns[o][k, j] if o in columns else 30.0 for o in order]))
            for j in range(3)
        ]
        return store.types[kind](header=header(store, k), joint_names=["a", "b", "c"], interface_values=values)

    check(read(write(tmp_path / "x.mcap", store, kind, make)), ("a", "b", "c"))


def test_franka_state_numbers_its_joints(store: Any, tmp_path: Path) -> None:
    kind = "franka_msgs/msg/FrankaState"
    position, speed, effort = signals(7)
    six, seven = np.zeros(6), np.zeros(7)

    def make(k: int) -> Any:
        return store.types[kind](
            header=header(store, k), cartesian_contact=six, q=position[k], q_d=seven, dq=speed[k], tau_J=effort[k],
            joint_collision=seven, joint_contact=np.eye(7)[2] * (10 <= k < 20), robot_mode=2,
        )  # fmt: skip

    path = write(tmp_path / "x.mcap", store, kind, make)
    check(read(path), tuple(f"panda_joint{i}" for i in range(1, 8)))
    robot = tuple(f"fr3_joint{i}" for i in range(1, 8))
    log = read(path, robot=robot)
    check(log, robot)
    assert "log-guessed" in {finding.code for finding in log.findings}
    (label,) = [finding for finding in log.findings if "contact" in finding.text]
    assert (label.joint, label.start_s, label.end_s) == ("panda_joint3", 0.02, 0.038)
    assert label.is_fact
    assert "franka-state" in describe((path,)).topics[0].note


def test_franka_robot_state(store: Any, tmp_path: Path) -> None:
    kind = "franka_msgs/msg/FrankaRobotState"
    position, speed, effort = signals(7)
    names = [f"fr3_joint{i}" for i in range(1, 8)]

    def make(k: int) -> Any:
        inner = store.types[w.JOINT_STATE]
        state = inner(header=header(store, k), name=names, position=position[k], velocity=speed[k], effort=effort[k])
        return store.types[kind](
            header=header(store, k), measured_joint_state=state, desired_joint_state=state, robot_mode=2
        )

    check(read(write(tmp_path / "x.mcap", store, kind, make)), tuple(names))


def test_ur_real_time_efforts_are_currents(store: Any, tmp_path: Path) -> None:
    kind = "ur_msgs/msg/RobotStateRTMsg"
    position, speed, effort = signals(6)

    def make(k: int) -> Any:
        return store.types[kind](
            time=0.1 * k, q_target=np.zeros(6), q_actual=position[k], qd_actual=speed[k], i_actual=effort[k]
        )

    path = write(tmp_path / "x.mcap", store, kind, make)
    with pytest.raises(ConfigError, match="currents"):
        read(path)
    names = read(path, {"units": {"effort": "raw"}}).joint_names
    assert names[0] == "shoulder_pan_joint"
    check(read(path, {"units": {"torque_constant_nm_per_a": dict.fromkeys(names, 1.0)}}), names)


def test_lbr_state_has_its_own_stamp(store: Any, tmp_path: Path) -> None:
    kind = "lbr_fri_idl/msg/LBRState"
    position, _, effort = signals(7)

    def make(k: int) -> Any:
        stamp = w.EPOCH + k * w.PERIOD
        return store.types[kind](
            session_state=4, time_stamp_sec=stamp // 10**9, time_stamp_nano_sec=stamp % 10**9,
            measured_joint_position=position[k], measured_torque=effort[k],
        )  # fmt: skip

    log = read(write(tmp_path / "x.mcap", store, kind, make))
    check(log, tuple(f"lbr_A{i}" for i in range(1, 8)), velocity=False)
    assert log.source.time_source == "header"


def test_iiwa_quantities_on_three_topics(store: Any, tmp_path: Path) -> None:
    quantity = store.types["iiwa_msgs/msg/JointQuantity"]
    said = []
    for k in range(COUNT):
        parts = zip(("Position", "Velocity", "Torque"), signals(7), strict=True)
        for number, (name, values) in enumerate(parts):
            kind = f"iiwa_msgs/msg/Joint{name}"
            inner = quantity(**{f"a{j + 1}": float(values[k, j]) for j in range(7)})
            value = store.types[kind](header=header(store, k), **{name.lower(): inner})
            stamp = w.EPOCH + k * w.PERIOD + 1000 * number
            said.append(w.Said(f"/iiwa/state/Joint{name}", kind, stamp, value))
    path = w.write_mcap(tmp_path / "x.mcap", said, store=store)
    check(read(path), tuple(f"iiwa_joint_{i}" for i in range(1, 8)), atol=1e-6)


@pytest.mark.parametrize("encoding", ["protobuf", "json"])
@pytest.mark.parametrize("velocity", [True, False])
def test_foxglove_joint_states(encoding: str, velocity: bool, tmp_path: Path) -> None:
    kind, schema = foxglove_states()
    position, speed, effort = signals(3)
    path = tmp_path / "x.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        named = "jsonschema" if encoding == "json" else "protobuf"
        number = writer.register_schema("foxglove.JointStates", named, b"{}" if encoding == "json" else schema)
        channel = writer.register_channel("/joints", encoding, number)
        for k in range(COUNT):
            stamp = w.EPOCH + k * w.PERIOD
            joints = [
                {"name": name, "position": position[k, j], "effort": effort[k, j]}
                | ({"velocity": speed[k, j]} if velocity else {})
                for j, name in enumerate("abc")
            ]
            if encoding == "json":
                whole = {"timestamp": {"sec": stamp // 10**9, "nsec": stamp % 10**9}, "joints": joints}
                data = json.dumps(whole).encode()
            else:
                message = kind(joints=joints)
                message.timestamp.seconds, message.timestamp.nanos = divmod(stamp, 10**9)
                data = message.SerializeToString()
            writer.add_message(channel, stamp + 5000, data, stamp)
        writer.finish()
    log = read(path)
    check(log, ("a", "b", "c"), velocity=velocity)
    assert log.source.time_source == "header"
    assert describe((path,)).topics[0].readable


def test_a_broken_protobuf_definition_is_a_note(tmp_path: Path) -> None:
    path = tmp_path / "x.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        channel = writer.register_channel(
            "/joints", "protobuf", writer.register_schema("foxglove.JointStates", "protobuf", b"\xff\xfe")
        )
        writer.add_message(channel, w.EPOCH, b"\x01", w.EPOCH)
        writer.finish()
    (topic,) = describe((path,)).topics
    assert not topic.readable
    assert "cannot be understood" in topic.note
