"""What a refusal says to do leads on: every line that it tells is taken word by word, and the next run gets further.

Each case is a log, or a configuration, that ``detect`` refuses. Of its message each key of the configuration is written
into the file, each command is run, each other file is named, one after the other: no message may come again, and in
the end the log is judged, or what remains asks for what only a person knows.
"""

from __future__ import annotations

import pickle
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import log_writers as w
import numpy as np
import pytest
from advice import walked, write
from init_rows import Motion
from rosbags.typesys import Stores, get_types_from_msg, get_typestore


@dataclass(frozen=True)
class Case:
    """A log to be refused.

    Attributes:
        make: writes it into a folder; returns the argument of ``detect``.
        keys: further keys of the configuration.
        open: what only a person knows, where no way ends with a log that is judged; "" where one does.
    """

    make: Callable[[Path, Motion], Path]
    keys: dict[str, Any] = field(default_factory=dict)
    open: str = ""


def table(*changes: Callable[[list[str]], list[str]]) -> Callable[[Path, Motion], Path]:
    """The plain table, changed line by line."""

    def make(folder: Path, motion: Motion) -> Path:
        columns = motion.plain()
        rows = np.column_stack(list(columns.values()))
        lines = [",".join(columns), *(",".join(f"{x:.9g}" for x in row) for row in rows)]
        for change in changes:
            lines = change(lines)
        (folder / "run.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
        return folder / "run.csv"

    return make


def renamed(**names: str) -> Callable[[list[str]], list[str]]:
    return lambda lines: [",".join(names.get(name, name) for name in lines[0].split(",")), *lines[1:]]


def restamped(names: str, stamp: Callable[[float], str]) -> Callable[[list[str]], list[str]]:
    def change(lines: list[str]) -> list[str]:
        cells = [line.partition(",") for line in lines]
        return [f"{names},{cells[0][2]}", *(f"{stamp(float(t))},{rest}" for t, _, rest in cells[1:])]

    return change


def with_columns(names: str, values: str) -> Callable[[list[str]], list[str]]:
    return lambda lines: [f"{lines[0]},{names}", *(f"{line},{values}" for line in lines[1:])]


def split(t: float) -> str:
    return f"{1_760_000_000 + int(t)},{round(t % 1 * 1e9)}"


def echoed(lines: list[str]) -> list[str]:
    rows = (line.split(",") for line in lines[1:])
    order = (1, 2, 3, 4, 5, 6)
    return [",".join([split(float(row[0])), "base", "joint1", "joint2", *(row[k] for k in order)]) for row in rows]


def long(lines: list[str]) -> list[str]:
    rows = [line.split(",") for line in lines[1:]]
    return ["time,joint,position,velocity,effort",
            *(f"{row[0]},joint{k},{row[k]},{row[2 + k]},{row[4 + k]}" for row in rows for k in (1, 2))]  # fmt: skip


def messages(*topics: str, names: tuple[str, ...] = ("joint1", "joint2"), burst: int = 0, effort: bool = True) -> Any:
    """A recording of the motion on each topic."""

    def make(folder: Path, motion: Motion) -> Path:
        said = []
        for k, t in enumerate(motion.time_s):
            ns = w.EPOCH + round(1e9 * t)
            for topic in topics:
                q, dq, tau = (values[k] for values in motion.signals)
                received = w.EPOCH + (k // burst + 1) * burst * 16_000_000 if burst else ns
                said.append(w.joint_state(names, q, dq, tau if effort else (), topic=topic,
                                          stamp_ns=0 if burst else ns, log_ns=received))  # fmt: skip
        return w.write_mcap(folder / "run.mcap", said, chunk_size=1 << 18)

    return make


def efforts_apart(folder: Path, motion: Motion) -> Path:
    said = []
    for k, t in enumerate(motion.time_s):
        ns, (q, dq, tau) = w.EPOCH + round(1e9 * t), (values[k] for values in motion.signals)
        said.append(w.joint_state(("joint1", "joint2"), q, dq, stamp_ns=ns))
        said.append(w.joint_state(("joint1", "joint2"), (), (), tau, topic="/torques", stamp_ns=ns))
    return w.write_mcap(folder / "run.mcap", said, chunk_size=1 << 18)


def own_type(folder: Path, motion: Motion) -> Path:
    kind = "maker_msgs/msg/Feedback"
    store = get_typestore(Stores.ROS2_HUMBLE)
    text = "std_msgs/Header header\nfloat64[] joint_pos\nfloat64[] joint_vel\nfloat64[] joint_tor\n"
    store.register(get_types_from_msg(text, kind))
    said = []
    for k, t in enumerate(motion.time_s):
        ns, (q, dq, tau) = w.EPOCH + round(1e9 * t), (values[k] for values in motion.signals)
        value = store.types[kind](header=w.header(store, ns), joint_pos=q, joint_vel=dq, joint_tor=tau)
        said.append(w.Said("/feedback", kind, ns, value))
    return w.write_mcap(folder / "run.mcap", said, store=store, chunk_size=1 << 18)


def pickled(folder: Path, motion: Motion) -> Path:
    (folder / "run.pkl").write_bytes(pickle.dumps(motion.plain()))
    return folder / "run.pkl"


def no_header(lines: list[str]) -> list[str]:
    return lines[1:]


def misspelt(folder: Path, motion: Motion) -> Path:
    table()(folder, motion)
    return folder / "rum.csv"


def values_of_a_trace(folder: Path, motion: Motion) -> Path:
    from init_rows import kuka_trace

    kuka_trace(folder, motion)
    return folder / "CELL_NextGenDrive#1.r64"


def hdf5(folder: Path, motion: Motion) -> Path:
    h5py = pytest.importorskip("h5py")
    with h5py.File(folder / "run.h5", "w") as file:
        for name, values in zip(("qpos", "qvel", "effort"), motion.signals, strict=True):
            file[f"observations/{name}"] = values
    return folder / "run.h5"


STATED = {"log.csv.time": "t", "log.csv.position": "q{i}", "log.csv.effort": "tau{i}"}
CASES: dict[str, Case] = {
    "no time": Case(table(lambda p: [line.partition(",")[2] for line in p])),
    "no names": Case(table(no_header)),
    "names from 0, stated from 1": Case(
        table(renamed(q1="q0", q2="q1", tau1="tau0", tau2="tau1", dq1="dq0", dq2="dq1")), STATED),
    "a number is missing": Case(table(renamed(q2="q3", dq2="dq3", tau2="tau3"))),
    "only desired positions": Case(table(renamed(q1="q_des_1", q2="q_des_2"))),
    "two torques": Case(table(renamed(tau1="torque_sensor_a_1", tau2="torque_sensor_a_2"),
                              with_columns("torque_sensor_b_1,torque_sensor_b_2", "0.5,0.25"))),
    "the motors' positions": Case(table(renamed(q1="motor_position_1", q2="motor_position_2"))),
    "unknown columns": Case(table(renamed(q1="x1", q2="x2")), open="which columns hold positions"),
    "a stated column that is not there": Case(table(), {**STATED, "log.csv.time": "zeit"}),
    "a unit that is not converted": Case(table(renamed(q1="q1 [mdeg]", q2="q2 [mdeg]"))),
    "currents": Case(table(renamed(tau1="current_1", tau2="current_2"))),
    "percent": Case(table(), {"log.units.effort": "percent"}),
    "constants of efforts in N·m": Case(
        table(), {"log.units.effort": "Nm", "log.units.torque_constant_nm_per_a": {"joint1": 1.0, "joint2": 1.0}}),
    "remarks": Case(table(lambda p: [*p[:9], "paused", *p[9:30], "resumed", *p[30:]])),
    "remarks as wide as rows": Case(table(lambda p: [*p[:9], "note,,,,,,x", *p[9:]])),
    "a row of other words": Case(table(lambda p: [p[0], "x,,,,,,", *p[1:]])),
    "a date and a time": Case(table(restamped(
        "Datum,Uhrzeit", lambda t: f"24.11.2026,08:{int(t // 60):02d}:{t % 60:06.3f}"))),
    "whole seconds": Case(table(restamped("time,rest", split))),
    "milliseconds": Case(table(restamped("t", lambda t: f"{1000 * t:.0f}"))),
    "nanoseconds": Case(table(restamped("t", lambda t: f"{1e9 * t:.0f}"))),
    "a JointState in a line": Case(table(echoed)),
    "a row a joint": Case(table(long)),
    "other names": Case(messages("/joint_states", names=("shoulder", "elbow"))),
    "two topics": Case(messages("/a/joint_states", "/b/joint_states")),
    "a desired topic": Case(messages("/joint_states_desired")),
    "efforts on a topic of their own": Case(efforts_apart),
    "a type of the maker's": Case(own_type),
    "bursts": Case(messages("/joint_states", burst=50), open="the rate"),
    "a topic that is not there": Case(messages("/joint_states"), {"log.joint_states": "/joint_state"}),
    "no stamps in the header": Case(messages("/joint_states", burst=1), {"log.time": "header"}),
    "more numbers than there is memory for": Case(messages("/joint_states"), {"log.memory_gb": 0.25}),
    "HDF5 without time": Case(hdf5),
    "a pickle": Case(pickled),
    "a file that is not there": Case(misspelt),
    "the values of a trace": Case(values_of_a_trace),
    "a joint that the robot does not have": Case(table(), {"robot.joints": ["joint1", "jont2"]}),
    "an unknown key": Case(table(), {"log.csv.postion": "q{i}"}),
    "an unknown unit": Case(table(), {"log.units.position": "degree"}),
}  # fmt: skip


@pytest.fixture(scope="module")
def motion(arm: Any) -> Motion:
    rows = np.loadtxt(arm.clean, delimiter=",", skiprows=1)[::4]
    return Motion(rows[:, 0], (rows[:, 1:3], rows[:, 3:5], rows[:, 5:7]))


@pytest.mark.parametrize("name", CASES)
def test_each_line_that_is_told_leads_on(name: str, motion: Motion, arm: Any, collaudit: Any, tmp_path: Path) -> None:
    case = CASES[name]
    choice, choices, good = 0, 1, False
    while choice < choices:
        folder = tmp_path / str(choice)
        folder.mkdir()
        log, config = case.make(folder, motion), folder / "c.toml"
        config.write_text(arm.config.read_text(encoding="utf-8").partition("[log.csv]")[0], encoding="utf-8")
        write(config, {"detect.gamma_nm": 4.0, **case.keys})
        steps = walked(collaudit, log, config, arm.friction, choice)
        messages = [step.message.replace(str(folder), "") for step in steps if step.message]
        assert messages, f"{name} is not refused"
        assert steps[0].told, f"nothing to do: {messages}"
        assert len(set(messages)) == len(messages), f"the same message came again: {messages}"
        good = good or not steps[-1].message
        choice, choices = choice + 1, len(steps[0].told)
    assert good != bool(case.open), f"in the end: {messages}"
