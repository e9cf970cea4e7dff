"""Small files that honestly hold very much are refused before memory is taken, and the bound can be raised."""

from __future__ import annotations

import json
import sqlite3
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import log_writers as w
import lz4.frame
import numpy as np
import pytest

from collaudit.core.config.schema import LogConfig
from collaudit.core.errors import LogError
from collaudit.core.logs import describe, read_log
from collaudit.core.logs.storage.reading_bounds import ReadingBounds

SECONDS, MEGABYTES = 10, 1000


def mcap_of_chunks(path: Path, data: bytes, size: int, count: int = 1) -> Path:
    """An MCAP file of equal chunks, compressed by lz4."""

    def record(op: int, body: bytes) -> bytes:
        return bytes([op]) + len(body).to_bytes(8, "little") + body

    def text(value: str) -> bytes:
        return len(value).to_bytes(4, "little") + value.encode()

    definition = w.definition(w.JOINT_STATE, "cdr")
    schema = (1).to_bytes(2, "little") + text(w.JOINT_STATE) + text("ros2msg") + text(definition)
    channel = (1).to_bytes(2, "little") * 2 + text("/joint_states") + text("cdr") + (0).to_bytes(4, "little")
    times = bytes(16) + size.to_bytes(8, "little") + bytes(4) + text("lz4") + len(data).to_bytes(8, "little")
    magic = b"\x89MCAP0\r\n"
    head = record(1, text("ros2") + text("")) + record(3, schema) + record(4, channel)
    tail = record(15, bytes(4)) + record(2, bytes(20))
    path.write_bytes(magic + head + count * record(6, times + data) + tail + magic)
    return path


def packed_zeros(path: Path) -> Path:
    """8 MB that truly hold 1.9 GB of zeros."""
    size = 1_900_000_000
    context = lz4.frame.LZ4FrameCompressor()
    block = bytes(50_000_000)
    parts = [context.begin(size), *(context.compress(block) for _ in range(size // len(block))), context.flush()]
    return mcap_of_chunks(path, b"".join(parts), size)


def packed_messages(path: Path) -> Path:
    """240 MB of joint states of 500 joints, all alike, in a megabyte."""
    said = w.joint_state([f"joint{j}" for j in range(500)], np.zeros(500), np.zeros(500), np.zeros(500))
    body = (1).to_bytes(2, "little") + bytes(4) + said.log_ns.to_bytes(8, "little") * 2 + w.encode(said, "cdr")
    one = bytes([5]) + len(body).to_bytes(8, "little") + body
    data = one * (120_000_000 // len(one))
    return mcap_of_chunks(path, lz4.frame.compress(data), len(data), 2)


def packed_text(path: Path) -> Path:
    import gzip

    path = path.with_suffix(".csv.gz")
    with gzip.open(path, "wb", 6) as stream:
        stream.write(b"t,q1,q2,dq1,dq2,tau1,tau2\n")
        for _ in range(12):
            stream.write(b"0,0,0,0,0,0,0\n" * 1_000_000)
    return path


def packed_columns(path: Path) -> Path:
    import pyarrow as pa
    import pyarrow.parquet as pq

    path = path.with_suffix(".parquet")
    zeros = pa.array(np.zeros(4_000_000))
    pq.write_table(pa.table(dict.fromkeys(("t", "q1", "q2", "dq1", "dq2", "tau1", "tau2"), zeros)), path)
    return path


BOMBS = [packed_zeros, packed_messages, packed_text, packed_columns]
#: Reads a log in a process of its own; says what came of it, in what time and memory.
READ = """
import json, resource, sys, time
from pathlib import Path
from collaudit.core.config.schema import LogConfig
from collaudit.core.errors import LogError
from collaudit.core.logs import describe, read_log
said = []
start = time.process_time()
for read in (lambda p: read_log((p,), LogConfig(), robot_joints=None), lambda p: describe((p,))):
    try:
        read(Path(sys.argv[1]))
        said.append("")
    except LogError as error:
        said.append(error.render())
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1000
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


def test_the_bound_follows_the_file_and_can_be_raised(tmp_path: Path) -> None:
    path = w.write_mcap(tmp_path / "log.mcap", w.motion(300, joints=3))
    few = LogConfig.model_validate({"limits": {"memory_gb": 0.2501}})
    with pytest.raises(LogError, match="more than a log of this size") as caught:
        read_log((path,), few, robot_joints=None)
    assert "[log.limits] memory_gb" in caught.value.render()
    assert read_log((path,), LogConfig(), robot_joints=None).time_s.size == 300
    for key, value in (("messages", 100), ("columns", 5)):
        with pytest.raises(LogError, match=key):
            read_log((path,), LogConfig.model_validate({"limits": {key: value}}), robot_joints=None)
    tight = LogConfig.model_validate({"limits": {"chunk_mb": 1e-4}})
    assert "log-partial" in {f.code for f in describe((path,), tight).findings}


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
