"""Opening an sqlite file without ever writing beside it."""

from __future__ import annotations

import os
import shutil
import sqlite3
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from collaudit.core.errors import LogError
from collaudit.core.logs.storage.records import Damage

#: A file that claims to be larger than this is not completed.
_MAX_CLAIM = 1 << 40
#: SQL texts have to fit too.
_LEAST_LENGTH = 1 << 20


@dataclass(frozen=True, slots=True)
class Opened:
    """A connection; the folder of the copy it works on, if any, to be removed after closing; and what was wrong."""

    db: sqlite3.Connection
    copy: TemporaryDirectory[str] | None = None
    damage: Damage | None = None


def connect(path: Path) -> Opened:
    """Open read-only. A file with a journal (not closed, or being written) is opened as a copy, with its journal.

    A file that was cut short is opened as a copy that is as long as it says, its end empty: sqlite then reads the
    pages that are there.

    Args:
        path: the file.

    Raises:
        LogError: it cannot be opened or copied.
    """
    journals = [path.with_name(path.name + suffix) for suffix in ("-wal", "-journal")]
    hot = [journal for journal in journals if journal.is_file() and journal.stat().st_size]
    try:
        page, claimed = _claimed_size(path)
        cut = path.stat().st_size < claimed <= _MAX_CLAIM
        if not hot and not cut:
            db = sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro&immutable=1", uri=True)
            return Opened(_tame(db, path.stat().st_size))
        folder = TemporaryDirectory(prefix="collaudit-")
        for file in (path, *hot):
            shutil.copyfile(file, Path(folder.name) / file.name)
        copy = Path(folder.name) / path.name
        if cut:
            os.truncate(copy, path.stat().st_size // page * page)  # half a page would be read as rows of zeros
            os.truncate(copy, claimed)
            text = f"it ends at byte {path.stat().st_size} of the {claimed} it says it has"
            damage = Damage(text)
        else:
            damage = Damage("it has a journal, because it was not closed; what had been committed was read", lost=False)
        return Opened(_tame(sqlite3.connect(f"{copy.as_uri()}?mode=rw", uri=True), copy.stat().st_size), folder, damage)
    except (sqlite3.Error, OSError) as error:
        raise LogError(f"cannot be opened: {error}", where=str(path)) from error


def _claimed_size(path: Path) -> tuple[int, int]:
    """Bytes of a page, and of all pages by the file's header, 0 when it does not say (sqlite.org/fileformat2)."""
    with path.open("rb") as stream:
        head = stream.read(100)
    if len(head) < 100 or head[24:28] != head[92:96]:
        return 1, 0
    stated = int.from_bytes(head[16:18], "big")
    page = 65536 if stated == 1 else max(stated, 1)
    return page, int.from_bytes(head[28:32], "big") * page


def _tame(db: sqlite3.Connection, file_bytes: int) -> sqlite3.Connection:
    """Nothing in a log's schema may run code or be trusted to be well-formed; no value is larger than the file."""
    db.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, max(file_bytes, _LEAST_LENGTH))
    db.execute("PRAGMA trusted_schema = OFF")
    db.execute("PRAGMA cell_size_check = ON")
    return db
