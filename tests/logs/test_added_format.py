"""A log format is added by one file, which reads it, and one line in FORMATS: one of messages and one of tables here.

The toys are written as their files would be, put where Python finds them, and entered in the table of formats; nothing
else changes.
"""

from __future__ import annotations

import json
import pkgutil
from pathlib import Path

import numpy as np
import pytest

from collaudit.core.config.schema import LogConfig
from collaudit.core.errors import LogError
from collaudit.core.logs import log_formats
from collaudit.core.logs.inputs import expand_inputs, group_inputs
from collaudit.core.logs.log_description import describe
from collaudit.core.logs.log_formats import FORMATS, LogFormat, begins_with
from collaudit.core.logs.log_guess import guess_csv_columns
from collaudit.core.logs.log_reading import read_log

TOY_MESSAGES = '''
import json
import numpy as np
from collaudit.core.logs.storage.readers import Batch, Channel

class ToyMessages:
    """Lines of JSON after a line with the magic: [time in ns, message]."""

    format = "toy-messages"

    def __init__(self, path):
        self.damage = []
        self.channels = (Channel(0, "/joint_states", "foxglove.JointStates", "json", "", b""),)
        self._rows = [json.loads(line) for line in path.read_text().splitlines()[1:]]

    def batches(self, keys=None, progress=None):
        payloads = [json.dumps(message).encode() for _, message in self._rows]
        length = np.array([len(payload) for payload in payloads])
        data = np.frombuffer(b"".join(payloads), dtype=np.uint8)
        yield Batch(0, data, np.cumsum(length) - length, length, np.array([stamp for stamp, _ in self._rows]))

    def close(self):
        pass
'''
TOY_TABLE = '''
import json
import numpy as np
import pyarrow as pa
from collaudit.core.logs.storage.readers import TableColumns

class ToyTable:
    """One JSON object of columns after the magic."""

    format, named, layout, stated = "toy-table", True, "columns of JSON", {}
    left_out, notes, damage = (), (), None

    def __init__(self, path, settings):
        self.path = path
        self._columns = json.loads(path.read_bytes()[4:])
        self.names = tuple(self._columns)

    def first_cells(self, column):
        return tuple(str(value) for value in self._columns[self.names[column]][:50])

    def read(self, groups, time, texts=()):
        column = lambda index: self._columns[self.names[index]]
        values = {name: np.array([column(k) for k in wanted], dtype=float).T for name, wanted in groups.items()}
        words = {index: tuple(map(str, column(index))) for index in texts}
        return TableColumns(values, None if time is None else pa.array(column(time)), words)
'''
MESSAGES = LogFormat("toym", "toy messages", "messages", (".toym",), begins_with(b"TOYM"), "toy_messages:ToyMessages")
TABLE = LogFormat("toyt", "toy table", "table", (".toyt",), begins_with(b"TOYT"), "toy_table:ToyTable")
COUNT = 200
TIME_S = np.arange(COUNT) / 100.0
POSITION = np.column_stack([np.sin(TIME_S), np.cos(TIME_S)])


