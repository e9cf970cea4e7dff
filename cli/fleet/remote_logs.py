"""Logs at URLs, through fsspec: large indexed MCAPs are read by ranges where they are, others fetched whole.

Either way there is a temporary file of the log's name for as long as it is judged, of which nothing is left after.
"""

from __future__ import annotations

import base64
import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal, NamedTuple

from collaudit.core.errors import CollauditError, ConfigError, NotJudgedError
from collaudit.core.logs.storage.partial_file import HashOf, PartialFile, kept_partial, partial_file

#: Scheme to the extra that brings its backend.
EXTRAS = {"s3": "s3", "gs": "gs", "gcs": "gs", "az": "az", "abfs": "az", "http": "http", "https": "http"}
#: Share of the free space that a log may take.
_MOST_OF_DISK = 0.9
#: Smaller logs are fetched whole, in one request.
_BY_RANGES_FROM = 16 << 20
#: Begin and end of an indexed MCAP are fetched at once: what recognises a log reads these bytes without asking.
_HEAD_BYTES, _TAIL_BYTES = 1 << 16, 1 << 18
_MCAP = b"\x89MCAP0\r\n"
#: What tells that an object was replaced, as backends call it.
_STAMPS = (
    "size", "ETag", "etag", "LastModified", "Last-Modified", "last_modified", "mtime", "updated", "generation",
    "version_id",
)  # fmt: skip
_SHA256 = re.compile(r"\s*([0-9a-fA-F]{64})\b")


class Fetched(NamedTuple):
    """What was fetched of a remote log: bytes of the log, bytes fetched, and what its hash is of."""

    size_bytes: int
    fetched_bytes: int
    hash_of: HashOf


def is_url(argument: str) -> bool:
    """Whether an argument names something remote."""
    return "://" in argument


def remote_logs(url: str) -> list[str]:
    """URLs of the logs that a URL, a pattern or a folder stands for, sorted.

    Raises:
        ConfigError: the backend is missing, or nothing is there.
    """
    from collaudit.core.logs.log_formats import FORMATS

    suffixes = tuple(suffix for known in FORMATS for suffix in known.suffixes)
    with _said(url, ConfigError, "cannot be looked up"):
        system, path = _system(url)
        if any(sign in path for sign in "*?["):
            found = system.glob(path)
        elif _is_file(system, path):
            return [url]
        else:
            found = [one for one in system.find(path) if one.lower().endswith(suffixes)]
    if not found:
        raise ConfigError("there is no log", where=url)
    scheme = url.partition("://")[0]  # kept as it was written, where a backend goes by several
    return sorted(one if "://" in one else f"{scheme}://{one}" for one in map(str, found))


def _is_file(system: Any, path: str) -> bool:
    """Whether a path is one object; its facts are asked for, since of HTTP fsspec would begin to fetch it."""
    try:
        return not path.endswith("/") and system.info(path)["type"] == "file"
    except FileNotFoundError:
        return False


@contextmanager
def local_copy(url: str, how: Literal["ranges", "whole"] = "ranges") -> Iterator[Path]:
    """A remote log as a file of the same name, for as long as the block lasts.

    A large MCAP becomes a file with holes, filled as it is read (:mod:`~collaudit.core.logs.storage.partial_file`).

    Args:
        url: of one log.
        how: ``whole`` fetches all of it in any case.

    Raises:
        NotJudgedError: it cannot be fetched, was replaced meanwhile, or the disk has no room for it.
        ConfigError: the backend is missing.
    """
    with TemporaryDirectory(prefix="collaudit-remote-") as folder:
        target = Path(folder) / (url.rstrip("/").rpartition("/")[2] or "log")
        with _said(url):
            system, path = _system(url)
            stamp = _stamp(system, path)
            held = _by_ranges(system, path, url, target) if how == "ranges" else None
            if held is None:
                _fetch_whole(system, path, url, target)
                _check_same(system, path, url, stamp)
        with held or nullcontext():
            yield target
        if held is not None:
            with _said(url):
                _check_same(system, path, url, stamp)


def fetched_of(file: Path) -> Fetched:
    """What was fetched so far of the log that :func:`local_copy` handed out."""
    partial = partial_file(file)
    if partial is None:
        size = file.stat().st_size
        return Fetched(size, size, "file")
    return Fetched(partial.size, partial.fetched, partial.hash_of)


