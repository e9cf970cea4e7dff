"""Every container gives the same joint log, equal to what rosbags reads message by message."""

from __future__ import annotations

import hashlib
import pickle
from dataclasses import replace
from pathlib import Path
from typing import Any

import log_writers as w
import numpy as np
import pytest

from collaudit.core.config.schema import LogConfig
from collaudit.core.errors import ConfigError, LogError
from collaudit.core.logs import log_reading
from collaudit.core.logs.inputs import expand_inputs
from collaudit.core.logs.log_description import describe, describe_by_overview
from collaudit.core.logs.log_formats import open_messages
from collaudit.core.logs.log_reading import read_log
from collaudit.core.numeric import parallel

COUNT = 300
WITH_WRENCH = LogConfig.of({"wrench": "/ft/wrench"})


@pytest.fixture(scope="module")
def reference() -> dict[str, np.ndarray[Any, Any]]:
    states = [said.value for said in w.motion(COUNT) if said.type == w.JOINT_STATE]
    return {
        "time_s": np.arange(COUNT) * w.PERIOD / 1e9,
        "position_rad": np.array([m.position for m in states]),
        "velocity_rad_s": np.array([m.velocity for m in states]),
        "effort": np.array([m.effort for m in states]),
    }


@pytest.mark.parametrize("kind", w.KINDS)
def test_round_trip(kind: str, tmp_path: Path, reference: dict[str, np.ndarray[Any, Any]]) -> None:
    path = w.write_any(tmp_path, kind, lambda encoding: w.motion(COUNT, encoding=encoding))
    log = read_log((path,), WITH_WRENCH, robot_joints=None)
    for name, values in reference.items():
        np.testing.assert_array_equal(getattr(log, name), values)
    assert log.joint_names == tuple(f"joint{j + 1}" for j in range(6))
    assert log.source.start_ns == w.EPOCH
    assert log.source.time_source == "header"
    assert log.wrench is not None
    np.testing.assert_allclose(log.wrench.time_s, log.time_s + 1e-3, atol=1e-12)
    np.testing.assert_array_equal(log.wrench.wrench[:, 0], np.arange(COUNT) * w.PERIOD / 1e9)
    assert [finding.code for finding in log.findings] == ["fact"]
    assert not log.position_rad.flags.writeable


@pytest.mark.parametrize("kind", w.KINDS)
def test_describe(kind: str, tmp_path: Path) -> None:
    path = w.write_any(tmp_path, kind, lambda encoding: w.motion(COUNT, encoding=encoding))
    summary = describe((path,))
    wrench, joints = summary.topics
    assert (joints.name, joints.role, joints.count) == ("/joint_states", "joint_states", COUNT)
    assert joints.readable
    assert joints.rate_hz == pytest.approx(500, rel=0.01)
    assert (joints.has_velocity, joints.has_effort) == (True, True)
    assert (wrench.name, wrench.role, wrench.count) == ("/ft/wrench", "wrench", COUNT)
    assert summary.findings == ()


def test_a_copy_without_its_suffix_is_read_by_content(tmp_path: Path) -> None:
    path = w.write_bag(tmp_path / "log.bag", w.motion(20, encoding="ros1"))
    odd = path.rename(tmp_path / "upload-17")
    assert read_log((odd,), LogConfig(), robot_joints=None).source.format == "ros1-bag"
    assert expand_inputs([tmp_path]) == [odd]


def test_order_of_joints_may_change_between_messages(tmp_path: Path) -> None:
    names = ["a", "b", "c"]
    said = []
    for k in range(60):
        order = [0, 1, 2] if k % 3 else [2, 0, 1]
        said.append(
            w.joint_state([names[i] for i in order], [k + i / 10 for i in order], stamp_ns=w.EPOCH + k * w.PERIOD)
        )
    log = read_log((w.write_mcap(tmp_path / "x.mcap", said),), LogConfig(), robot_joints=("c", "a"))
    assert log.joint_names == ("c", "a")
    expected = np.arange(60)[:, None] + np.array([0.2, 0.0])
    np.testing.assert_allclose(log.position_rad, expected, rtol=0, atol=1e-12)
    assert log.velocity_rad_s is None
    assert log.effort is None
    codes = [finding.code for finding in log.findings]
    assert any("joints that the robot does not have" in finding.text for finding in log.findings)
    assert "log-effort-missing" in codes


