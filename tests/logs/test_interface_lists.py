"""Lists of interfaces (DynamicJointState, JSON of the same form): one value an item, and items that are no joints."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import log_writers as w
import numpy as np
import pytest
from mcap.writer import Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from collaudit.core.config.schema import LogConfig
from collaudit.core.data.joint_log import JointLog
from collaudit.core.errors import ConfigError, LogError
from collaudit.core.logs.log_description import describe
from collaudit.core.logs.log_reading import read_log

KIND, COUNT = "control_msgs/msg/DynamicJointState", 40
NAMES = ("a", "b", "c")
Items = list[tuple[str, dict[str, float]]]


@pytest.fixture(scope="module")
def store() -> object:
    made = get_typestore(Stores.ROS2_HUMBLE)
    for name, text in (
        ("control_msgs/msg/InterfaceValue", "string[] interface_names\nfloat64[] values\n"),
        (KIND, "std_msgs/Header header\nstring[] joint_names\ncontrol_msgs/InterfaceValue[] interface_values\n"),
    ):
        made.register(get_types_from_msg(text, name))
    return made


def joints(k: int, effort: str = "effort") -> Items:
    return [(name, {"position": 0.01 * k + j, "velocity": 0.1, effort: 5.0 * j}) for j, name in enumerate(NAMES)]


GPIO = ("gpio_1", {"digital_in_0": 1.0, "analog_out_1": 0.5})
SPEED = ("speed_scaling", {"speed_scaling_factor": 1.0})
FTS = ("tcp_fts", {f"{part}.{axis}": 1.0 for part in ("force", "torque") for axis in "xyz"})
GRIPPER = ("finger", {"position": 0.02})
EMPTY = ("empty", {})


def ros(path: Path, store: object, items: Callable[[int], Items]) -> Path:
    kind, item = store.types[KIND], store.types["control_msgs/msg/InterfaceValue"]  # type: ignore[attr-defined]
    said = []
    for k in range(COUNT):
        stamp = w.EPOCH + k * w.PERIOD
        values = [item(interface_names=list(held), values=np.array([*held.values()])) for _, held in items(k)]
        names = [name for name, _ in items(k)]
        value = kind(header=w.header(store, stamp), joint_names=names, interface_values=values)
        said.append(w.Said("/dynamic_joint_states", KIND, stamp, value))
    return w.write_mcap(path, said, store=store)


def as_json(path: Path, items: Callable[[int], Items]) -> Path:
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        schema = writer.register_schema(KIND, "jsonschema", b"{}")
        channel = writer.register_channel("/dynamic_joint_states", "json", schema)
        for k in range(COUNT):
            stamp = w.EPOCH + k * w.PERIOD
            head = {"stamp": {"sec": stamp // 10**9, "nanosec": stamp % 10**9}}
            values = [{"interface_names": [*held], "values": [*held.values()]} for _, held in items(k)]
            message = {"header": head, "joint_names": [name for name, _ in items(k)], "interface_values": values}
            writer.add_message(channel, stamp, json.dumps(message).encode(), stamp)
        writer.finish()
    return path


@pytest.fixture(params=["ros", "json"])
def written(request: pytest.FixtureRequest, store: object, tmp_path: Path) -> Callable[[Callable[[int], Items]], Path]:
    if request.param == "ros":
        return lambda items: ros(tmp_path / "x.mcap", store, items)
    return lambda items: as_json(tmp_path / "x.mcap", items)


def check(log: JointLog, effort: np.ndarray) -> None:
    np.testing.assert_allclose(log.position_rad, 0.01 * np.arange(COUNT)[:, None] + np.arange(3))
    assert log.effort is not None
    np.testing.assert_array_equal(log.effort, np.tile(effort, (COUNT, 1)))


@pytest.mark.parametrize(
    "besides",
    [[GPIO], [SPEED, FTS], [GRIPPER], [GPIO, GRIPPER, EMPTY, SPEED], [EMPTY]],
    ids=["gpio", "speed and force", "gripper without effort", "all of them", "empty"],
)
@pytest.mark.parametrize("first", [True, False])
def test_items_that_are_no_joints_cost_nothing(written, besides: Items, first: bool) -> None:
    path = written(lambda k: [*besides, *joints(k)] if first else [*joints(k), *besides])
    check(read_log((path,), LogConfig(), robot_joints=NAMES), np.array([0.0, 5.0, 10.0]))
    (topic,) = describe((path,)).topics
    assert set(topic.joints) == {*NAMES} | ({"finger"} if GRIPPER in besides else set())


@pytest.mark.parametrize("lacking", range(3))
def test_a_joint_without_effort_has_none(written, lacking: int) -> None:
    def items(k: int) -> Items:
        held = joints(k)
        del held[lacking][1]["effort"]
        return [*held, GPIO]

    effort = np.array([0.0, 5.0, 10.0])
    effort[lacking] = np.nan
    check(read_log((written(items),), LogConfig(), robot_joints=NAMES), effort)


def test_an_effort_may_be_called_torque(written) -> None:
    check(
        read_log((written(lambda k: [GPIO, *joints(k, "torque")]),), LogConfig(), robot_joints=NAMES),
        5.0 * np.arange(3),
    )


def test_an_effort_called_current_needs_constants(written) -> None:
    path = written(lambda k: [*joints(k, "current"), SPEED])
    with pytest.raises(ConfigError, match="currents"):
        read_log((path,), LogConfig(), robot_joints=NAMES)
    units = LogConfig.of({"units": {"torque_constant_nm_per_a": dict.fromkeys(NAMES, 2.0)}})
    check(read_log((path,), units, robot_joints=NAMES), 10.0 * np.arange(3))
    assert describe((path,)).topics[0].currents


def test_interfaces_may_come_in_another_order_in_each_message(written) -> None:
    path = written(lambda k: [(name, dict(reversed(held.items()))) for name, held in joints(k)] if k % 2 else joints(k))
    check(read_log((path,), LogConfig(), robot_joints=NAMES), 5.0 * np.arange(3))


def test_a_message_of_no_joints_at_all_is_refused(written) -> None:
    with pytest.raises(LogError, match="names no joints"):
        read_log((written(lambda k: [GPIO, FTS]),), LogConfig(), robot_joints=NAMES)


def said_by_name(
    path: Path, words: tuple[str, ...], *, alone: bool = False, turned: bool = False, mark: str = "/"
) -> Path:
    """JointState with a name for each joint and interface; ``alone``: all values in the array of positions."""
    said = []
    for k in range(COUNT):
        values = {"position": 0.01 * k + np.arange(3), "velocity": 0.1 + np.zeros(3), "effort": 5.0 * np.arange(3)}
        pairs = [(j, q, word) for j in range(3) for q, word in zip(values, words, strict=True)]
        pairs = pairs[::-1] if turned and k % 2 else pairs
        names = [f"{NAMES[j]}{mark}{word}" for j, _, word in pairs]
        columns = [[values[q][j] if alone or q == own else np.nan for j, q, _ in pairs] for own in values]
        said.append(w.joint_state(names, columns[0], *([] if alone else columns[1:]), stamp_ns=w.EPOCH + k * w.PERIOD))
    return w.write_mcap(path, said)


@pytest.mark.parametrize("effort", ["effort", "torque"])
@pytest.mark.parametrize("form", [{}, {"alone": True}, {"turned": True}, {"alone": True, "turned": True}])
def test_names_of_joint_and_interface_are_understood(tmp_path: Path, effort: str, form: dict[str, bool]) -> None:
    path = said_by_name(tmp_path / "x.mcap", ("position", "velocity", effort), **form)
    for robot in (NAMES, None):
        check(read_log((path,), LogConfig(), robot_joints=robot), 5.0 * np.arange(3))
    assert describe((path,)).topics[0].joints in (NAMES, NAMES[::-1])


@pytest.mark.parametrize("mark", ["/", ".", "_"])
@pytest.mark.parametrize(
    "words", [("position", "velocity", "effort"), ("pos", "vel", "tau"), ("angle", "speed", "torque")]
)
def test_other_words_behind_a_joint_are_understood(tmp_path: Path, mark: str, words: tuple[str, str, str]) -> None:
    path = said_by_name(tmp_path / "x.mcap", words, mark=mark)
    check(read_log((path,), LogConfig(), robot_joints=NAMES), 5.0 * np.arange(3))


def test_names_of_currents_are_currents(tmp_path: Path) -> None:
    path = said_by_name(tmp_path / "x.mcap", ("position", "velocity", "current"), alone=True)
    with pytest.raises(ConfigError, match="currents"):
        read_log((path,), LogConfig(), robot_joints=NAMES)


def test_joints_with_a_path_in_their_names_stay_joints(tmp_path: Path) -> None:
    names = [f"arm/{name}" for name in NAMES]
    said = [w.joint_state(names, [k, 1, 2], [], [3, 4, 5], stamp_ns=w.EPOCH + k * w.PERIOD) for k in range(COUNT)]
    assert describe((w.write_mcap(tmp_path / "x.mcap", said),)).topics[0].joints == tuple(names)
