"""Messages of makers' own types and JSON without a definition: the paths that are offered read the log."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import log_writers as w
import numpy as np
import pytest
from mcap.writer import Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from collaudit.core.config.schema import LogConfig
from collaudit.core.errors import LogError
from collaudit.core.logs.log_description import describe
from collaudit.core.logs.log_reading import read_log

COUNT = 40
ROBOT = ("a", "b", "c")


def signals(k: int) -> tuple[list[float], list[float], list[float]]:
    q = np.sin(0.01 * k + np.arange(3))
    return q.tolist(), (0.1 * q).tolist(), (5.0 * q).tolist()


FLAT = "float64[] joint_pos\nfloat64[] joint_vel\nfloat64[] joint_tor\nfloat64[] tool_pose\n"
DEFINITIONS = {
    "flat": ("std_msgs/Header header\nbool robot_link\n" + FLAT, {}),
    "commands beside": ("std_msgs/Header header\nfloat64[] joint_pos_cmd\nfloat64[] joint_tor_cmd\n" + FLAT, {}),
    "no header": (FLAT, {}),
    "other words": (
        "std_msgs/Header header\nfloat64[3] target_q\nfloat64[3] actual_q\nfloat64[3] actual_qd\nfloat64[3] tau\n",
        {"joint_pos": "actual_q", "joint_vel": "actual_qd", "joint_tor": "tau"},
    ),
}


def maker(path: Path, form: str) -> Path:
    text, words = DEFINITIONS[form]
    kind = "maker_msgs/msg/Feedback"
    store = get_typestore(Stores.ROS2_HUMBLE)
    store.register(get_types_from_msg(text, kind))
    own = [field for field, _ in store.fielddefs[kind][1]]
    said = []
    for k in range(COUNT):
        stamp, (q, dq, tau) = w.EPOCH + k * w.PERIOD, signals(k)
        known = {words.get("joint_pos", "joint_pos"): q, words.get("joint_vel", "joint_vel"): dq,
                 words.get("joint_tor", "joint_tor"): tau}  # fmt: skip
        fields: dict[str, Any] = {name: np.array(known.get(name, [9.0, 9.0, 9.0])) for name in own}
        fields |= {"header": w.header(store, stamp)} if "header" in own else {}
        fields |= {"robot_link": True} if "robot_link" in own else {}
        said.append(w.Said("/feedback", kind, stamp, store.types[kind](**fields)))
    return w.write_mcap(path, said, store=store)


def lists(k: int) -> dict[str, Any]:
    q, dq, tau = signals(k)
    return {"stamp": {"sec": 7, "nanosec": k * w.PERIOD}, "state": {"q": q, "dq": dq, "tau": tau, "tau_d": [0.0] * 3}}


def items(k: int) -> dict[str, Any]:
    rows = zip(ROBOT, *signals(k), strict=True)
    return {"arm": [{"name": name, "position": q, "velocity": v, "torque": tau} for name, q, v, tau in rows]}


def keyed(k: int) -> dict[str, Any]:
    rows = zip(ROBOT, *signals(k), strict=True)
    return {"t": 0.002 * k, "joints": {name: {"q": q, "dq": v, "tau": tau} for name, q, v, tau in rows}}


def counted(k: int) -> dict[str, Any]:
    return {f"{word}{j + 1}": value for word, row in zip(("q", "dq", "tau"), signals(k), strict=True)
            for j, value in enumerate(row)}  # fmt: skip


def as_json(path: Path, message: Callable[[int], dict[str, Any]]) -> Path:
    """JSON without any schema."""
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        channel = writer.register_channel("/feedback", "json", 0)
        for k in range(COUNT):
            stamp = w.EPOCH + k * w.PERIOD
            writer.add_message(channel, stamp, json.dumps(message(k)).encode(), stamp)
        writer.finish()
    return path


def stated(hint: str) -> dict[str, Any]:
    """What the lines of a hint say, as a person would write them into a file."""
    assert "say where they stand: " in hint, hint
    line = hint.partition("say where they stand: ")[2].partition("; or ")[0]
    return dict(tomllib.loads(line.replace("[log", "\n[log").replace("] ", "]\n").replace("; ", "\n"))["log"])


WRITERS: dict[str, Callable[[Path], Path]] = {
    **{form: (lambda path, form=form: maker(path, form)) for form in DEFINITIONS},  # type: ignore[misc]
    **{make.__name__: (lambda path, make=make: as_json(path, make)) for make in (lists, items, keyed, counted)},  # type: ignore[misc]
}


@pytest.mark.parametrize("form", WRITERS)
@pytest.mark.parametrize("chosen", [False, True], ids=["no topic stated", "topic stated"])
def test_the_paths_that_are_offered_read_the_log(tmp_path: Path, form: str, chosen: bool) -> None:
    path = WRITERS[form](tmp_path / "x.mcap")
    settings = LogConfig.of({"joint_states": "/feedback"} if chosen else {})
    with pytest.raises(LogError) as caught:
        read_log((path,), settings, robot_joints=ROBOT)
    log = read_log((path,), LogConfig.of(stated(caught.value.hint or "")), robot_joints=ROBOT)
    q, dq, tau = (np.array([signals(k)[n] for k in range(COUNT)]) for n in range(3))
    np.testing.assert_allclose(log.position_rad, q)
    assert log.velocity_rad_s is not None and log.effort is not None
    np.testing.assert_allclose(log.velocity_rad_s, dq)
    np.testing.assert_allclose(log.effort, tau)
    (topic,) = describe((path,)).topics
    assert topic.fields == stated(caught.value.hint or "")["fields"]


def odd(k: int) -> dict[str, Any]:
    return {
        "pose": [1.0, 2.0, 3.0],
        "temperature": [30.0, 31.0],
        "text": "q",
        "joint_pos": [0.0, 1.0],
        "deep": {"x": 1},
    }


def commanded(k: int) -> dict[str, Any]:
    return {"q": [1.0, 2.0], "tau_cmd": [1.0, 2.0]}


@pytest.mark.parametrize("message", [odd, commanded, lambda k: {}], ids=["no efforts", "commanded", "empty"])
def test_nothing_is_offered_where_nothing_is_measured(tmp_path: Path, message: Callable[[int], dict[str, Any]]) -> None:
    path = as_json(tmp_path / "x.mcap", message)
    with pytest.raises(LogError) as caught:
        read_log((path,), LogConfig(), robot_joints=None)
    assert "say where they stand: " not in (caught.value.hint or "")
    assert "[log.fields]" in (caught.value.hint or "")
    assert describe((path,)).topics[0].fields == {}
