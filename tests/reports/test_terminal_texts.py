"""Tables of demo, self-test and logs: what was found beside what is true, and nothing invented."""

from __future__ import annotations

from collaudit.core.logs.log_summary import LogSummary, TopicInfo
from collaudit.reports.terminal.command_texts import LevelRow, PushRow, TruthRow, checks_text, demo_text
from collaudit.reports.terminal.screen_text import log_text


def test_the_demo_shows_what_was_missed() -> None:
    text = demo_text(
        [TruthRow("joint1", "A_nm", 7.1, 7.02, (6.9, None), True), TruthRow("joint1", "B_nm", 2.5, None, (), None)],
        [PushRow("A", 3, 28.0, "joint1", 0.026, 0.0314, 9.21), PushRow("B", 4, 41.0, None, None, None, None)],
        [LevelRow("A", "joint1", 0.987, 0), LevelRow("B", "joint1", None, 1)],
    )
    lines = [" ".join(line.split()) for line in text.splitlines()]
    assert "joint1 A_nm 7.1 7.02 6.9 to open yes" in lines
    assert "joint1 B_nm 2.5 not identifiable" in lines
    assert "A link 3 at 28 s yes, on joint1 26 ms 31 ms 9.2" in lines
    assert "B link 4 at 41 s no" in lines
    assert "0.99 N·m; no false alarms." in text
    assert "unknown; 1 false alarm." in text


def test_the_self_test_counts_what_passed() -> None:
    text = checks_text([(True, "seven", "friction", "3 %", "1 %"), (False, "seven", "pushes", "2 of 2", "1 of 2")])
    assert [line.split()[0] for line in text.splitlines()[2:4]] == ["ok", "WRONG"]
    assert text.endswith("\n1 of 2 checks passed\n")


def test_a_log_is_described_with_its_topics_and_joints() -> None:
    topic = TopicInfo("/joint_states", "sensor_msgs/msg/JointState", "cdr", 1000, 80.0, ("a", "b"), role="joint_states")
    summary = LogSummary("run.mcap", "mcap-ros2", 1_234_000, 1_700_000_000_000_000_000, 12.5, (topic,))
    lines = log_text(summary).splitlines()
    assert lines[0] == "run.mcap  mcap-ros2, 1.2 MB  12.500 s  starts 2023-11-14 22:13:20 UTC"
    assert lines[3].split()[:4] == ["/joint_states", "sensor_msgs/msg/JointState", "joint", "states"]
    assert lines[4].startswith("  joints of /joint_states: a, b")
    assert all(len(line) <= 50 for line in log_text(summary, width=50).splitlines()[1:4])
