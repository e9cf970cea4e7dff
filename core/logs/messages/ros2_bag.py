"""ROS 2 bags: which files of a folder hold the data, several files as one recording, and storage by sqlite3."""

from __future__ import annotations

import os
import re
import shutil
import sqlite3
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from collaudit.core.errors import LogError
from collaudit.core.logs.storage.file_content import (
    unpacked_name,
)
from collaudit.core.logs.storage.readers import (
    Batch,
    Channel,
    Damage,
    DamageNotes,
    Located,
    MessageReader,
    ros_type,
)
from collaudit.core.numeric.parallel import Progress, stage
from collaudit.core.small_files import read_small

_MAX_METADATA = 8 << 20
#: What rosbag2's plugins for compression are called in metadata.yaml, of those that are read.
PACKINGS = ("zstd", "lz4")
_ROWS = 4096
#: Number, topic, time and payload.
_Row = tuple[Any, ...]
#: A file that claims to be larger than this is not completed.
_MAX_CLAIM = 1 << 40
#: SQL texts have to fit too.
_LEAST_LENGTH = 1 << 20


def folder_files(path: Path, is_storage: Callable[[Path], bool]) -> tuple[tuple[Path, ...], tuple[Damage, ...]]:
    """The storage files of a bag folder in recording order, and what is wrong with its list of them.

    The list of metadata.yaml is used; when it names no file that is there (a recording that was killed leaves
    none, renamed files are found under other names), every storage file of the folder is taken in the order of
    the numbers in the names.

    Args:
        path: the folder.
        is_storage: whether a file is of a format that bags are stored in.

    Raises:
        LogError: the folder holds no storage file, or its recorder compressed it in a way that is not read.
    """
    metadata = _metadata(path / "metadata.yaml")
    _check_compression(metadata, path)
    named = [path / Path(name).name for name in _relative_paths(metadata)]
    there = tuple(file for file in named if file.is_file())
    found = sorted((file for file in path.iterdir() if file.is_file() and is_storage(file)), key=_natural)
    if there:
        absent = ", ".join(file.name for file in named if not file.is_file())
        known = {unpacked_name(file.name) for file in named}  # a packed file may have been unpacked beside itself
        beside = ", ".join(file.name for file in found if unpacked_name(file.name) not in known)
        damage = [Damage(f"the bag folder lacks files its metadata.yaml names: {absent}")] if absent else []
        damage += [Damage(f"its metadata.yaml does not name {beside}, and they were not read")] if beside else []
        return there, tuple(damage)
    if not found:
        names = ", ".join(file.name for file in named)
        raise LogError(
            "the folder holds no ROS 2 storage file",
            where=str(path),
            found=f"metadata.yaml names {names}, which are not there" if names else None,
            expected="a .db3 or .mcap file",
        )
    read = ", ".join(file.name for file in found)
    return tuple(found), (Damage(f"its metadata.yaml names no file that is there; {read} was read", lost=False),)


def _metadata(file: Path) -> str:
    """The text of metadata.yaml; empty where it cannot be had."""
    try:
        return read_small(file, _MAX_METADATA).decode("utf-8", errors="replace")
    except OSError:
        return ""


def _check_compression(metadata: str, folder: Path) -> None:
    """Refuse compression by a plugin whose output is not read; what is read is told by the bytes themselves."""
    stated = dict(re.findall(r"(?m)^\s*(compression_format|compression_mode):\s*['\"]?(\w*)['\"]?\s*$", metadata))
    mode, method = (stated.get(f"compression_{key}", "").lower() for key in ("mode", "format"))
    if mode in ("message", "file") and method not in PACKINGS:
        raise LogError(
            f"the bag is compressed in a way that is not read (compression_format {method or 'not stated'})",
            where=str(folder / "metadata.yaml"),
            expected=" or ".join(PACKINGS),
            hint="write it again without compression by `ros2 bag convert`",
        )


def _relative_paths(text: str) -> list[str]:
    """The items under ``relative_file_paths:``, a plain YAML list in every version of rosbag2."""
    found = re.search(r"(?m)^[ \t]*relative_file_paths:\s*(\[[^\]]*\]|(?:(?:#|- ).*\s*)*)", text)
    listed = "" if found is None else found[1]
    items = listed.strip("[]").split(",") if listed.startswith("[") else re.findall(r"(?m)^\s*- (.*)", listed)
    return [name for item in items if (name := item.strip().strip("'\""))]


