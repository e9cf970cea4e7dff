"""ROS 2 bag folders: which files hold the data."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

from collaudit.core.errors import LogError
from collaudit.core.logs.storage.file_content import unpacked_name
from collaudit.core.logs.storage.readers import Damage
from collaudit.core.small_files import read_small

_MAX_METADATA = 8 << 20
#: What rosbag2's plugins for compression are called in metadata.yaml, of those that are read.
PACKINGS = ("zstd", "lz4")


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
