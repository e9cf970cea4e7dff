"""Reading the real logs: same recording in three containers, refusals, quantities split over files."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest

from collaudit.core.config.schema import LogConfig
from collaudit.core.errors import LogError
from collaudit.core.logs.inputs import expand_inputs, group_inputs
from collaudit.core.logs.log_description import describe
from collaudit.core.logs.log_guess import guess_csv_columns
from collaudit.core.logs.log_reading import read_log

pytestmark = pytest.mark.real

DEFAULT = LogConfig()
UR = ("shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "wrist_2_joint", "wrist_3_joint")
UR3_NAMES = dict(zip(("Base", "Shoulder", "Elbow", "Wrist 1", "Wrist 2", "Wrist 3"), UR, strict=True))


@pytest.mark.parametrize(
    ("reference", "others"),
    [
        ("ur3_bags/id1.bag", ("ur3_mcap_ros2", "ur3_mcap_ros1/ur3_id1_ros1profile.mcap")),
        ("kuka_lwr_bag/test.bag", ("kuka_mcap_ros2", "kuka_mcap_ros2/kuka_lwr_honeypot_rosbag2_mcap.mcap")),
    ],
)
def test_one_recording_reads_the_same_from_every_container(
    data_dir: Path, reference: str, others: tuple[str, ...]
) -> None:
    first = read_log((data_dir / reference,), DEFAULT, robot_joints=None)
    for name in others:
        other = read_log((data_dir / name,), DEFAULT, robot_joints=None)
        assert other.joint_names == first.joint_names
        for field in ("time_s", "position_rad", "velocity_rad_s", "effort"):
            np.testing.assert_array_equal(getattr(other, field), getattr(first, field))
        assert other.source.start_ns == first.source.start_ns
        assert [f.code for f in other.findings] == [f.code for f in first.findings]


def test_ur3_names_are_mapped_and_signs_applied_where_asked(data_dir: Path) -> None:
    plain = read_log((data_dir / "ur3_bags/id1.bag",), DEFAULT, robot_joints=None)
    settings = LogConfig.of({"joint_names": UR3_NAMES, "units": {"effort_sign": {"elbow_joint": -1, "Wrist 3": -1}}})
    mapped = read_log((data_dir / "ur3_bags/id1.bag",), settings, robot_joints=tuple(reversed(UR)))
    assert mapped.joint_names == tuple(reversed(UR))
    assert plain.effort is not None
    assert mapped.effort is not None
    np.testing.assert_array_equal(mapped.position_rad, plain.position_rad[:, ::-1])
    np.testing.assert_array_equal(mapped.effort, plain.effort[:, ::-1] * [-1, 1, 1, -1, 1, 1])


def test_unmapped_names_are_refused_with_both_lists_and_the_key_to_set(data_dir: Path) -> None:
    with pytest.raises(LogError) as caught:
        read_log((data_dir / "ur3_bags/id1.bag",), DEFAULT, robot_joints=UR)
    text = caught.value.render()
    assert "'Wrist 1'" in text
    assert "wrist_3_joint" in text
    assert "[log] joint_names" in text


@pytest.mark.parametrize(
    ("name", "samples", "rate", "start"),
    [
        ("ur10_db3/ur10_exciting_trajectory.db3", 3441, 125.0, None),
        ("panda_db3/panda_exciting_trajectory.db3", 727, 30.0, None),
    ],
)
def test_lone_db3_without_metadata(data_dir: Path, name: str, samples: int, rate: float, start: int | None) -> None:
    log = read_log((data_dir / name,), DEFAULT, robot_joints=None)
    assert log.time_s.shape == (samples,)
    assert np.isfinite(log.position_rad).all()
    assert log.source.start_ns == start
    (topic,) = describe((data_dir / name,)).topics
    assert topic.count == samples
    assert topic.rate_hz == pytest.approx(rate, rel=1e-3)
    assert topic.has_velocity
    assert topic.has_effort


def test_tiago_files_are_one_log(data_dir: Path) -> None:
    (group,) = group_inputs(expand_inputs([data_dir / "tiago_csv"]), DEFAULT)
    assert [path.name for path in group] == ["tiago_effort.csv", "tiago_position.csv", "tiago_velocity.csv"]
    log = read_log(group, DEFAULT, robot_joints=None)
    assert log.joint_names[0] == "torso_lift_joint"
    assert log.time_s.shape == (8022,)
    assert {"log-guessed"} <= {finding.code for finding in log.findings}
    guess = guess_csv_columns(group)
    assert guess is not None
    config, joints = guess.csv, guess.joints
    assert (config.time, config.position, config.effort) == ("t", "{joint}_position", "{joint}_effort")
    assert joints == log.joint_names


@pytest.mark.parametrize("name", ["not_a_robot_log_db3", "not_a_robot_log_db3/validation_trajectory.db3"])
def test_a_log_of_something_else_is_refused_with_what_it_holds(data_dir: Path, name: str) -> None:
    with pytest.raises(LogError, match="no topic with joint states") as caught:
        read_log((data_dir / name,), DEFAULT, robot_joints=UR)
    assert "/joint_space_trajectory (trajectory_msgs/msg/JointTrajectory)" in caught.value.render()
    (topic,) = describe((data_dir / name,)).topics
    assert (topic.role, topic.count) == ("other", 1)


def test_a_csv_without_positions_is_refused_with_its_columns(data_dir: Path) -> None:
    path = data_dir / "ur3_cobotops_csv/dataset_02052023.csv"
    with pytest.raises(LogError, match="no columns of joint positions") as caught:
        read_log((path,), DEFAULT, robot_joints=UR)
    assert "Current_J0" in caught.value.render()
    summary = describe((path,))
    assert "Robot_ProtectiveStop" in summary.csv_columns
    assert "decimal comma" in summary.topics[0].encoding
    assert asdict(summary)["format"] == "csv"


@pytest.mark.parametrize(
    "name", ["ur3_bags/id1.bag", "ur3_mcap_ros1/ur3_id1_ros1profile.mcap", "ur10_db3/ur10_exciting_trajectory.db3"]
)
def test_a_truncated_log_keeps_what_is_before_the_cut(data_dir: Path, name: str, tmp_path: Path) -> None:
    whole = (data_dir / name).read_bytes()
    cut = tmp_path / Path(name).name
    cut.write_bytes(whole[: int(len(whole) * 0.6)])
    full = read_log((data_dir / name,), DEFAULT, robot_joints=None)
    part = read_log((cut,), DEFAULT, robot_joints=None)
    count = part.time_s.shape[0]
    assert 0.4 < count / full.time_s.shape[0] < 0.75
    np.testing.assert_array_equal(part.position_rad, full.position_rad[:count])
    (finding, *_) = [finding for finding in part.findings if finding.code == "log-partial"]
    assert finding.severity == "error"


def test_an_empty_file_is_refused(tmp_path: Path) -> None:
    empty = tmp_path / "x.bag"
    empty.touch()
    with pytest.raises(LogError, match="the file is empty"):
        read_log((empty,), DEFAULT, robot_joints=None)
