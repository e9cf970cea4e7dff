"""Logs at URLs, fetched whole by fsspec into a temporary file of the log's name, for as long as they are judged."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from collaudit.core.errors import CollauditError, ConfigError, NotJudgedError
from collaudit.core.logs.storage.file_content import is_trace

#: Scheme to the extra that brings its backend.
EXTRAS = {"s3": "s3", "gs": "gs", "gcs": "gs", "az": "az", "abfs": "az", "http": "http", "https": "http"}
#: Share of the free space that a log may take.
_MOST_OF_DISK = 0.9
#: What tells that an object was replaced, as backends call it.
_STAMPS = (
    "size", "ETag", "etag", "LastModified", "Last-Modified", "last_modified", "mtime", "updated", "generation",
    "version_id",
)  # fmt: skip


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


def remote_others(url: str) -> list[str]:
    """URLs of what a remote folder holds besides logs, sorted; nothing for a log or a pattern."""
    with _said(url, ConfigError, "cannot be looked up"):
        system, path = _system(url)
        if any(sign in path for sign in "*?[") or _is_file(system, path):
            return []
        scheme, logs = url.partition("://")[0], set(remote_logs(url))
        found = (one if "://" in one else f"{scheme}://{one}" for one in map(str, system.find(path)))
        return sorted(set(found) - logs)


@contextmanager
def local_copy(url: str) -> Iterator[Path]:
    """A remote log as a file of the same name, for as long as the block lasts.

    Args:
        url: of one log.

    Raises:
        NotJudgedError: it cannot be fetched, was replaced meanwhile, is one file of several, or the disk has no room.
        ConfigError: the backend is missing.
    """
    with TemporaryDirectory(prefix="collaudit-remote-") as folder:
        target = Path(folder) / (url.rstrip("/").rpartition("/")[2] or "log")
        with _said(url):
            system, path = _system(url)
            stamp = _stamp(system, path)
            _fetch(system, path, url, target)
            if _stamp(system, path) != stamp:
                raise NotJudgedError("the log was replaced while it was fetched", where=url)
        if is_trace(target):
            raise NotJudgedError(
                "a KUKA trace is several files, and a URL names one of them",
                where=url,
                expected="a .dat and a .r64 for each axis",
                hint="fetch all of them into one folder, and name that folder",
            )
        yield target


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


def _fetch(system: Any, path: str, url: str, target: Path) -> None:
    size, free = system.size(path), shutil.disk_usage(target.parent).free
    if size is not None and size > _MOST_OF_DISK * free:
        raise NotJudgedError(
            "the log does not fit on the disk for temporary files",
            where=url,
            found=f"{size} bytes, {free} free",
            hint="set TMPDIR to a larger one",
        )
    system.get_file(path, str(target))
    if size is not None and target.stat().st_size != size:
        raise NotJudgedError("the log was not fetched whole", where=url)


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