def test_publishers_with_other_joints_are_merged_without_crossing_gaps(tmp_path: Path) -> None:
    said = []
    for k in range(400):
        said.append(w.joint_state(["arm1", "arm2"], [k, -k], [0, 0], [1, 2], stamp_ns=w.EPOCH + k * w.PERIOD))
        if k % 5 == 0 and not 100 <= k < 200:
            said.append(w.joint_state(["finger"], [k], stamp_ns=w.EPOCH + k * w.PERIOD, frame="gripper"))
    path = w.write_mcap(tmp_path / "x.mcap", said)
    log = read_log((path,), LogConfig(), robot_joints=("finger", "arm1", "arm2"))
    assert log.joint_names == ("finger", "arm1", "arm2")
    finger = log.position_rad[:, 0]
    inside = (np.arange(400) <= 95) | ((np.arange(400) >= 200) & (np.arange(400) <= 395))
    np.testing.assert_allclose(finger[inside], np.arange(400)[inside], atol=1e-6)
    assert np.isnan(finger[~inside]).all()
    assert log.effort is not None
    assert np.isnan(log.effort[:, 0]).all()
    assert any("were merged by name" in finding.text for finding in log.findings)


def test_messages_with_more_joints_later_lose_nothing(tmp_path: Path) -> None:
    said = [w.joint_state(["a", "b"], [k, k], stamp_ns=w.EPOCH + k * w.PERIOD) for k in range(50)]
    said += [w.joint_state(["b", "a", "c"], [k, k, k], stamp_ns=w.EPOCH + k * w.PERIOD) for k in range(50, 100)]
    log = read_log((w.write_mcap(tmp_path / "x.mcap", said),), LogConfig(), robot_joints=("a", "b", "c"))
    np.testing.assert_array_equal(log.position_rad[:, 0], np.arange(100))
    np.testing.assert_array_equal(log.position_rad[:, 1], np.arange(100))
    assert np.isnan(log.position_rad[:50, 2]).all()
    np.testing.assert_array_equal(log.position_rad[50:, 2], np.arange(50, 100))


def test_topic_is_chosen_by_the_robots_joints(tmp_path: Path) -> None:
    said = []
    for k in range(30):
        stamp = w.EPOCH + k * w.PERIOD
        said.append(w.joint_state(["a1", "a2"], [1, 1], stamp_ns=stamp, topic="/left"))
        said.append(w.joint_state(["b1", "b2"], [2, 2], stamp_ns=stamp, topic="/right"))
    path = w.write_mcap(tmp_path / "x.mcap", said)
    log = read_log((path,), LogConfig(), robot_joints=("b1", "b2"))
    assert log.source.topic == "/right"
    mapped = LogConfig.of({"joint_names": {"a1": "b1", "a2": "b2"}})
    with pytest.raises(ConfigError, match="several topics") as caught:
        read_log((path,), mapped, robot_joints=("b1", "b2"))
    assert "/left" in caught.value.render()
    assert "/right" in caught.value.render()
    chosen = LogConfig.of({"joint_states": "/left"})
    assert read_log((path,), chosen, robot_joints=None).position_rad[0, 0] == 1
    with pytest.raises(ConfigError, match="several topics"):
        read_log((path,), LogConfig(), robot_joints=None)
    with pytest.raises(LogError, match="the log has no topic /middle"):
        read_log((path,), LogConfig.of({"joint_states": "/middle"}), robot_joints=None)


def test_unknown_types_are_left_alone(tmp_path: Path) -> None:
    text = w.ROS2.types["std_msgs/msg/String"](data="hello")
    said = [*w.motion(20), w.Said("/chat", "std_msgs/msg/String", w.EPOCH, text)]
    path = w.write_mcap(tmp_path / "x.mcap", said)
    assert read_log((path,), LogConfig(), robot_joints=None).time_s.shape == (20,)
    chat = describe((path,)).topics[0]
    assert (chat.name, chat.role, chat.count) == ("/chat", "other", 1)


