"""Texts in a log's own metadata that may be its robot's serial number. Nothing is decoded for them."""

from __future__ import annotations

import re
from pathlib import Path

from collaudit.core.api import LogFiles
from collaudit.core.small_files import read_small

_HEAD_BYTES = 1 << 16
_WORD = re.compile(r"[^\s,;:=\"'#]+")


def stated_serials(files: LogFiles) -> set[str]:
    """Values of MCAP metadata records, of a bag folder's ``custom_data``, and words of a table's leading ``#`` lines.

    Args:
        files: of one log.
    """
    found: set[str] = set()
    for path in files:
        if path.is_dir():
            found |= _of_bag_folder(path)
            found |= {value for part in sorted(path.glob("*.mcap")) for value in _of_file(part)}
        else:
            found |= _of_file(path)
    return found


def _of_file(path: Path) -> set[str]:
    with path.open("rb") as file:
        head = file.read(_HEAD_BYTES)
    if head.startswith(b"\x89MCAP"):
        from collaudit.core.logs.mcap.mcap_records import metadata_values

        return metadata_values(path)
    words: set[str] = set()
    for line in head.decode("utf-8", "replace").splitlines():
        if not line.startswith("#"):
            break
        words |= set(_WORD.findall(line))
    return words


def _of_bag_folder(path: Path) -> set[str]:
    """The indented ``key: value`` lines below ``custom_data:`` of metadata.yaml."""
    try:
        lines = read_small(path / "metadata.yaml").decode("utf-8", errors="replace").splitlines()
    except OSError:
        return set()
    found: set[str] = set()
    depth: int | None = None
    for line in lines:
        indent = len(line) - len(line.lstrip())
        if line.strip() == "custom_data:":
            depth = indent
        elif depth is not None and indent > depth and ":" in line:
            found.add(line.partition(":")[2].strip().strip("\"'"))
        elif depth is not None and line.strip():
            depth = None
    return found
