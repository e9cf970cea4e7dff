"""Definitions and messages in other forms: IDL with includes, big-endian, old bags, topics that do not decode."""

from __future__ import annotations

from pathlib import Path

import log_writers as w
import numpy as np
import pytest
from mcap.writer import Writer

from collaudit.cli.main import main
from collaudit.core.config.schema import LogConfig
from collaudit.core.errors import LogError
from collaudit.core.logs.log_description import describe
from collaudit.core.logs.log_reading import read_log

RULE = "=" * 80
IDL = f"""{RULE}
IDL: test_msgs/msg/ArmState
// generated from rosidl_adapter/resource/msg.idl.em

#include "std_msgs/msg/Header.idl"
#include "test_msgs/msg/Triple.idl"

module test_msgs {{
  module msg {{
    typedef double double__3[3];
    module ArmState_Constants {{
      const uint8 MODE_IDLE = 1;
    }};
    @verbatim (language="comment", text=
      "What the arm measures." "\\n"
      "# not a directive")
    struct ArmState {{
      std_msgs::msg::Header header;

      string<20> label;

      @unit (value="rad")
      double__3 q;

      test_msgs::msg::Triple torque;

      sequence<double> speed;
    }};
  }};
}};
{RULE}
IDL: std_msgs/msg/Header
#include "builtin_interfaces/msg/Time.idl"
module std_msgs {{
  module msg {{
    struct Header {{
      builtin_interfaces::msg::Time stamp;
      string frame_id;
    }};
  }};
}};
{RULE}
IDL: test_msgs/msg/Triple
module test_msgs {{
  module msg {{
    struct Triple {{
      double a;
      double b;
      double c;
    }};
  }};
}};
{RULE}
IDL: builtin_interfaces/msg/Time
module builtin_interfaces {{
  module msg {{
    struct Time {{
      int32 sec;
      uint32 nanosec;
    }};
  }};
}};
"""
MSG = "std_msgs/Header header\nstring label\nfloat64[3] q\ntest_msgs/Triple torque\nfloat64[] speed\n"
SETTINGS = LogConfig.of(
    {
        "joint_states": "/arm",
        "fields": {
            "position": "q", "velocity": "speed", "effort": "torque.a,torque.b,torque.c", "names": ["x", "y", "z"],
        },
    }
)  # fmt: skip


@pytest.mark.parametrize("little", [True, False], ids=["little", "big"])
@pytest.mark.parametrize("line_end", ["\n", "\r\n"])
def test_idl_with_includes(little: bool, line_end: str, tmp_path: Path) -> None:
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    store.register(get_types_from_msg("float64 a\nfloat64 b\nfloat64 c\n", "test_msgs/msg/Triple"))
    store.register(get_types_from_msg(MSG, "test_msgs/msg/ArmState"))
    signals = np.random.default_rng(1).normal(size=(20, 9))
    path = tmp_path / "log.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start(profile="ros2")
        schema = writer.register_schema("test_msgs/msg/ArmState", "ros2idl", IDL.replace("\n", line_end).encode())
        channel = writer.register_channel("/arm", "cdr", schema)
        for k, row in enumerate(signals):
            stamp = w.EPOCH + k * w.PERIOD
            value = store.types["test_msgs/msg/ArmState"](
                header=w.header(store, stamp), label="run", q=row[:3],
                torque=store.types["test_msgs/msg/Triple"](*row[6:].tolist()), speed=row[3:6],
            )  # fmt: skip
            data = store.serialize_cdr(value, "test_msgs/msg/ArmState", little_endian=little)
            writer.add_message(channel, stamp, bytes(data), stamp)
        writer.finish()
    log = read_log((path,), SETTINGS, robot_joints=None)
    assert log.joint_names == ("x", "y", "z")
    np.testing.assert_array_equal(log.position_rad, signals[:, :3])
    assert log.velocity_rad_s is not None and log.effort is not None
    np.testing.assert_array_equal(log.velocity_rad_s, signals[:, 3:6])
    np.testing.assert_array_equal(log.effort, signals[:, 6:])


@pytest.mark.parametrize("head", ["#ROSBAG V2.1", "#ROSRECORD V1.2", "#ROSRECORD V1.1", "#ROSLOG V1.1"])
@pytest.mark.parametrize("rest", [b"\x00\x01\x02 binary", b"/joint_states\n* text\n"])
def test_bags_of_other_versions_are_refused_by_their_version(head: str, rest: bytes, tmp_path: Path) -> None:
    path = tmp_path / "old.bag"
    path.write_bytes(head.encode() + b"\n" + rest * 20)
    with pytest.raises(LogError, match=f"version that is not read(.|\n)*{head}(.|\n)*rosbag fix"):
        read_log((path,), LogConfig(), robot_joints=None)
    with pytest.raises(LogError, match=head):
        describe((path,))


def inspected(path: Path, capsys: pytest.CaptureFixture[str]) -> tuple[int, str]:
    with pytest.raises(SystemExit) as caught:
        main(["inspect", str(path)])
    streams = capsys.readouterr()
    return int(caught.value.code or 0), streams.out + streams.err


def test_inspect_exits_3_where_no_message_of_the_joints_decodes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    said = w.motion(30, with_wrench=False)
    path = tmp_path / "log.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start(profile="ros2")
        schema = writer.register_schema(w.JOINT_STATE, "ros2msg", w.definition(w.JOINT_STATE, "cdr").encode())
        channel = writer.register_channel("/joint_states", "cdr", schema)
        for item in said:
            writer.add_message(channel, item.log_ns, b"\xff" * 40, item.log_ns)
        writer.finish()
    code, text = inspected(path, capsys)
    assert code == 3
    assert "30 messages; the first is refused" in text
    assert "30 of 30 messages were left out" in text
    code, _ = inspected(w.write_mcap(tmp_path / "good.mcap", said), capsys)
    assert code == 0