@pytest.fixture(autouse=True)
def _toys(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path_factory.mktemp("toys")
    (folder / "toy_messages.py").write_text(TOY_MESSAGES)
    (folder / "toy_table.py").write_text(TOY_TABLE)
    monkeypatch.syspath_prepend(folder)
    monkeypatch.setattr(log_formats, "FORMATS", (MESSAGES, TABLE, *FORMATS))


def message_log(path: Path) -> Path:
    lines = ["TOYM"]
    for time_s, row in zip(TIME_S, POSITION, strict=True):
        ns = 1_700_000_000_000_000_000 + round(time_s * 1e9)
        joints = [{"name": f"j{k}", "position": q, "velocity": 0.0, "effort": 1.0} for k, q in enumerate(row)]
        stamp = {"sec": ns // 10**9, "nsec": ns % 10**9}
        lines.append(json.dumps([ns, {"timestamp": stamp, "joints": joints}]))
    path.write_text("\n".join(lines) + "\n")
    return path


def table_log(path: Path, **columns: list[float]) -> Path:
    columns = columns or {"q1": POSITION[:, 0].tolist(), "q2": POSITION[:, 1].tolist()}
    path.write_text("TOYT" + json.dumps({"t": TIME_S.tolist(), **columns}))
    return path


def test_an_added_format_of_messages_is_read_and_described(tmp_path: Path) -> None:
    path = message_log(tmp_path / "log.toym")
    log = read_log((path,), LogConfig(), robot_joints=("j0", "j1"))
    assert (log.source.format, log.source.topic) == ("toy-messages", "/joint_states")
    np.testing.assert_allclose(log.time_s, TIME_S, atol=1e-9)
    np.testing.assert_array_equal(log.position_rad, POSITION)
    summary = describe((path,))
    assert (summary.format, summary.topics[0].count, summary.topics[0].joints) == ("toy-messages", COUNT, ("j0", "j1"))


def test_an_added_format_of_tables_is_read_described_and_configured(tmp_path: Path) -> None:
    path = table_log(tmp_path / "log.toyt")
    log = read_log((path,), LogConfig(), robot_joints=None)
    assert (log.source.format, log.joint_names) == ("toy-table", ("joint1", "joint2"))
    np.testing.assert_allclose(log.time_s, TIME_S, atol=1e-9)
    np.testing.assert_array_equal(log.position_rad, POSITION)
    summary = describe((path,))
    assert (summary.format, summary.csv_columns) == ("toy-table", ("t", "q1", "q2"))
    assert summary.topics[0].encoding == "columns of JSON"
    guess = guess_csv_columns((path,))
    assert guess is not None
    assert (guess.csv.time, guess.csv.position) == ("t", "q{i}")
    assert "delimiter" not in guess.csv.given


def test_added_tables_that_belong_together_are_one_log_also_with_a_csv(tmp_path: Path) -> None:
    first = table_log(tmp_path / "a.toyt")
    second = table_log(tmp_path / "b.toyt", tau1=[1.0] * COUNT, tau2=[2.0] * COUNT)
    assert group_inputs([first, second], LogConfig()) == [(first, second)]
    third = tmp_path / "c.csv"
    third.write_text("t,dq1,dq2\n" + "".join(f"{t},0.1,0.2\n" for t in TIME_S))
    log = read_log((first, second, third), LogConfig(), robot_joints=None)
    assert log.effort is not None
    assert log.velocity_rad_s is not None
    assert (log.effort[0].tolist(), log.velocity_rad_s[0].tolist()) == ([1.0, 2.0], [0.1, 0.2])


def test_folders_messages_and_names_know_an_added_format(tmp_path: Path) -> None:
    by_name = tmp_path / "broken.toym"
    by_name.write_bytes(b"")
    by_content = table_log(tmp_path / "recording")
    (tmp_path / "notes.txt").write_text("no log, though it is text\n")
    assert expand_inputs([tmp_path]) == [by_name, by_content]
    with pytest.raises(LogError, match="empty") as empty:
        read_log((by_name,), LogConfig(), robot_joints=None)
    assert str(empty.value.expected).startswith("toy messages, toy table, MCAP")
    by_name.write_text("no toy\n1\n")
    with pytest.raises(LogError, match=r"is called \.toym and holds text"):
        read_log((by_name,), LogConfig(), robot_joints=None)
    (tmp_path / "empty").mkdir()
    with pytest.raises(LogError, match="no logs") as none:
        expand_inputs([tmp_path / "empty"])
    assert ".toym, .toyt, .mcap, .bag, .db3, .parquet, .feather, .npz, .npy, .mat, .h5, .jsonl or .csv" in str(
        none.value.expected
    )


def test_every_format_names_a_reader_that_exists() -> None:
    """Readers are named as text, so that they are loaded late: a wrong name would show only at the first such file."""
    assert len({known.name for known in FORMATS}) == len(FORMATS)
    named = [name for known in FORMATS for name in (known.reader, known.overview) if name]
    assert all(callable(pkgutil.resolve_name(name)) for name in named)
