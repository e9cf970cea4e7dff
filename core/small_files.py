"""Files that settings and arguments name beside the log: read whole, so only regular ones, and only so much."""

from __future__ import annotations

import errno
import hashlib
import json
import stat
from pathlib import Path
from typing import Any

from collaudit.core.errors import ConfigError

#: No description of a robot, configuration, list of labels or note of a run is larger.
MOST_BYTES = 64 << 20


def check_regular(path: Path) -> None:
    """Refuse what has no end or waits for another program: a device, a pipe, a socket.

    Raises:
        OSError: it is one, or nothing is there.
    """
    mode = path.stat().st_mode
    if not stat.S_ISREG(mode) and not stat.S_ISDIR(mode):  # a folder is refused in its own words where it is opened
        raise OSError(errno.EINVAL, "a pipe, a device or a socket, not a file", str(path))


def read_small(path: Path, most: int = MOST_BYTES) -> bytes:
    """The bytes of a regular file of at most so many.

    Raises:
        OSError: it cannot be read, is no regular file, or is longer.
    """
    check_regular(path)
    with path.open("rb") as file:
        data = file.read(most + 1)  # what the system says of its size may be wrong
    if len(data) > most:
        raise OSError(errno.EFBIG, f"longer than {most >> 20} MiB", str(path))
    return data


def read_object(path: Path, most: int = MOST_BYTES) -> dict[str, Any]:
    """The JSON object in a file of at most so many bytes; empty where it cannot be read or is none."""
    try:
        content = json.loads(read_small(path, most))
    except (OSError, ValueError, RecursionError):
        return {}
    return content if isinstance(content, dict) else {}


def file_sha256(path: Path) -> str:
    """Hash of a file's bytes.

    Raises:
        ConfigError: it cannot be read.
    """
    try:
        check_regular(path)
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise ConfigError(f"cannot be read: {error.strerror}", where=str(path)) from error
