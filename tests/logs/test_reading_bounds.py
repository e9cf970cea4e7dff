"""Small files that honestly hold very much are refused before memory is taken, and the bound can be raised."""

from __future__ import annotations

import json
import sqlite3
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import log_writers as w
import pytest
from packed_bombs import packed_columns, packed_messages, packed_text, packed_zeros

from collaudit.core.config.schema import LogConfig
from collaudit.core.errors import LogError
from collaudit.core.logs.log_description import describe
from collaudit.core.logs.log_formats import open_messages
from collaudit.core.logs.log_reading import read_log
from collaudit.core.logs.storage import bounded_reading
from collaudit.core.logs.storage.bounded_reading import ReadingBounds
from collaudit.core.logs.topics.joint_states_topic import peek
from collaudit.core.logs.topics.log_topics import topics_of

SECONDS, MEGABYTES = 10, 1000


BOMBS = [packed_zeros, packed_messages, packed_text, packed_columns]
#: Reads a log in a process of its own; says what came of it, in what time and memory.
READ = """
import json, re, resource, sys, time
from pathlib import Path
from collaudit.core.config.schema import LogConfig
from collaudit.core.errors import LogError
from collaudit.core.logs.log_description import describe
from collaudit.core.logs.log_reading import read_log
said = []
start = time.process_time()
for read in (lambda p: read_log((p,), LogConfig(), robot_joints=None), lambda p: describe((p,))):
    try:
        read(Path(sys.argv[1]))
        said.append("")
    except LogError as error:
        said.append(error.render())
status = Path("/proc/self/status")  # of this program alone: what resource tells on Linux begins with its parent's
own = re.search(r"VmHWM:\\s+(\\d+)", status.read_text()) if status.exists() else None
peak = (int(own[1]) if own else resource.getrusage(resource.RUSAGE_SELF).ru_maxrss) / 1000
print(json.dumps({"said": said, "seconds": time.process_time() - start, "megabytes": peak}))
"""


@pytest.mark.parametrize("bomb", BOMBS)
def test_small_files_stay_small_in_memory(bomb: Callable[[Path], Path], tmp_path: Path) -> None:
    path = bomb(tmp_path / "bomb.mcap")
    assert path.stat().st_size < 9_000_000
    done = subprocess.run([sys.executable, "-c", READ, str(path)], capture_output=True, text=True, check=True)
    result = json.loads(done.stdout)
    print(bomb.__name__, result["seconds"], result["megabytes"])
    assert result["said"][0], "it was read"
    assert result["megabytes"] < MEGABYTES
    assert result["seconds"] < SECONDS
    assert "Traceback" not in done.stderr


def test_the_bound_follows_the_file_and_can_be_raised(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = w.write_mcap(tmp_path / "log.mcap", w.motion(300, joints=3))
    few = LogConfig.of({"memory_gb": 0.2501})
    with pytest.raises(LogError, match="more than a log of this size") as caught:
        read_log((path,), few, robot_joints=None)
    assert "[log] memory_gb" in caught.value.render()
    assert read_log((path,), LogConfig(), robot_joints=None).time_s.size == 300
    with monkeypatch.context() as lowered:
        lowered.setattr(bounded_reading, "MOST_COLUMNS", 5)
        with pytest.raises(LogError, match="more than a log of this size") as caught:
            read_log((path,), LogConfig(), robot_joints=None)
    assert "at most 5" in caught.value.render()
    monkeypatch.setattr(bounded_reading, "CHUNK_BYTES", 100)
    assert "log-partial" in {f.code for f in describe((path,), LogConfig()).findings}


def test_a_look_at_joint_names_keeps_the_bounds(tmp_path: Path) -> None:
    path = w.write_mcap(tmp_path / "log.mcap", w.motion(300, joints=3))
    bounds = ReadingBounds(10**9, "log")
    reader = open_messages((path,), bounds)
    topics = topics_of(reader, LogConfig(), bounds)
    assert any(held.groups for held in peek(reader, topics).values())
    reader.close()
    assert all(topic.decoded.bounds is bounds for topic in topics)


def test_the_stated_defaults() -> None:
    assert ReadingBounds(8_000_000, "log").memory_bytes == 1_000_000_000
    assert ReadingBounds(50_000_000, "log").memory_bytes == 5_000_000_000
    assert ReadingBounds(10**12, "log").memory_bytes == 16_000_000_000
    assert ReadingBounds(8_000_000, "log").decoded_bytes == 800_000_000
    honest = ReadingBounds(469_000_000, "an hour of seven joints at 500 Hz")
    honest.take_values(1_800_000, 3 * 7 + 3)


def test_ever_other_joints_on_a_topic(tmp_path: Path) -> None:
    said = [w.joint_state([f"joint{k}"], [0.0], stamp_ns=w.EPOCH + k) for k in range(1100)]
    with pytest.raises(LogError, match="sets of joints"):
        read_log((w.write_mcap(tmp_path / "log.mcap", said),), LogConfig(), robot_joints=None)


@pytest.mark.parametrize(
    ("statements", "words"),
    [
        ("CREATE TRIGGER mine AFTER INSERT ON messages BEGIN DELETE FROM topics; END", "mine"),
        ("CREATE VIEW mine AS SELECT * FROM messages", "mine"),
        ("ALTER TABLE messages ADD COLUMN more BLOB AS (zeroblob(100000000)) VIRTUAL", "more"),
        (
            "ALTER TABLE messages RENAME TO kept; CREATE VIEW messages AS SELECT id, topic_id, timestamp, "
            "zeroblob(100000000) AS data FROM kept",
            "tables kept",
        ),
        (
            "ALTER TABLE messages RENAME TO kept; CREATE TABLE messages (id INTEGER PRIMARY KEY, topic_id INTEGER, "
            "timestamp INTEGER, data BLOB AS (zeroblob(100000000)) STORED)",
            "data",
        ),
    ],
)
def test_tables_that_compute_are_refused(statements: str, words: str, tmp_path: Path) -> None:
    path = w.write_any(tmp_path, "db3", lambda encoding: w.motion(20, joints=2, encoding=encoding))
    file = path if path.is_file() else next(path.glob("*.db3"))
    with sqlite3.connect(file) as db:
        db.executescript(statements)
    db.close()
    with pytest.raises(LogError) as caught:
        read_log((file,), LogConfig(), robot_joints=None)
    assert words in caught.value.render()
