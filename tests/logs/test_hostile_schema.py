"""An sqlite bag whose schema computes what it claims to have recorded is refused at once."""

from __future__ import annotations

import sqlite3
import time
from pathlib import Path

import pytest
from log_writers import motion, storage_file, write_folder

from collaudit.core.config.schema import LogConfig
from collaudit.core.errors import CollauditError
from collaudit.core.logs.log_reading import read_log

COMPUTED = """
ALTER TABLE messages RENAME TO recorded;
CREATE TABLE messages (id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER,
                       data BLOB GENERATED ALWAYS AS (zeroblob(100000000)) VIRTUAL);
INSERT INTO messages (id, topic_id, timestamp) SELECT id, topic_id, timestamp FROM recorded;
"""
VIEW = """
ALTER TABLE messages RENAME TO recorded;
CREATE VIEW messages AS SELECT id, topic_id, timestamp, zeroblob(100000000) AS data FROM recorded;
"""


@pytest.mark.parametrize(("schema", "word"), [(COMPUTED, "computed, not recorded: data"), (VIEW, "tables")])
def test_values_that_are_computed_are_refused(schema: str, word: str, tmp_path: Path) -> None:
    file = storage_file(write_folder(tmp_path / "bag", motion(count=300)))
    with sqlite3.connect(file) as db:
        db.executescript(schema)
    db.close()
    started = time.process_time()
    with pytest.raises(CollauditError, match=word):
        read_log([file], LogConfig(), robot_joints=None)
    assert time.process_time() - started < 5
