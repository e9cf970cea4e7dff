"""The sources as Python reads them, each parsed once a process: several tests of the project look at all of them."""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path


@cache
def parsed(path: Path) -> ast.Module:
    """A file's tree; no test changes it."""
    return ast.parse(path.read_text(encoding="utf-8"))
