"""Glob patterns over folders, without walking in circles."""

from __future__ import annotations

import glob
import os
from collections.abc import Iterator


def matching_paths(pattern: str) -> list[str]:
    """Paths that a glob pattern names, sorted.

    As :func:`glob.glob` with ``recursive=True``, but ``**`` enters no folder through a symbolic link: a link to
    a folder above would be followed in circles.

    Args:
        pattern: with ``*``, ``?``, ``[…]`` and ``**``; hidden names match only where the pattern spells the dot.
    """
    return sorted(set(_matches(pattern)))


def _matches(pattern: str) -> Iterator[str]:
    parts = pattern.split("/")
    if "**" not in parts:
        yield from glob.glob(pattern)  # noqa: PTH207 - Path.glob refuses absolute patterns and shows hidden files
        return
    at = parts.index("**")
    head, tail = "/".join(parts[:at]), "/".join(parts[at + 1 :])
    root = "/" if pattern.startswith("/") and not head else head
    for base in glob.glob(root) if root else [""]:  # noqa: PTH207
        for folder, inside, _ in os.walk(base or os.curdir):
            inside[:] = sorted(name for name in inside if not name.startswith("."))
            place = folder if base else os.path.relpath(folder)
            stem = "" if place == os.curdir and not base else glob.escape(place) + "/"
            yield from _matches(stem + (tail or "*"))
