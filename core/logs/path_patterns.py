"""Glob patterns over folders, without walking in circles."""

from __future__ import annotations

from pathlib import Path


def matching_paths(pattern: str) -> list[Path]:
    """Paths that a glob pattern names, sorted by their text.

    ``**`` enters no folder through a symbolic link: a link to a folder above would be followed in circles.

    Args:
        pattern: with ``*``, ``?``, ``[…]`` and ``**``; hidden names match only where the pattern spells the dot.
    """
    whole = Path(pattern) / "*" if pattern.endswith("**") else Path(pattern)
    found = Path(whole.anchor).glob(str(whole.relative_to(whole.anchor)))
    return sorted({path for path in found if _hidden(path) == _hidden(whole)}, key=str)


def _hidden(path: Path) -> int:
    """Number of hidden names in a path."""
    return sum(name.startswith(".") for name in path.parts)
