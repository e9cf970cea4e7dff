"""Message definitions from folders of .msg files, for types whose definitions a log does not hold."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

from collaudit.core.errors import ConfigError
from collaudit.core.logs.messages.message_schema import SchemaError, definitions_of
from collaudit.core.logs.storage.records import MAX_SCHEMA_BYTES
from collaudit.core.small_files import read_small


@lru_cache(maxsize=8)
def _folder(folder: Path) -> dict[str, Any]:
    if not folder.is_dir():
        raise ConfigError("there is no such folder of message definitions", where=str(folder), hint="see --msg-path")
    files = sorted(folder.rglob("*.msg"))
    if not files:
        raise ConfigError("the folder holds no .msg files", where=str(folder), expected="PACKAGE/msg/Type.msg")
    found: dict[str, Any] = {}
    for file in files:
        found.update(_one(file))
    return found


def _one(file: Path) -> dict[str, Any]:
    """The definitions of one file; its package is the folder that holds ``msg``, or the folder itself."""
    holder = file.resolve().parent
    package = holder.parent.name if holder.name == "msg" else holder.name
    try:
        text = read_small(file, MAX_SCHEMA_BYTES).decode("utf-8", errors="replace")
        return dict(definitions_of(f"{package}/msg/{file.stem}", "ros2msg", text))
    except SchemaError as error:
        raise ConfigError(f"cannot be read as a message definition: {error}", where=str(file)) from error
    except OSError as error:
        raise ConfigError(f"cannot be read: {error.strerror}", where=str(file)) from error


def read_definitions(folders: Sequence[Path]) -> dict[str, Any]:
    """Definitions by type name.

    Args:
        folders: each holds PACKAGE/msg/Type.msg at any depth, of ROS 1 or ROS 2.

    Raises:
        ConfigError: a folder is missing or empty, or a file is no message definition.
    """
    found: dict[str, Any] = {}
    for folder in folders:
        found.update(_folder(folder))
    return found