def test_a_configured_wrench_that_is_absent_is_refused(tmp_path: Path) -> None:
    path = w.write_mcap(tmp_path / "x.mcap", w.motion(20, with_wrench=False))
    with pytest.raises(LogError, match=r"which \[log\] wrench names"):
        read_log((path,), WITH_WRENCH, robot_joints=None)


def test_currents_need_constants_by_either_name(tmp_path: Path) -> None:
    path = w.write_mcap(tmp_path / "x.mcap", w.motion(20, joints=2, with_wrench=False))
    base = read_log((path,), LogConfig(), robot_joints=None)
    names = {"joint1": "shoulder", "joint2": "elbow"}
    settings = {"joint_names": names, "units": {"effort": "A", "torque_constant_nm_per_a": {"shoulder": 2.0}}}
    with pytest.raises(ConfigError, match="elbow") as caught:
        read_log((path,), LogConfig.of(settings), robot_joints=("shoulder", "elbow"))
    assert 'effort = "raw"' in caught.value.render()
    settings["units"] = {
        "effort": "A",
        "torque_constant_nm_per_a": {"shoulder": 2.0, "joint2": 3.0},
        "effort_sign": {"elbow": -1},
    }
    log = read_log((path,), LogConfig.of(settings), robot_joints=("shoulder", "elbow"))
    assert log.effort is not None
    assert base.effort is not None
    np.testing.assert_array_equal(log.effort, base.effort * [2.0, -3.0])
    settings["units"] = {"effort_sign": {"elbw": -1}}
    with pytest.raises(ConfigError, match="elbw"):
        read_log((path,), LogConfig.of(settings), robot_joints=("shoulder", "elbow"))


def test_degrees_but_not_for_prismatic_joints(tmp_path: Path) -> None:
    path = w.write_mcap(tmp_path / "x.mcap", w.motion(20, joints=2, with_wrench=False))
    base = read_log((path,), LogConfig(), robot_joints=None)
    degrees = LogConfig.of({"units": {"position": "deg"}})
    log = read_log((path,), degrees, robot_joints=("joint1", "joint2"), prismatic=("joint2",))
    np.testing.assert_allclose(log.position_rad, base.position_rad * [np.pi / 180, 1.0])


@pytest.mark.parametrize(("stamp", "why"), [(0, "always zero"), (w.EPOCH, "never changes")])
def test_a_dead_header_clock_gives_way_to_log_time(tmp_path: Path, stamp: int, why: str) -> None:
    said = [w.joint_state(["a"], [k], stamp_ns=stamp, log_ns=w.EPOCH + k * w.PERIOD) for k in range(40)]
    path = w.write_mcap(tmp_path / "x.mcap", said)
    log = read_log((path,), LogConfig(), robot_joints=None)
    assert log.source.time_source == "log"
    assert why in log.findings[0].text
    np.testing.assert_allclose(log.time_s, np.arange(40) * w.PERIOD / 1e9)
    with pytest.raises(LogError, match="cannot be used"):
        read_log((path,), LogConfig.of({"time": "header"}), robot_joints=None)


def test_no_message_is_dropped_in_silence(tmp_path: Path) -> None:
    said = w.motion(30, with_wrench=False)
    good = said[3].value
    said[3] = w.Said(
        said[3].topic, said[3].type, said[3].log_ns, type(good)(good.header, ["a"], *([good.position] * 3))
    )
    log = read_log((w.write_mcap(tmp_path / "x.mcap", said),), LogConfig(), robot_joints=None)
    assert log.time_s.shape == (29,)
    (finding,) = [f for f in log.findings if f.code == "log-left-out"]
    assert "1 of 30 messages" in finding.text
    assert "1 joint names and 6 values" in finding.text


