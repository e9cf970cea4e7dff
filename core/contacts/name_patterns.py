"""Patterns of logs' names and paths, and the program that a log's name stands for."""

from __future__ import annotations

import re
from collections.abc import Iterable
from fnmatch import fnmatchcase

#: A date or a time in a name: four digits or more, and digits joined to them.
_STAMP = re.compile(r"\d{4,}(?:[-_:.T]?\d+)*|\d{2}(?:[-_:]\d{2}){2,}")


def matches(text: str, patterns: Iterable[str]) -> bool:
    """Whether a path, URL or name is meant by one of the patterns.

    Args:
        text: with ``/`` between folders.
        patterns: with ``*`` (over folders, too), ``?`` and ``[…]``. One that does not begin with ``/`` or a scheme is
            also tried from every folder on: ``cell1/*`` means ``logs/cell1/a.mcap``, and not ``logs/xcell1/a.mcap``.
    """
    plain = text.removeprefix("./")
    return any(fnmatchcase(plain, pattern) or fnmatchcase(plain, f"*/{pattern}") for pattern in patterns)


def program_of(name: str) -> str:
    """The name of a log with ``#`` in place of dates and times: tomorrow's run of the program has the same.

    ``cell1/pick_2026-11-28_031502.mcap`` becomes ``cell1/pick_#.mcap``; ``run2.csv`` stays.
    """
    return _STAMP.sub("#", name)


def runs_program(program: str, name: str, path: str) -> bool:
    """Whether a log is a run of a program, by its name in the audit or by the end of its path, whole folders.

    Args:
        program: as :func:`program_of` gives it.
        name, path: of the log.
    """
    return program == program_of(name) or f"/{program_of(path)}".endswith(f"/{program}")
