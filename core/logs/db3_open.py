"""Opening an sqlite file without ever writing beside it."""

from __future__ import annotations

import shutil
import sqlite3
from pathlib import Path
from tempfile import TemporaryDirectory

from collaudit.core.errors import LogError


def connect(path: Path) -> tuple[sqlite3.Connection, TemporaryDirectory[str] | None]:
    """Open read-only. A file with a journal (not closed, or being written) is opened as a copy, with its journal.

    Args:
        path: the file.

    Returns:
        The connection, and the folder of the copy, to be removed after closing; None without a journal.

    Raises:
        LogError: it cannot be opened or copied.
    """
    journals = [path.with_name(path.name + suffix) for suffix in ("-wal", "-journal")]
    hot = [journal for journal in journals if journal.is_file() and journal.stat().st_size]
    try:
        if not hot:
            return _tame(sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro&immutable=1", uri=True)), None
        folder = TemporaryDirectory(prefix="collaudit-")
        for file in (path, *hot):
            shutil.copyfile(file, Path(folder.name) / file.name)
        copy = Path(folder.name) / path.name
        return _tame(sqlite3.connect(f"{copy.as_uri()}?mode=rw", uri=True)), folder
    except (sqlite3.Error, OSError) as error:
        raise LogError(f"cannot be opened: {error}", where=str(path)) from error


def _tame(db: sqlite3.Connection) -> sqlite3.Connection:
    """Nothing in a log's schema may run code or be trusted to be well-formed."""
    db.execute("PRAGMA trusted_schema = OFF")
    db.execute("PRAGMA cell_size_check = ON")
    return db
