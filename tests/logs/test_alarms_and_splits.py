"""Stop and collision flags of controllers as labels, temperatures by interface, split bags, `[log] msg_path`."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import log_writers as w
import numpy as np
import pytest
from mcap.writer import Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from collaudit.cli import main as entry
from collaudit.core.config.schema import LogConfig
from collaudit.core.data.joint_log import JointLog
from collaudit.core.errors import LogError
from collaudit.core.logs.log_reading import read_log

COUNT = 100
PERIOD_S = w.PERIOD / 1e9
DEFINITIONS = {
    "ur_dashboard_msgs/msg/SafetyMode": "uint8 mode\n",
    "ur_msgs/msg/RobotModeDataMsg": (
        "uint64 timestamp\nbool is_robot_connected\nbool is_protective_stopped\nbool is_emergency_stopped\n"
    ),
    "franka_msgs/msg/Errors": "bool joint_position_limits_violation\nbool joint_reflex\nbool cartesian_reflex\n",
    "franka_msgs/msg/CollisionIndicators": "float64[7] is_joint_contact\nfloat64[7] is_joint_collision\n",
    "franka_msgs/msg/FrankaRobotState": (
        "std_msgs/Header header\nfranka_msgs/CollisionIndicators collision_indicators\n"
        "sensor_msgs/JointState measured_joint_state\nfranka_msgs/Errors current_errors\nuint8 robot_mode\n"
    ),
    "control_msgs/msg/InterfaceValue": "string[] interface_names\nfloat64[] values\n",
    "control_msgs/msg/DynamicJointState": (
        "std_msgs/Header header\nstring[] joint_names\ncontrol_msgs/InterfaceValue[] interface_values\n"
    ),
}


@pytest.fixture(scope="module")
def store() -> Any:
    made = get_typestore(Stores.ROS2_HUMBLE)
    for name, text in DEFINITIONS.items():
        made.fielddefs.pop(name, None)
        made.register(get_types_from_msg(text, name))
    return made


def steady(k: float) -> int:
    return w.EPOCH + int(k * w.PERIOD)


def states(first: int = 0, count: int = COUNT, back_ns: int = 0) -> list[w.Said]:
    return [
        w.joint_state(("a", "b"), np.sin([k * PERIOD_S, 1.0]), effort=(1.0, 2.0), stamp_ns=steady(k) - back_ns)
        for k in range(first, first + count)
    ]


def read(path: Path, **settings: Any) -> JointLog:
    return read_log((path,), LogConfig.of(settings), robot_joints=None)


def labels(log: JointLog) -> dict[tuple[str, str | None], list[tuple[float, float]]]:
    return {(one.name, one.joint): [(round(a, 4), round(b, 4)) for a, b in one.intervals_s] for one in log.annotations}


@pytest.mark.parametrize(
    ("kind", "values", "expected"),
    [
        ("ur_dashboard_msgs/msg/SafetyMode", [{"mode": mode} for mode in (1, 3, 3, 1, 6)],
         {("protective_stop", None): 20, ("emergency_stop", None): 80}),
        ("ur_msgs/msg/RobotModeDataMsg",
         [{"timestamp": 0, "is_robot_connected": True, "is_protective_stopped": stop, "is_emergency_stopped": stop > 1}
          for stop in (0, 1, 1, 0, 2)],
         {("protective_stop", None): 20, ("emergency_stop", None): 80}),
    ],
    ids=["safety mode", "robot mode data"],
)  # fmt: skip
def test_stops_of_a_ur(kind: str, values: Sequence[Any], expected: dict[Any, int], store: Any, tmp_path: Path) -> None:
    said = [w.Said("/io", kind, steady(20 * k) + 1000, store.types[kind](**value)) for k, value in enumerate(values)]
    messages = sorted([*states(), *said], key=lambda one: one.log_ns)
    found = labels(read(w.write_mcap(tmp_path / "x.mcap", messages, store=store)))
    assert found.keys() == expected.keys()
    for name, first in expected.items():
        assert found[name][0][0] == pytest.approx(first * PERIOD_S, abs=1e-4)
    assert found["protective_stop", None][0][1] == pytest.approx(60 * PERIOD_S, abs=PERIOD_S * 25)


def test_reflexes_and_collisions_of_a_franka(store: Any, tmp_path: Path) -> None:
    kind, types = "franka_msgs/msg/FrankaRobotState", store.types
    names = [f"fr3_joint{i}" for i in range(1, 8)]

    def make(k: int) -> w.Said:
        hit = 40 <= k < 60
        touch, struck = np.eye(7)[3] * hit, np.eye(7)[3] * (45 <= k < 50)
        head = w.header(store, steady(k))
        state = types[w.JOINT_STATE](head, names, np.full(7, 0.01 * k), np.zeros(7), np.ones(7))
        flags = types["franka_msgs/msg/CollisionIndicators"](is_joint_contact=touch, is_joint_collision=struck)
        errors = types["franka_msgs/msg/Errors"](
            joint_position_limits_violation=False, joint_reflex=50 <= k < 70, cartesian_reflex=False
        )
        value = types[kind](
            header=head, collision_indicators=flags, measured_joint_state=state, current_errors=errors,
            robot_mode=4 if 50 <= k < 80 else 2,
        )  # fmt: skip
        return w.Said("/state", kind, steady(k), value)

    found = labels(read(w.write_mcap(tmp_path / "x.mcap", [make(k) for k in range(COUNT)], store=store)))
    assert found == {
        ("contact", "fr3_joint4"): [(0.08, 0.118)],
        ("collision", "fr3_joint4"): [(0.09, 0.098)],
        ("joint_reflex", None): [(0.1, 0.138)],
        ("reflex", None): [(0.1, 0.158)],
    }


@pytest.mark.parametrize("sensors", ["all", "some"])
def test_temperatures_of_dynamic_joint_states(sensors: str, store: Any, tmp_path: Path) -> None:
    """Those of all joints are read; where some joints have none, the motion is read all the same."""
    kind, item = "control_msgs/msg/DynamicJointState", store.types["control_msgs/msg/InterfaceValue"]

    def make(k: int) -> w.Said:
        interfaces = []
        for j in range(3):
            warm = ["temperature"] if sensors == "all" or j else []
            values = np.array([0.01 * k + j, 1.0 + j, *[30.0 + j + k / 8] * len(warm)])
            interfaces.append(item(interface_names=["position", "effort", *warm], values=values))
        head = w.header(store, steady(k))
        value = store.types[kind](header=head, joint_names=["a", "b", "c"], interface_values=interfaces)
        return w.Said("/dynamic", kind, steady(k), value)

    log = read(w.write_mcap(tmp_path / "x.mcap", [make(k) for k in range(COUNT)], store=store))
    steps = np.arange(COUNT)[:, None]
    np.testing.assert_allclose(log.position_rad, 0.01 * steps + np.arange(3))
    if sensors == "all":
        np.testing.assert_array_equal(log.temperature_c, 30.0 + np.arange(3) + steps / 8)
    else:
        assert log.temperature_c is None


@pytest.mark.parametrize("storage", ["sqlite3", "mcap"])
def test_a_clock_set_back_between_the_files_of_a_split_bag(storage: str, tmp_path: Path) -> None:
    parts = [states(0, 500), states(500, 500, back_ns=400_000_000)]
    folders = [w.write_folder(tmp_path / f"part{k}", part, storage=storage) for k, part in enumerate(parts)]
    for number, folder in enumerate(folders):
        file = w.storage_file(folder)
        file.rename(folders[0] / f"bag_{number}{file.suffix}")
        if number:
            (folders[0] / "metadata.yaml").write_text(
                "rosbag2_bagfile_information:\n  relative_file_paths:\n"
                + "".join(f"    - bag_{k}{file.suffix}\n" for k in range(2))
            )
    log = read(folders[0])
    (said,) = [one for one in log.findings if one.code == "log-clock"]
    assert "set back by 0.398 s" in said.text
    np.testing.assert_allclose(log.position_rad[:, 0], np.sin(np.arange(1000) * PERIOD_S))
    assert (np.diff(log.time_s) > 0).all()


@pytest.mark.parametrize("third", [None, b"no storage"], ids=["absent", "unreadable"])
def test_a_file_that_a_split_bag_lacks_is_said(third: bytes | None, tmp_path: Path) -> None:
    for k in range(2):
        w.write_mcap(tmp_path / f"bag_{k}.mcap", states(500 * k, 500))
    if third is not None:
        (tmp_path / "bag_2.mcap").write_bytes(third)
    names = "".join(f"    - bag_{k}.mcap\n" for k in range(3))
    (tmp_path / "metadata.yaml").write_text(f"rosbag2_bagfile_information:\n  relative_file_paths:\n{names}")
    log = read(tmp_path)
    assert log.time_s.size == 1000
    (said,) = [one for one in log.findings if one.code == "log-partial"]
    assert "bag_2.mcap" in said.text and said.severity == "error"


@pytest.mark.parametrize(
    "listed",
    [
        "    - bag_0.mcap\r\n\r\n    - bag_1.mcap\r\n",
        "    - bag_0.mcap\n \t\n    - bag_1.mcap\n",
        "    - bag_0.mcap\n    # the second half\n    - bag_1.mcap\n",
        "    [bag_0.mcap,\n     'bag_1.mcap']\n",
    ],
    ids=["CRLF", "blanks", "comment", "wrapped"],
)
def test_every_file_of_a_list_is_read_however_its_lines_stand(listed: str, tmp_path: Path) -> None:
    for k in range(2):
        w.write_mcap(tmp_path / f"bag_{k}.mcap", states(500 * k, 500))
    (tmp_path / "metadata.yaml").write_bytes(f"rosbag2_bagfile_information:\n  relative_file_paths:\n{listed}".encode())
    log = read(tmp_path)
    assert log.time_s.size == 1000 and not [one for one in log.findings if one.code == "log-partial"]


def test_a_file_that_the_list_of_a_split_bag_leaves_out_is_said(tmp_path: Path) -> None:
    for k in range(2):
        w.write_mcap(tmp_path / f"bag_{k}.mcap", states(500 * k, 500))
    (tmp_path / "metadata.yaml").write_text("rosbag2_bagfile_information:\n  relative_file_paths:\n    - bag_0.mcap\n")
    log = read(tmp_path)
    assert log.time_s.size == 500
    (said,) = [one for one in log.findings if one.code == "log-partial"]
    assert "bag_1.mcap" in said.text and said.severity == "error"


@pytest.mark.parametrize("storage_id", [None, "", "sqlite3", "mcap"])
@pytest.mark.parametrize("storage", ["sqlite3", "mcap"])
def test_what_a_bag_is_stored_in_is_told_by_its_bytes(storage: str, storage_id: str | None, tmp_path: Path) -> None:
    """Without metadata, with an empty or another storage identifier."""
    folder = w.write_folder(tmp_path / "bag", states(0, 500), storage=storage)
    metadata = folder / "metadata.yaml"
    if storage_id is None:
        metadata.unlink()
    else:
        told = f"storage_identifier: '{storage_id}'"
        metadata.write_text(metadata.read_text().replace(f"storage_identifier: {storage}", told))
        assert told in metadata.read_text()
    log = read(folder)
    assert log.time_s.size == 500
    said = [one.severity for one in log.findings if one.code == "log-partial"]
    assert said == (["warning"] if storage_id is None else [])


@pytest.mark.parametrize("name", ["renamed_0", "bag (1)", "bag_0.copy"])
def test_a_bag_whose_file_was_renamed_is_read_and_said(name: str, tmp_path: Path) -> None:
    folder = w.write_folder(tmp_path / "bag", states(0, 500), storage="mcap")
    file = w.storage_file(folder)
    file.rename(folder / f"{name}.mcap")
    log = read(folder)
    assert log.time_s.size == 500
    (said,) = [one for one in log.findings if one.code == "log-partial"]
    assert said.severity == "warning" and name in said.text, "all of it is there"


@pytest.mark.parametrize("storage", ["sqlite3", "mcap"])
def test_a_bag_without_messages_is_refused(storage: str, tmp_path: Path) -> None:
    with pytest.raises(LogError, match="has no topic with joint states"):
        read(w.write_folder(tmp_path / "bag", [], storage=storage))


def test_definitions_from_a_folder_on_the_command_line(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Without `[log] msg_path` the type is named as missing; with it the joints are there."""
    folder = tmp_path / "defs" / "lbr_fri_idl" / "msg"
    folder.mkdir(parents=True)
    (folder / "LBRState.msg").write_text(
        "uint32 time_stamp_sec\nuint32 time_stamp_nano_sec\n"
        "float64[7] measured_joint_position\nfloat64[7] measured_torque\n"
    )
    path = tmp_path / "log.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start(profile="ros2")
        channel = writer.register_channel("/state", "cdr", writer.register_schema("lbr_fri_idl/msg/LBRState", "", b""))
        for k in range(COUNT):
            stamp = np.array([5, k * w.PERIOD], dtype="<u4").tobytes()
            data = b"\x00\x01\x00\x00" + stamp + (np.arange(14) + k / 10).tobytes()
            writer.add_message(channel, steady(k), data, steady(k))
        writer.finish()

    def inspected(code: int, *more: str) -> dict[str, Any]:
        capfd.readouterr()
        assert entry.run(["inspect", str(path), "--json", *more]) == code
        (log,) = json.loads(capfd.readouterr().out)["logs"]
        (topic,) = log["topics"]
        return dict(topic)

    without = inspected(3)
    assert not without["readable"] and "missing" in without["note"]
    found = inspected(0, "--set", f'log.msg_path=["{tmp_path / "defs"}"]')
    assert found["readable"] and "lbr-state" in found["note"] and len(found["joints"]) == 7
    assert entry.run(["inspect", str(path), "--set", f'log.msg_path=["{tmp_path / "absent"}"]']) == 2
    assert "Traceback" not in capfd.readouterr().err
