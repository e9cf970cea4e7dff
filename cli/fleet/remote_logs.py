"""Logs at URLs: found and fetched through fsspec, one at a time, into a temporary file that goes when it was judged."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from collaudit.core.errors import CollauditError, ConfigError, NotJudgedError

#: Scheme to the extra that brings its backend.
EXTRAS = {"s3": "s3", "gs": "gs", "gcs": "gs", "az": "az", "abfs": "az", "http": "http", "https": "http"}
#: Share of the free space that a log may take.
_MOST_OF_DISK = 0.9
_PIECE_BYTES = 8 << 20


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
    try:
        system, path = _system(url)
        if any(sign in path for sign in "*?["):
            found = system.glob(path)
        elif system.isfile(path):
            found = [path]
        else:
            found = [one for one in system.find(path) if one.lower().endswith(suffixes)]
    except CollauditError:
        raise
    except Exception as error:  # every backend has exceptions of its own
        raise ConfigError("cannot be looked up", where=url, found=f"{type(error).__name__}: {error}") from error
    if not found:
        raise ConfigError("there is no log", where=url)
    return sorted(str(system.unstrip_protocol(one)) for one in found)


@contextmanager
def local_copy(url: str) -> Iterator[Path]:
    """A remote log as a file of the same name, for as long as the block lasts.

    Args:
        url: of one log.

    Raises:
        NotJudgedError: it cannot be fetched, or the disk has no room for it. ConfigError: the backend is missing.
    """
    with TemporaryDirectory(prefix="collaudit-remote-") as folder:
        target = Path(folder) / (url.rstrip("/").rpartition("/")[2] or "log")
        try:
            system, path = _system(url)
            free, size = shutil.disk_usage(folder).free, system.size(path)
            if size is not None and size > _MOST_OF_DISK * free:
                raise NotJudgedError(
                    "the log does not fit on the disk for temporary files",
                    where=url,
                    found=f"{size} bytes, {free} free",
                    hint="set TMPDIR to a larger one",
                )
            with system.open(path, "rb") as source, target.open("wb") as copy:
                shutil.copyfileobj(source, copy, _PIECE_BYTES)
            if size is not None and target.stat().st_size != size:
                raise NotJudgedError("the log was not fetched whole", where=url)
        except CollauditError:
            raise
        except Exception as error:  # every backend has exceptions of its own
            text = f"{type(error).__name__}: {error}"
            raise NotJudgedError("the log could not be fetched", where=url, found=text) from error
        yield target


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