def _natural(path: Path) -> list[tuple[int, str]]:
    """The name with its numbers as numbers."""
    parts = re.split(r"(\d+)", path.name)
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in parts]


class JoinedRecording:
    """Several files of one recording read as one log, in the order given."""

    def __init__(self, readers: Sequence[tuple[Path, MessageReader]], damage: Sequence[Damage]) -> None:
        self._readers = tuple(readers)
        self._folder_damage = tuple(damage)
        self.format = self._readers[0][1].format
        self.channels, self._keys = _joined([reader.channels for _, reader in self._readers])

    @property
    def damage(self) -> list[Damage]:
        """The damage of the folder and of all files, the latter with their names."""
        files = [(path.name, item) for path, reader in self._readers for item in reader.damage]
        return [*self._folder_damage, *(Damage(f"{name}: {item.text}", item.lost) for name, item in files)]

    def batches(self, keys: frozenset[int] | None = None, progress: Progress | None = None) -> Iterator[Batch]:
        """Raw messages, file after file."""
        total = sum(path.stat().st_size for path, _ in self._readers)
        done = 0
        for (path, reader), names in zip(self._readers, self._keys, strict=True):
            wanted = frozenset(inner for inner, key in names.items() if keys is None or key in keys)
            after = done + path.stat().st_size
            for batch in reader.batches(wanted, stage(progress, done / total, after / total)) if wanted else ():
                yield replace(batch, key=names[batch.key])
            done = after

    def close(self) -> None:
        """Release the files."""
        for _, reader in self._readers:
            reader.close()


def _joined(files: Sequence[Sequence[Channel]]) -> tuple[tuple[Channel, ...], tuple[dict[int, int], ...]]:
    """The channels of all files, and for each file its keys to theirs.

    A channel that goes on in the next file, told by topic and definition, stays one: its clock can be followed. Several
    of the same kind on one topic are told by their order.
    """
    out: dict[tuple[Channel, int], Channel] = {}
    keys = []
    for channels in files:
        counts: Counter[Channel] = Counter()
        names = {}
        for channel in channels:
            kind = replace(channel, key=0, claimed=0)
            joined = out.setdefault((kind, counts[kind]), replace(channel, key=len(out)))
            counts[kind] += 1
            names[channel.key] = joined.key
        keys.append(names)
    return tuple(out.values()), tuple(keys)


