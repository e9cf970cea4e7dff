"""Labels and phases of logs, message definitions from folders, clocks set back, publishers that disagree."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import log_writers as w
import numpy as np
import pytest
from mcap.writer import Writer

from collaudit.core.conditioning.timebase import MAX_VOID_S, make_timebase
from collaudit.core.config.schema import LogConfig
from collaudit.core.data.joint_log import JointLog
from collaudit.core.errors import ConfigError, LogError
from collaudit.core.logs.log_description import describe
from collaudit.core.logs.log_reading import read_log

PERIOD_S = w.PERIOD / 1e9
NAMES = ("joint1", "joint2")


def said(topic: str, kind: str, k: float, **values: Any) -> w.Said:
    return w.Said(topic, kind, w.EPOCH + int(k * w.PERIOD), w.ROS2.types[kind](**values))


def states(count: int, at: Callable[[int], int], offset: float = 0.0, **more: Any) -> list[w.Said]:
    return [
        w.joint_state(NAMES, offset + np.sin([k * PERIOD_S, 1.0]), stamp_ns=at(k), effort=(1.0, 2.0), **more)
        for k in range(count)
    ]


def steady(k: int) -> int:
    return w.EPOCH + k * w.PERIOD


def read(path: Path, **settings: Any) -> JointLog:
    return read_log((path,), LogConfig.of(settings), robot_joints=None)


def codes(log: JointLog) -> set[str]:
    return {finding.code for finding in log.findings}


@pytest.fixture(scope="module")
def marked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    messages = states(400, steady)
    messages += [said("/bumper", "std_msgs/msg/Bool", k, data=100.2 < k < 150.2) for k in np.arange(0.5, 400, 10)]
    messages += [said("/phase", "std_msgs/msg/String", k, data=word) for k, word in ((0, "approach"), (200, "contact"))]
    messages += [said("/step", "std_msgs/msg/Int32", k, data=number) for k, number in ((0, 3), (100, 7), (300, 3))]
    messages.sort(key=lambda one: one.log_ns)
    return w.write_mcap(tmp_path_factory.mktemp("marked") / "log.mcap", messages)


def test_labels_of_a_topic(marked: Path) -> None:
    log = read(marked, labels=["/bumper", "/step:data==7"])
    bumper, step = log.annotations
    assert (bumper.name, bumper.source, step.name, step.source) == ("bumper", "/bumper", "data==7", "/step")
    np.testing.assert_allclose(bumper.intervals_s, [(100.5 * PERIOD_S, 150.5 * PERIOD_S)], atol=1e-9)
    np.testing.assert_allclose(step.intervals_s, [(100 * PERIOD_S, 300 * PERIOD_S)], atol=1e-9)
    assert any("The log itself says bumper" in finding.text for finding in log.findings)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"labels": ["/step:speed"]}, "hold no number at speed|cannot be read as a label"),
        ({"phase": "/nothing"}, r"\[log\] phase: the log has no topic /nothing"),
        ({"wrench": "/nothing"}, r"wrench: the log has no topic /nothing"),
        ({"joint_states": "/nothing"}, r"joint_states: the log has no topic /nothing"),
    ],
)
def test_a_topic_that_is_named_and_absent_is_refused(marked: Path, settings: dict[str, Any], words: str) -> None:
    with pytest.raises(LogError, match=words) as caught:
        read(marked, **settings)
    assert caught.value.exit_code == 3


@pytest.mark.parametrize(
    "settings",
    [
        *({key: "nothing{i}"} for key in ("position", "velocity", "effort", "temperature")),
        {"time": "nothing"},
        {"wrench": ["nothing", "b", "c", "d", "e", "f"]},
    ],
    ids=str,
)
def test_a_column_that_is_named_and_absent_is_refused(settings: dict[str, Any], tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("t,q1,tau1,hit\n" + "".join(f"{0.01 * k},{0.1 * k},1.5,0\n" for k in range(50)))
    read(path, labels=["hit"])
    stated = {"time": "t", "position": "q{i}", "effort": "tau{i}", **settings}
    with pytest.raises(LogError):
        read(path, csv=stated)


def test_a_phase_column_that_is_absent_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("t,q1,tau1\n" + "".join(f"{0.01 * k},{0.1 * k},1.5\n" for k in range(50)))
    with pytest.raises(LogError, match="no columns 'nothing'"):
        read(path, phase="nothing")


def test_absent_labels_are_no_labels(marked: Path, tmp_path: Path) -> None:
    """A folder holds logs with and without them."""
    path = tmp_path / "log.csv"
    path.write_text("t,q1,hit\n" + "".join(f"{0.01 * k},{0.1 * k},0\n" for k in range(50)))
    of_table = read(path, labels=["hit", "nothing"])
    of_topics = read(marked, labels=["/bumper", "/nothing"])
    for log, names in ((of_table, ["hit"]), (of_topics, ["bumper"])):
        assert [label.name for label in log.annotations] == names
        assert [found.code for found in log.findings].count("log-label-missing") == 1


@pytest.mark.parametrize(
    ("no", "yes"), [("0.000000000000000000e+00", "1.000000000000000000e+00"), ("-0.0", "2"), ("NaN", "True"), ("", "x")]
)
def test_labels_are_compared_as_numbers(no: str, yes: str, tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    rows = [f"{k / 100},{k / 50},{yes if 20 <= k < 30 or k >= 80 else no}" for k in range(90)]
    path.write_text("t,q1,hit\n" + "\n".join(rows) + "\n")
    (hit,) = read(path, labels=["hit"]).annotations
    assert hit.intervals_s == ((0.2, 0.29), (0.8, 0.89))


@pytest.mark.parametrize("topic", ["/phase", "/step:data"])
def test_phases_of_a_topic(marked: Path, topic: str) -> None:
    log = read(marked, phase=topic)
    found = {phase.name: phase.intervals_s for phase in log.phases}
    end = 399 * PERIOD_S
    expected = {"approach": [(0, 0.4)], "contact": [(0.4, end)]}
    if topic != "/phase":
        expected = {"3": [(0, 0.2), (0.6, end)], "7": [(0.2, 0.6)]}
    assert found.keys() == expected.keys()
    for name, spans in expected.items():
        np.testing.assert_allclose(found[name], spans, atol=1e-9)


def test_labels_and_phases_of_a_table(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    rows = [f"{k / 100},{k / 50},{'true' if 20 <= k < 30 else ''},{'free' if k < 50 else 'contact'}" for k in range(90)]
    path.write_text("t,q1,hit,phase\n" + "\n".join(rows) + "\n")
    log = read(path, labels=["hit"], phase="phase")
    assert [(label.name, label.intervals_s) for label in log.annotations] == [("hit", ((0.2, 0.29),))]
    assert [(phase.name, phase.intervals_s) for phase in log.phases] == [
        ("free", ((0.0, 0.5),)), ("contact", ((0.5, 0.89),)),
    ]  # fmt: skip


def test_definitions_from_a_folder(tmp_path: Path) -> None:
    """A type of which the file holds no definition is read by the folder's, and is not without it."""
    folder = tmp_path / "defs" / "lbr_fri_idl" / "msg"
    folder.mkdir(parents=True)
    text = "uint32 time_stamp_sec\nuint32 time_stamp_nano_sec\nfloat64[7] measured_joint_position\n"
    (folder / "LBRState.msg").write_text(text + "float64[7] measured_torque\n")
    path = tmp_path / "log.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start(profile="ros2")
        channel = writer.register_channel("/state", "cdr", writer.register_schema("lbr_fri_idl/msg/LBRState", "", b""))
        for k in range(20):
            numbers = np.arange(14) + k / 10
            stamp = np.array([5, k * w.PERIOD], dtype="<u4").tobytes()
            writer.add_message(channel, steady(k), b"\x00\x01\x00\x00" + stamp + numbers.tobytes(), steady(k))
        writer.finish()
    (without,) = describe((path,)).topics
    assert not without.readable and "is missing" in without.note
    log = read(path, msg_path=[str(tmp_path / "defs")])
    np.testing.assert_array_equal(log.position_rad[3], np.arange(7) + 0.3)
    assert log.effort is not None
    (tmp_path / "empty").mkdir()
    for name, why in (("empty", "holds no"), ("absent", "no such folder")):
        with pytest.raises(ConfigError, match=why):
            read(path, msg_path=[str(tmp_path / name)])