@contextmanager
def _said(
    url: str, kind: type[CollauditError] = NotJudgedError, message: str = "the log could not be fetched"
) -> Iterator[None]:
    """Every backend has exceptions of its own: one of ours for all of them."""
    try:
        yield
    except CollauditError:
        raise
    except Exception as error:
        raise kind(message, where=url, found=f"{type(error).__name__}: {error}") from error


def _fetch_whole(system: Any, path: str, url: str, target: Path) -> None:
    size = system.size(path)
    _check_room(0 if size is None else size, target, url)
    system.get_file(path, str(target))  # a stream, also from servers that know no ranges
    if size is not None and target.stat().st_size != size:
        raise NotJudgedError("the log was not fetched whole", where=url)


def _check_room(size: int, target: Path, url: str) -> None:
    free = shutil.disk_usage(target.parent).free
    if size > _MOST_OF_DISK * free:
        raise NotJudgedError(
            "the log does not fit on the disk for temporary files",
            where=url,
            found=f"{size} bytes, {free} free",
            hint="set TMPDIR to a larger one",
        )


def _by_ranges(system: Any, path: str, url: str, target: Path) -> Any:
    """A large MCAP as a file with holes, to be entered; None where it is no such log, or its store serves no ranges."""
    info = system.info(path)
    size = info.get("size")
    if size is None or size < _BY_RANGES_FROM or not _serves_ranges(system, path, size):
        return None

    def fetch(start: int, count: int) -> bytes:
        _check_room(count, target, url)
        with _said(url):
            return bytes(system.cat_file(path, start=start, end=start + count))

    head, tail = fetch(0, _HEAD_BYTES), fetch(size - len(_MCAP), len(_MCAP))
    if len(head) != _HEAD_BYTES or not head.startswith(_MCAP) or tail != _MCAP:
        return None  # another format, a log that was cut, or a server that sends the whole log for any part
    file = PartialFile(target, size, fetch, _stated_sha256(system, path, url))
    file.fill(0, _HEAD_BYTES)
    file.fill(size - _TAIL_BYTES, _TAIL_BYTES)
    return kept_partial(file)


def _serves_ranges(system: Any, path: str, size: int) -> bool:
    """Whether parts can be fetched: servers of HTTP may answer with the whole log, which is not waited for."""
    if "://" not in path:
        return True
    try:
        with system.open(path, "rb", cache_type="none") as file:
            file.seek(size - 1)
            return len(file.read(1)) == 1
    except (OSError, ValueError):
        return False


def _check_same(system: Any, path: str, url: str, stamp: dict[str, str]) -> None:
    if _stamp(system, path) != stamp:
        raise NotJudgedError("the log was replaced while it was read", where=url)


def remote_stamp(url: str) -> dict[str, str]:
    """What changes when a remote log is replaced: size, ETag, time of change, as far as its store tells.

    Raises:
        NotJudgedError: it cannot be asked. ConfigError: the backend is missing.
    """
    with _said(url):
        return _stamp(*_system(url))


def _stamp(system: Any, path: str) -> dict[str, str]:
    system.invalidate_cache()
    info = system.info(path)
    return {key: str(info[key]) for key in _STAMPS if info.get(key) is not None}


def _stated_sha256(system: Any, path: str, url: str) -> str | None:
    """Hash of a log by its store's word: a file beside it as sha256sum writes it, or S3's own; None without either."""
    with suppress(Exception):  # most logs have none, and every backend says so in its own way
        published = _SHA256.match(system.cat_file(f"{path}.sha256", start=0, end=200).decode("ascii"))
        if published is not None:
            return published.group(1).lower()
    if url.startswith("s3://"):
        with suppress(Exception):
            bucket, _, key = path.partition("/")
            head = system.call_s3("head_object", Bucket=bucket, Key=key, ChecksumMode="ENABLED")
            text = head.get("ChecksumSHA256", "")
            if head.get("ChecksumType", "FULL_OBJECT") == "FULL_OBJECT" and "-" not in text:
                return base64.b64decode(text, validate=True).hex() if text else None
    return None


def _system(url: str) -> tuple[Any, str]:
    scheme = url.partition("://")[0]
    try:
        from fsspec.core import url_to_fs

        system, path = url_to_fs(url)
    except ImportError as error:
        raise ConfigError(
            f"logs at {scheme}:// need a backend that is not installed",
            where=url,
            hint=f"pip install 'collaudit[{EXTRAS.get(scheme, 'fleet')}]'",
        ) from error
    except ValueError as error:
        raise ConfigError(f"this URL cannot be used: {error}", where=url, expected=", ".join(EXTRAS)) from error
    return system, str(path)
