"""The hash of a log's bytes."""

from __future__ import annotations

import contextlib
import hashlib
from collections.abc import Sequence
from functools import cached_property, partial
from pathlib import Path

from collaudit.core.errors import LogError
from collaudit.core.logs.opening import data_files
from collaudit.core.numeric.parallel import begun


class Hashing:
    """The sha256 of files, computed in a thread while they are read. Copied and pickled it is the hash itself.

    It is made before the files are read. Where they have changed by the time that it is asked for, it may be of other
    bytes than were read: it is refused with a LogError.
    """

    def __init__(self, paths: Sequence[Path]) -> None:
        self._paths = tuple(paths)
        self._state: _State | None = None
        with contextlib.suppress(OSError, LogError):  # who reads them will say it better
            self._state = _state_of(paths)
        self._result = begun(partial(sha256_of, self._paths))

    def result(self) -> str:
        """The hash."""
        return self._hash

    @cached_property
    def _hash(self) -> str:
        found = self._result()
        try:
            after = _state_of(self._paths)
        except OSError as error:
            raise LogError(f"cannot be read: {error.strerror}", where=str(error.filename)) from error
        if self._state is not None and self._state != after:
            changed = sorted({name for name, *_ in set(self._state) ^ set(after)})
            raise LogError(
                "the log has changed while it was read",
                where=changed[0],
                found="another size or time of change than when reading began",
                hint="judge it when its recording has ended",
            )
        return found

    def __reduce__(self) -> tuple[type[str], tuple[str]]:
        return str, (self.result(),)


#: Of each file its name, size, time of change in ns, and inode.
_State = list[tuple[str, int, int, int]]


def _state_of(paths: Sequence[Path]) -> _State:
    """What shows that files have changed."""
    files = [file for path in paths for file in data_files(path)]
    return [(str(file), (found := file.stat()).st_size, found.st_mtime_ns, found.st_ino) for file in files]


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
    try:
        with path.open("rb", buffering=0) as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError as error:
        raise LogError(f"cannot be read: {error.strerror}", where=str(path)) from error