def test_index_entries_left_out_by_the_writer_lose_no_message(tmp_path: Path) -> None:
    path = w.write_mcap(tmp_path / "x.mcap", w.motion(200), chunk_size=1 << 12)
    reader = open_messages([path])
    first = reader.chunks[0]  # type: ignore[attr-defined]
    data = bytearray(path.read_bytes())
    for _, at, size in first.index:
        data[at + 8 : at + size] = data[at : at + 8] * ((size - 8) // 8)
    path.write_bytes(bytes(data))
    assert read_log((path,), LogConfig(), robot_joints=None).time_s.shape == (200,)


def test_a_huge_mcap_is_described_by_its_summary(tmp_path: Path) -> None:
    path = w.write_mcap(tmp_path / "x.mcap", w.motion(COUNT))
    whole = describe((path,))
    short = describe_by_overview([path], least_bytes=0)
    assert short is not None
    assert [finding.is_fact for finding in short.findings] == [True]
    assert (short.start_ns, short.duration_s) == (whole.start_ns, whole.duration_s)
    for brief, full in zip(short.topics, whole.topics, strict=True):
        assert (brief.name, brief.count, brief.joints) == (full.name, full.count, full.joints)
        assert (brief.role, brief.has_effort) == (full.role, full.has_effort)
        assert brief.rate_hz == pytest.approx(full.rate_hz, rel=0.01)
        assert brief.largest_gap_s is None
    assert describe_by_overview([path]) is None
    bare = w.write_mcap(tmp_path / "y.mcap", w.motion(COUNT), summary=False)
    assert describe_by_overview([bare], least_bytes=0) is None


@pytest.mark.parametrize("stray_ns", [1, 9 * 10**18])
def test_a_summary_s_garbage_stamp_is_no_length(stray_ns: int, tmp_path: Path) -> None:
    said = w.motion(200)
    plain = describe_by_overview([w.write_mcap(tmp_path / "x.mcap", said, chunk_size=1 << 12)], least_bytes=0)
    stray = [*said[:90], replace(said[90], log_ns=stray_ns), *said[91:]]
    short = describe_by_overview([w.write_mcap(tmp_path / "y.mcap", stray, chunk_size=1 << 12)], least_bytes=0)
    assert plain is not None and short is not None
    assert short.duration_s == pytest.approx(plain.duration_s, rel=0.01)
    assert short.start_ns == plain.start_ns
    assert "none of this recording" in short.findings[0].text and "none of this" not in plain.findings[0].text


@pytest.mark.parametrize("storage", ["sqlite3", "mcap"])
def test_a_bag_folder_without_its_list_is_read_by_what_its_files_are(storage: str, tmp_path: Path) -> None:
    folder = w.write_folder(tmp_path / "bag", w.motion(COUNT), storage=storage)
    w.storage_file(folder).rename(folder / "storage")
    (folder / "metadata.yaml").write_text("")
    (folder / "other").write_bytes(b"#ROSBAG V2.0\n")  # another format, which ROS 2 does not store in
    log = read_log((folder,), LogConfig(), robot_joints=None)
    assert log.time_s.shape == (COUNT,)
    assert [finding.code for finding in log.findings if "storage was read" in finding.text] == ["log-partial"]


def test_the_hash_is_that_of_the_bytes_and_survives_a_copy(tmp_path: Path) -> None:
    """It is computed where it is asked for; copied or pickled it is the text."""
    path = tmp_path / "log.csv"
    path.write_text("t,q1\n" + "".join(f"{k / 100},{k / 10}\n" for k in range(50)))
    source = read_log((path,), LogConfig(), robot_joints=None).source
    copied = pickle.loads(pickle.dumps(source))
    assert source.sha256 == hashlib.sha256(path.read_bytes()).hexdigest() == copied.sha256 == copied.digest


def test_a_hash_that_nobody_wants_is_not_computed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "log.csv"
    path.write_text("t,q1\n" + "".join(f"{k / 100},{k / 10}\n" for k in range(50)))
    computed: list[object] = []
    monkeypatch.setattr(log_reading, "sha256_of", lambda paths: computed.append(paths) or "0" * 64)
    monkeypatch.setattr(parallel, "_threads", 1)  # with a second one it is begun beside the reading
    log = read_log((path,), LogConfig(), robot_joints=None)
    assert computed == []
    assert log.source.sha256 == log.source.sha256 == "0" * 64
    assert computed == [(path,)]
