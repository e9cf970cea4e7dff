"""Files of which only parts are on this disk: what is read of them is fetched first.

In: a path, the file's size, and what fetches bytes. Out: an ordinary file with holes, in which no reader of this
program meets a hole: :class:`~collaudit.core.logs.storage.file_reading.RandomFile` asks here before it reads. Readers
know files by their paths, and names and sizes of files enter results, so that this is no other kind of path.
"""

from __future__ import annotations

import hashlib
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from io import BufferedIOBase, RawIOBase
from pathlib import Path
from typing import Literal

from collaudit.core.errors import LogError
from collaudit.core.findings import Finding, fact

#: Bytes from a place on; fewer than asked for is an error of the file's store.
Fetch = Callable[[int, int], bytes]
#: What a log's hash is of: its bytes; what its store says of its bytes; or the parts that were read.
HashOf = Literal["file", "stated", "parts"]

_PIECE_BYTES = 8 << 20
#: Hashed at once: a thread that hashes and asks for Python's lock after each of a few kB holds up all others.
_HASHED_BYTES = 2 << 20
#: Parts so close to each other are fetched at once: a request takes as long as these bytes.
_GAP_BYTES = 1 << 16
#: Where more than this share of a file is expected to be read, all of it is fetched, and its hash is its own.
_MOST_SHARE = 0.5
#: Begins what is hashed where only parts were read.
_PARTS_HEAD = b"collaudit hash of parts 1\n"

_known: dict[str, PartialFile] = {}


class PartialFile:
    """A file with holes and what fills them; safe under threads.

    Attributes:
        path: of the file.
        size: of the whole, bytes.
        fetched: bytes fetched so far.
    """

    def __init__(self, path: Path, size: int, fetch: Fetch, stated_sha256: str | None = None) -> None:
        """Make the file, all of it a hole.

        Args:
            path: where.
            size: of the whole, bytes.
            fetch: bytes of it from a place on.
            stated_sha256: what its store says of the whole.
        """
        self.path, self.size, self.fetched = path, size, 0
        self._fetch, self._stated = fetch, stated_sha256
        self._there: list[tuple[int, int]] = []
        self._lock = threading.Lock()
        with path.open("wb") as file:
            file.truncate(size)

    def fill(self, start: int, count: int) -> None:
        """Have these bytes.

        Raises:
            LogError: they cannot be fetched.
        """
        with self._lock:
            for hole in [*self._holes(max(start, 0), min(start + count, self.size))]:
                self._take(*hole)

    def expect(self, spans: Sequence[tuple[int, int]]) -> None:
        """Have what will be read, as (start, count): it is fetched in few requests then, or as a whole."""
        blocks = _joined([(start, min(start + count, self.size)) for start, count in spans], _GAP_BYTES)
        if sum(stop - start for start, stop in blocks) > _MOST_SHARE * self.size:
            blocks = [(0, self.size)]
        for start, stop in blocks:
            self.fill(start, stop - start)

    @property
    def hash_of(self) -> HashOf:
        """What :meth:`sha256` is the hash of."""
        if self._there == [(0, self.size)]:
            return "file"
        return "parts" if self._stated is None else "stated"

    def sha256(self) -> str:
        """The hash: of the file where all of it is there; as stated; or of size, places and bytes of what was read."""
        if self.hash_of == "stated" and self._stated is not None:
            return self._stated
        with self._lock, self.path.open("rb") as file:
            if self.hash_of == "file":
                return stream_sha256(file)
            digest = hashlib.sha256(_PARTS_HEAD + f"{self.size}\n".encode())
            for start, stop in self._there:
                digest.update(f"{start} {stop}\n".encode())
                file.seek(start)
                for at in range(start, stop, _PIECE_BYTES):
                    digest.update(file.read(min(_PIECE_BYTES, stop - at)))
            return digest.hexdigest()

    def _holes(self, start: int, stop: int) -> Iterator[tuple[int, int]]:
        for first, last in self._there:
            if first >= stop:
                break
            if last > start:
                if first > start:
                    yield start, first
                start = last
        if start < stop:
            yield start, stop

    def _take(self, start: int, stop: int) -> None:
        with self.path.open("r+b") as file:
            file.seek(start)
            for at in range(start, stop, _PIECE_BYTES):
                count = min(_PIECE_BYTES, stop - at)
                data = self._fetch(at, count)
                if len(data) != count:
                    raise LogError("was not fetched whole", where=self.path.name, found=f"{len(data)} of {count} bytes")
                file.write(data)
                self.fetched += count
        self._there = _joined([*self._there, (start, stop)], 0)


def _joined(spans: Sequence[tuple[int, int]], gap: int) -> list[tuple[int, int]]:
    """Spans in order, those joined that overlap or are no further apart than ``gap``."""
    out: list[tuple[int, int]] = []
    for start, stop in sorted(spans):
        if out and start <= out[-1][1] + gap:
            out[-1] = (out[-1][0], max(out[-1][1], stop))
        else:
            out.append((start, stop))
    return out


@contextmanager
def kept_partial(file: PartialFile) -> Iterator[PartialFile]:
    """Let readers of the file's path fill it, for as long as the block lasts."""
    _known[str(file.path)] = file
    try:
        yield file
    finally:
        del _known[str(file.path)]


def partial_file(path: Path) -> PartialFile | None:
    """The file of a path as one with holes, or None where it is an ordinary one."""
    return _known.get(str(path)) if _known else None


def hash_findings(path: Path) -> list[Finding]:
    """What is to be said of a log's hash where it is not that of the file's bytes, nor stated by its store."""
    file = partial_file(path)
    if file is None or file.hash_of != "parts":
        return []
    text = (
        f"{file.fetched / 1e6:.3g} of {file.size / 1e6:.3g} MB were fetched: the summary and the chunks that hold "
        "what was read. The log's hash is of these parts, not of the whole file."
    )
    return [fact(text, where=path.name)]


def stream_sha256(stream: BufferedIOBase | RawIOBase) -> str:
    """Hash of what is left of a file's bytes."""
    digest, piece = hashlib.sha256(), memoryview(bytearray(_HASHED_BYTES))
    while count := stream.readinto(piece):
        digest.update(piece[:count])
    return digest.hexdigest()
