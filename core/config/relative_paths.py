"""Where a path that a configuration names lies: the one place that resolves relative ones."""

from __future__ import annotations

from pathlib import Path


def located(path: Path, base_dir: Path) -> Path:
    """The path as it is found from the working folder.

    Args:
        path: as the configuration gives it.
        base_dir: folder of the configuration file, from which relative paths start.
    """
    return base_dir / path