def test_json_by_field_paths(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        schema = writer.register_schema("my.Robot", "jsonschema", b'{"type": "object"}')
        channel = writer.register_channel("/robot", "json", schema)
        for k in range(20):
            body = {"at": {"s": 7, "ns": k * w.PERIOD}, "arm": [{"id": "a", "q": k / 10}, {"id": "b", "q": 1.0}]}
            writer.add_message(channel, steady(k), json.dumps(body).encode(), steady(k))
        writer.finish()
    fields = {"names": "arm[*].id", "position": "arm[*].q", "stamp": "at.s,at.ns"}
    settings = LogConfig.of({"joint_states": "/robot", "fields": fields})
    log = read_log((path,), settings, robot_joints=None)
    assert log.joint_names == ("a", "b")
    np.testing.assert_array_equal(log.position_rad[:, 0], np.arange(20) / 10)
    (topic,) = describe((path,), settings).topics
    assert topic.readable and "[log.fields]" in topic.note


@pytest.mark.parametrize("clock", ["header", "log"])
def test_a_clock_set_back_is_a_break(tmp_path: Path, clock: str) -> None:
    at = lambda k: steady(k) - (1_000_000_000 if k >= 1000 else 0)  # noqa: E731
    forces = [w.wrench([k, 0, 0, 0, 0, 0], stamp_ns=at(k)) for k in range(2000)]
    messages = [one for pair in zip(states(2000, at), forces, strict=True) for one in pair]
    path = w.write_mcap(tmp_path / "log.mcap", messages)
    log = read(path, time=clock, wrench="/ft/wrench")
    assert "log-clock" in codes(log)
    assert (np.diff(log.time_s) > 0).all()
    np.testing.assert_allclose(log.position_rad[:, 0], np.sin(np.arange(2000) * PERIOD_S))
    assert log.time_s[1000] - log.time_s[999] == pytest.approx(10 * PERIOD_S)
    assert log.wrench is not None
    np.testing.assert_allclose(log.wrench.time_s, log.time_s)
    base = make_timebase(log.time_s, log.position_rad)
    assert [len(span) for span in base.grid] == [1000, 1000]


@pytest.mark.parametrize("container", ["mcap", "bag", "db3"])
def test_messages_of_several_sizes_keep_their_order(tmp_path: Path, container: str) -> None:
    """Sizes are decoded one after the other; that is no clock that goes back and forth."""
    encoding = "ros1" if container == "bag" else "cdr"
    messages = [
        w.joint_state(NAMES, (k, 1.0), stamp_ns=steady(k), frame="base" * (1 + k // 7 % 3), encoding=encoding)
        for k in range(900)
    ]
    if container == "db3":
        path = w.storage_file(w.write_folder(tmp_path / "log", messages))
    elif container == "bag":
        path = w.write_bag(tmp_path / "log.bag", messages, chunk_size=1 << 16)
    else:
        path = w.write_mcap(tmp_path / "log.mcap", messages, chunk_size=1 << 16)
    log = read(path)
    assert "log-clock" not in codes(log)
    np.testing.assert_array_equal(log.position_rad[:, 0], np.arange(900))
    np.testing.assert_allclose(log.time_s, np.arange(900) * PERIOD_S, atol=1e-12)


def test_stamps_astray_and_blocks_out_of_order_are_no_break(tmp_path: Path) -> None:
    astray = w.write_mcap(tmp_path / "a.mcap", states(500, lambda k: steady(k) + (9 * 10**9 if k == 200 else 0)))
    assert "log-clock" not in codes(read(astray, time="header"))
    turned = w.write_mcap(tmp_path / "b.mcap", states(500, lambda k: steady((k + 250) % 500)))
    log = read(turned)
    assert "log-clock" not in codes(log)
    assert (np.diff(log.time_s) > 0).all()


@pytest.mark.parametrize("shape", ["one channel", "two connections", "slower"])
def test_publishers_that_disagree(tmp_path: Path, shape: str) -> None:
    encoding = "ros1" if shape == "two connections" else "cdr"
    first = states(400, steady, encoding=encoding)
    second = states(400, lambda k: steady(k) + 900_000, 0.2, encoding=encoding)[:: 10 if shape == "slower" else 1]
    if shape == "two connections":
        path = two_connections(tmp_path / "log.bag", first, second)
        alike = two_connections(tmp_path / "alike.bag", first, first)
    else:
        path = w.write_mcap(tmp_path / "log.mcap", sorted([*first, *second], key=lambda one: one.log_ns))
        alike = w.write_mcap(tmp_path / "alike.mcap", first)
    (finding,) = [one for one in read(path).findings if one.code == "log-publishers-conflict"]
    assert finding.severity == "error"
    assert "log-publishers-conflict" not in codes(read(alike))


@pytest.mark.parametrize("shape", ["one channel", "two connections"])
@pytest.mark.parametrize(("quantity", "by"), [("effort", 4.0), ("position", 2e-3), ("nothing", 0.0)])
def test_publishers_that_disagree_a_little(tmp_path: Path, shape: str, quantity: str, by: float) -> None:
    """Efforts alone, or positions by less than 5 mrad: neither may be judged as the other; noise is no difference."""
    encoding = "ros1" if shape == "two connections" else "cdr"
    noise = np.random.default_rng(2).normal(0, [0.3, 1e-4], (400, 2))
    parts: list[list[w.Said]] = [[], []]
    for k in range(400):
        for number, part in enumerate(parts):
            position = np.array([np.sin(k * PERIOD_S), 1.0]) + noise[k, 1] + number * by * (quantity == "position")
            effort = np.array([10 * np.sin(k * PERIOD_S), 2.0]) + noise[k, 0] + number * by * (quantity == "effort")
            part.append(
                w.joint_state(NAMES, position, stamp_ns=steady(k) + 900_000 * number, effort=effort, encoding=encoding)
            )
    if shape == "two connections":
        path = two_connections(tmp_path / "log.bag", *parts)
    else:
        path = w.write_mcap(tmp_path / "log.mcap", sorted([*parts[0], *parts[1]], key=lambda one: one.log_ns))
    found = [one for one in read(path).findings if one.code == "log-publishers-conflict"]
    assert [f"different {quantity}s" in one.text for one in found] == ([] if quantity == "nothing" else [True])


def two_connections(path: Path, *parts: list[w.Said]) -> Path:
    with w.Bag1Writer(path) as writer:
        for number, messages in enumerate(parts):
            at = writer.add_connection("/joint_states", w.JOINT_STATE, typestore=w.ROS1, callerid=f"/n{number}")
            for one in messages:
                writer.write(at, one.log_ns, w.encode(one, "ros1"))
    return path


def test_a_gap_of_days_takes_no_memory() -> None:
    time_s = np.concatenate([np.arange(1000), np.arange(1000) + 3 * 86400 * 500]) * 0.002
    base = make_timebase(time_s, np.sin(time_s)[:, None])
    assert base.n < 2000 + 1.1 * MAX_VOID_S / 0.002
    grid_s = base.time_s
    assert (np.diff(grid_s) > 0).all()
    for raw, grid in zip(base.raw, base.grid, strict=True):
        np.testing.assert_allclose(grid_s[grid.slice], base.stamps_s[raw.slice], atol=1e-4)
