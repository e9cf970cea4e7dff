"""Opening a log: the reader for its format, several files of one recording as one, and its hash."""

from __future__ import annotations

import contextlib
import hashlib
import os
import sys
import threading
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import replace
from pathlib import Path

from collaudit.core.errors import LogError
from collaudit.core.findings import Finding
from collaudit.core.logs.file_kind import Kind, head_of, sniff
from collaudit.core.logs.rosbag2.bag_folder import folder_files
from collaudit.core.logs.storage.records import Batch, Channel, Damage, LogReader, Progress

_BLOCK = 1 << 20
_NICENESS = 10
_AT_ONCE = 1 << 30  # bytes: a log larger than this may not stay in the page cache
_EXPECTED = "MCAP, ROS 1 bag (2.0), ROS 2 bag (sqlite3, mcap), or CSV"


class ManyFiles:
    """Several files of one recording read as one log, in the order given."""

    def __init__(self, readers: Sequence[tuple[Path, LogReader]], damage: Sequence[Damage]) -> None:
        self._readers = tuple(readers)
        self._folder_damage = tuple(damage)
        self.format = self._readers[0][1].format
        self.channels, self._keys = _joined([reader.channels for _, reader in self._readers])

    @property
    def damage(self) -> list[Damage]:
        """The damage of all files, each with its name."""
        return [
            Damage(f"{path.name}: {item.text}", item.lost) for path, reader in self._readers for item in reader.damage
        ]

    def batches(self, keys: frozenset[int] | None = None, progress: Progress | None = None) -> Iterator[Batch]:
        """Raw messages, file after file."""
        total = sum(path.stat().st_size for path, _ in self._readers)
        done = 0
        for (path, reader), names in zip(self._readers, self._keys, strict=True):
            wanted = frozenset(inner for inner, key in names.items() if keys is None or key in keys)
            inner = _shifted(progress, done, total)
            for batch in reader.batches(wanted, inner) if wanted else ():
                yield replace(batch, key=names[batch.key])
            done += path.stat().st_size

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
        met: Counter[Channel] = Counter()
        names = {}
        for channel in channels:
            kind = replace(channel, key=0)
            its = out.setdefault((kind, met[kind]), replace(channel, key=len(out)))
            met[kind] += 1
            names[channel.key] = its.key
        keys.append(names)
    return tuple(out.values()), tuple(keys)


def _shifted(progress: Progress | None, base: int, total: int) -> Progress | None:
    if progress is None:
        return None
    return lambda done, _: progress(base + done, total)


def data_files(path: Path) -> tuple[Path, ...]:
    """The files that hold a log's data: itself, or those of a bag folder in recording order.

    Raises:
        LogError: a folder holds no storage file.
    """
    return folder_files(path)[0] if path.is_dir() else (path,)


def open_messages(paths: Sequence[Path]) -> LogReader:
    """Open a container of messages.

    Raises:
        LogError: a file is empty, of no known format, or cannot be read at all.
    """
    damage = [item for path in paths if path.is_dir() for item in folder_files(path)[1]]
    files = [file for path in paths for file in data_files(path)]
    readers: list[tuple[Path, LogReader]] = []
    refused: list[LogError] = []
    for file in files:
        try:
            readers.append((file, _open_one(file)))
        except LogError as error:
            refused.append(error)
            damage.append(Damage(f"{file.name} could not be read ({error.message})"))
    if not readers:
        raise refused[0]
    if len(readers) == 1:
        readers[0][1].damage.extend(damage)
        return readers[0][1]
    return ManyFiles(readers, damage)


def _open_one(path: Path) -> LogReader:
    kind = sniff(path)
    if kind == "mcap":
        from collaudit.core.logs.mcap.mcap_file import McapFile

        return McapFile(path)
    if kind == "ros1-bag":
        from collaudit.core.logs.rosbag1.bag_file import BagFile

        return BagFile(path)
    if kind == "db3":
        from collaudit.core.logs.rosbag2.db3_file import Db3File

        return Db3File(path)
    raise unreadable(path, kind)


def unreadable(path: Path, kind: Kind) -> LogError:
    """The error for a file of no known format."""
    where = str(path)
    if kind == "empty":
        return LogError("the file is empty", where=where, found="0 bytes", expected=_EXPECTED)
    if path.is_dir():
        return LogError(
            "the folder is no ROS 2 bag",
            where=where,
            found="no metadata.yaml",
            expected="a ROS 2 bag folder or a log file",
        )
    found = "text" if kind == "csv" else f"bytes beginning with {head_of(path, 8)!r}"
    return LogError("is not a log of a known format", where=where, found=found, expected=_EXPECTED)


def partial(damage: Sequence[Damage], where: str) -> tuple[Finding, ...]:
    """Findings for what could not be read."""
    return tuple(
        Finding(
            "log-partial",
            "error" if item.lost else "warning",
            f"The log is damaged: {item.text}." + (" Only the rest was read." if item.lost else ""),
            where=where,
        )
        for item in damage
    )


class Hashing:
    """The sha256 of files, computed in a thread that gives way to what else is done.

    It is started when the files have been read, and awaited where it is written down, by which time it is there. Files
    that the page cache may not keep are hashed while they are read. Copied and pickled it is the hash itself.
    """

    def __init__(self, paths: Sequence[Path]) -> None:
        self._paths = tuple(paths)
        self._future: Future[str] | None = None
        with contextlib.suppress(OSError, LogError):  # who reads them will say it better
            if sum(file.stat().st_size for path in paths for file in data_files(path)) > _AT_ONCE:
                self.start()

    def start(self) -> None:
        """Begin, once."""
        if self._future is None:
            pool = ThreadPoolExecutor(1)
            self._future = pool.submit(_politely, self._paths)
            pool.shutdown(wait=False)  # the thread ends with its work

    def result(self) -> str:
        """Wait for the hash."""
        self.start()
        assert self._future is not None
        return self._future.result()

    def abandon(self) -> None:
        """Wait until no file is open any more, whatever the hash is."""
        if self._future is not None:
            wait([self._future])

    def __reduce__(self) -> tuple[type[str], tuple[str]]:
        return str, (self.result(),)


def _politely(paths: Sequence[Path]) -> str:
    """:func:`sha256_of` in a thread of low priority, where threads have priorities."""
    if sys.platform == "linux":
        with contextlib.suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), _NICENESS)
    return sha256_of(paths)


def sha256_of(paths: Sequence[Path]) -> str:
    """Hash of a file's bytes; of several files, the hash of their hashes in the order of their names.

    Raises:
        LogError: a file cannot be read.
    """
    files = sorted((file for path in paths for file in data_files(path)), key=lambda file: (file.name, str(file)))
    hashes = [_file_hash(file) for file in files]
    if len(hashes) == 1:
        return hashes[0]
    return hashlib.sha256("".join(hashes).encode("ascii")).hexdigest()


def _file_hash(path: Path) -> str:
    digest = hashlib.sha256()
    try:
        with path.open("rb", buffering=0) as stream:
            read: Callable[[], bytes] = lambda: stream.read(_BLOCK)  # noqa: E731
            while block := read():
                digest.update(block)
    except OSError as error:
        raise LogError(f"cannot be read: {error.strerror}", where=str(path)) from error
    return digest.hexdigest()
