"""How much a command prints: one screen, everything with ``-v``, the verdict alone with ``-q``."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum
from functools import wraps
from typing import Any

import click


class Detail(Enum):
    """How much is printed."""

    VERDICT = "verdict"
    SCREEN = "screen"
    ALL = "all"


def detail_options(function: Callable[..., int]) -> Callable[..., int]:
    """Add ``-v`` and ``-q`` to a command, which gets them as ``detail``."""

    @click.option("-v", "--verbose", is_flag=True, help="Print everything: every alarm, near miss and finding.")
    @click.option("-q", "--quiet", is_flag=True, help="Print the verdict alone.")
    @wraps(function)
    def wrapped(*args: Any, verbose: bool, quiet: bool, **kwargs: Any) -> int:
        if verbose and quiet:
            raise click.UsageError("give either -v or -q")
        detail = Detail.ALL if verbose else Detail.VERDICT if quiet else Detail.SCREEN
        return function(*args, detail=detail, **kwargs)

    return wrapped
