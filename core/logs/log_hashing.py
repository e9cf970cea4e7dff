"""The hash of a log's bytes, computed beside what else is done with it."""

from __future__ import annotations

import contextlib
import hashlib
import os
import sys
import threading
from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from pathlib import Path

from collaudit.core.errors import LogError
from collaudit.core.logs.opening import data_files
from collaudit.core.logs.storage.partial_file import partial_file, stream_sha256
from collaudit.core.numeric.allocator import memory_is_limited

_NICENESS = 10
_AT_ONCE = 1 << 30  # bytes: a log larger than this may not stay in the page cache


class Hashing:
    """The sha256 of files, computed in a thread that gives way to what else is done.

    It is started when the files have been read, and awaited where it is written down, by which time it is there. Files
    that the page cache may not keep are hashed while they are read. Where nobody is known to want it (``soon`` is
    False), it is computed when asked for; so it is where memory is limited, since Python waits without end for a thread
    that finds no memory to start in. Copied and pickled it is the hash itself.

    It is made before the files are read. Where they have changed by the time that they are hashed, the hash would be of
    other bytes than were read: it is refused with a LogError.
    """

    def __init__(self, paths: Sequence[Path], *, soon: bool = True) -> None:
        self._paths = tuple(paths)
        self._future: Future[str] | None = None
        self._beside = not memory_is_limited()
        self._state: _State | None = None
        with contextlib.suppress(OSError, LogError):  # who reads them will say it better
            self._state = _state_of(paths)
            if soon and sum(size for _, size, _, _ in self._state) > _AT_ONCE:
                self.start()

    def start(self) -> None:
        """Begin, once."""
        if self._future is None and self._beside:
            pool = ThreadPoolExecutor(1)
            self._future = pool.submit(_politely, self._paths, self._state)
            pool.shutdown(wait=False)  # the thread ends with its work

    def result(self) -> str:
        """Wait for the hash."""
        self.start()
        if self._future is None:
            self._future = Future()
            self._future.set_result(_unchanged(self._paths, self._state))
        return self._future.result()

    def abandon(self) -> None:
        """Wait until no file is open any more, whatever the hash is."""
        if self._future is not None:
            wait([self._future])

    def __reduce__(self) -> tuple[type[str], tuple[str]]:
        return str, (self.result(),)


#: Of each file its name, size, time of change in ns, and inode.
_State = list[tuple[str, int, int, int]]


def _state_of(paths: Sequence[Path]) -> _State:
    """What shows that files have changed. Files that are read over the network say so themselves."""
    files = [file for path in paths for file in data_files(path) if partial_file(file) is None]
    return [(str(file), (found := file.stat()).st_size, found.st_mtime_ns, found.st_ino) for file in files]


def _politely(paths: Sequence[Path], before: _State | None) -> str:
    """:func:`_unchanged` in a thread of low priority, where threads have priorities."""
    if sys.platform == "linux":
        with contextlib.suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), _NICENESS)
    return _unchanged(paths, before)


def _unchanged(paths: Sequence[Path], before: _State | None) -> str:
    """:func:`sha256_of`, refused if files have changed since ``before``."""
    found = sha256_of(paths)
    after: _State = []
    with contextlib.suppress(OSError):  # gone
        after = _state_of(paths)
    if before is not None and before != after:
        changed = sorted({name for name, *_ in set(before) ^ set(after)})
        raise LogError(
            "the log has changed while it was read",
            where=changed[0],
            found="another size or time of change than when reading began",
            hint="judge it when its recording has ended",
        )
    return found


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
    partial = partial_file(path)
    if partial is not None:
        return partial.sha256()
    try:
        with path.open("rb", buffering=0) as stream:
            return stream_sha256(stream)
    except OSError as error:
        raise LogError(f"cannot be read: {error.strerror}", where=str(path)) from error