class Db3File:
    """A ``.db3`` of rosbag2 (see :class:`collaudit.core.logs.storage.readers.MessageReader`)."""

    format = "ros2-db3"

    def __init__(self, path: Path) -> None:
        self.path = path
        self.damage = DamageNotes()
        self._bytes = path.stat().st_size
        self._copy: TemporaryDirectory[str] | None = None
        try:
            self._db = self._connect()
        except (sqlite3.Error, OSError) as error:
            raise LogError(f"cannot be opened: {error}", where=str(path)) from error
        try:
            self.channels = self._read_channels()
        except (sqlite3.Error, OverflowError, ValueError, TypeError) as error:
            self.close()
            raise LogError(
                "is an SQLite file that cannot be read as a ROS 2 bag",
                where=str(path),
                found=str(error),
                expected="the tables topics and messages of rosbag2",
            ) from error

    def close(self) -> None:
        """Release the file."""
        self._db.close()
        if self._copy is not None:
            self._copy.cleanup()

    def _connect(self) -> sqlite3.Connection:
        """Open read-only. A file with a journal (not closed, or being written) is opened as a copy, with its journal.

        A file that was cut short is opened as a copy that is as long as it says, its end empty: sqlite then reads the
        pages that are there.
        """
        journals = [self.path.with_name(self.path.name + suffix) for suffix in ("-wal", "-journal")]
        hot = [journal for journal in journals if journal.is_file() and journal.stat().st_size]
        page, claimed = _claimed_size(self.path)
        cut = self._bytes < claimed <= _MAX_CLAIM
        if not hot and not cut:
            db = sqlite3.connect(f"{self.path.resolve().as_uri()}?mode=ro&immutable=1", uri=True)
            return _tame(db, self._bytes)
        self._copy = TemporaryDirectory(prefix="collaudit-")
        copy = Path(self._copy.name) / self.path.name
        for file in (self.path, *hot):
            shutil.copyfile(file, copy.with_name(file.name))
        if cut:
            os.truncate(copy, self._bytes // page * page)  # half a page would be read as rows of zeros
            os.truncate(copy, claimed)
            self.damage.note(f"it ends at byte {self._bytes} of the {claimed} it says it has")
        else:
            text = "it has a journal, because it was not closed; what had been committed was read"
            self.damage.note(text, lost=False)
        return _tame(sqlite3.connect(f"{copy.as_uri()}?mode=rw", uri=True), copy.stat().st_size)

    def _read_channels(self) -> tuple[Channel, ...]:
        tables = {
            _str(name)
            for name, sql in self._db.execute("SELECT name, sql FROM sqlite_master WHERE type = 'table'")
            if not _str(sql).upper().startswith("CREATE VIRTUAL")
        }
        if not {"topics", "messages"} <= tables:
            raise ValueError(f"tables {', '.join(sorted(tables)) or 'none'}")
        computing = "SELECT name FROM sqlite_master WHERE type IN ('view', 'trigger')"
        active = [_str(name) for (name,) in self._db.execute(computing)]
        if active:
            raise ValueError(f"views or triggers, which no recorder writes: {', '.join(sorted(active)[:5])}")
        for table in sorted(tables & {"topics", "messages", "message_definitions"}):
            computed = [_str(row[1]) for row in self._db.execute(f"PRAGMA table_xinfo({table})") if row[6]]
            if computed:
                raise ValueError(f"columns of {table} that are computed, not recorded: {', '.join(computed)}")
        stated = "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions"
        rows = self._db.execute(stated) if "message_definitions" in tables else ()
        schemas = {ros_type(_str(kind)): (_str(encoding), _str(text).encode("utf-8")) for kind, encoding, text in rows}
        topics = self._db.execute("SELECT id, name, type, serialization_format FROM topics ORDER BY id").fetchall()
        kinds = [ros_type(_str(kind)) for _, _, kind, _ in topics]
        return tuple(
            Channel(int(number), _str(name), kind, _str(encoding), *schemas.get(kind, ("", b"")))
            for (number, name, _, encoding), kind in zip(topics, kinds, strict=True)
        )

    def batches(self, keys: frozenset[int] | None = None, progress: Progress | None = None) -> Iterator[Batch]:
        """Raw messages in blocks of rows; damage met on the way is added to :attr:`damage`."""
        wanted = sorted(keys if keys is not None else {channel.key for channel in self.channels})
        rows = self._rows(wanted)
        done = 0
        while block := list(islice(rows, _ROWS)):
            for batch in self._split(block):
                done += int(batch.length.sum())
                yield batch
            if progress is not None:
                progress(min(done, self._bytes), self._bytes)

    def _rows(self, wanted: Sequence[int]) -> Iterator[_Row]:
        """Rows in the order of their numbers, up to a page that is missing."""
        last = -(1 << 63)
        marks = ", ".join("?" * len(wanted))
        query = f"SELECT id, topic_id, timestamp, data FROM messages WHERE topic_id IN ({marks}) ORDER BY id"
        try:
            for row in self._db.execute(query, wanted):
                if row[0] <= last:
                    self.damage.note(f"its rows do not ascend after number {last}; the rest was left out")
                    return
                last = row[0]
                yield row
        except (sqlite3.Error, OverflowError, TypeError) as error:
            self.damage.note(f"reading its messages stopped after number {last}: {error}")

    def _split(self, rows: list[_Row]) -> list[Batch]:
        """One batch per topic, all in one buffer."""
        _, topics, times, blobs = zip(*rows, strict=True)
        if set(map(type, times)) != {int} or set(map(type, blobs)) != {bytes}:  # sqlite columns hold what they like
            good = [row for row in rows if isinstance(row[2], int) and isinstance(row[3], bytes)]
            self.damage.note(f"{len(rows) - len(good)} rows of its messages hold no time or no bytes")
            if not good:
                return []
            _, topics, times, blobs = zip(*good, strict=True)
        length = np.array([len(blob) for blob in blobs], dtype=np.int64)
        data = np.frombuffer(b"".join(blobs), dtype=np.uint8)
        channel, log_ns = np.array(topics, dtype=np.int64), np.array(times, dtype=np.int64)
        return Located(data, np.cumsum(length) - length, length, channel, log_ns).by_channel()


def _str(value: object) -> str:
    return value.decode("utf-8", errors="replace") if isinstance(value, bytes) else str(value)


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
