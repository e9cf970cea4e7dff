"""The one exception root of collaudit, with data as attributes.

Every expected failure is a :class:`CollauditError`. Only the command line catches it, prints
:meth:`CollauditError.render` and exits with :attr:`CollauditError.exit_code`.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

EXIT_PASS = 0
EXIT_FAIL = 1
EXIT_USAGE = 2
EXIT_NOT_JUDGED = 3
EXIT_INTERRUPTED = 130
EXIT_TERMINATED = 143


class CollauditError(Exception):
    """An expected failure that a user can act on.

    Args:
        message: what is wrong, in one sentence.
        where: file, and place inside it when known.
        found: what was there.
        expected: what should have been there.
        hint: what to do next.
        keys: dotted keys of the configuration that the hint tells, with their values.
    """

    exit_code = EXIT_USAGE

    def __init__(
        self,
        message: str,
        *,
        where: str | None = None,
        found: str | None = None,
        expected: str | None = None,
        hint: str | None = None,
        keys: Mapping[str, object] | None = None,
    ) -> None:
        super().__init__(message)
        self.message = message
        self.where = where
        self.found = found
        self.expected = expected
        self.hint = hint
        self.keys = keys or {}

    def render(self) -> str:
        """The error as the few lines a user reads."""
        head = f"{self.where}: {self.message}" if self.where else self.message
        lines = [head]
        for label, text in (("found", self.found), ("expected", self.expected), ("try", self.hint)):
            if text:
                lines.append(f"  {label + ':':<10}{text}")
        return "\n".join(lines)

    def __str__(self) -> str:
        return self.render()


class ConfigError(CollauditError):
    """The configuration or the command line does not say what is needed."""


class RobotError(CollauditError):
    """The robot description cannot be used."""


class LogError(CollauditError):
    """A log cannot be read, or holds nothing that could be judged."""

    exit_code = EXIT_NOT_JUDGED


class NotJudgedError(CollauditError):
    """A step could not be carried out on otherwise readable data."""

    exit_code = EXIT_NOT_JUDGED


def did_you_mean(found: str, known: Iterable[str]) -> str | None:
    """A hint that names the known name most like one that is not known; None where none is alike.

    Args:
        found: what was given.
        known: what could have been given.
    """
    by_lower = {name.lower(): name for name in known}
    close = difflib.get_close_matches(found.lower(), by_lower, n=1)
    return f"did you mean {by_lower[close[0]]!r}?" if close else None


def refuse_unknown(names: Iterable[str], known: Sequence[str], problem: str, where: str) -> None:
    """Refuse names of a configuration that are not known.

    Args:
        names: as stated.
        known: that can be meant.
        problem: what is wrong, in words; where: the key.

    Raises:
        ConfigError: some are not known.
    """
    unknown = [name for name in names if name not in known]
    if unknown:
        raise ConfigError(
            problem,
            where=where,
            found=", ".join(unknown),
            expected="some of " + ", ".join(known),
            hint=did_you_mean(unknown[0], known),
        )


def similar_file(path: Path) -> str | None:
    """A hint that names the file or folder beside a missing one that is called most like it; None without one."""
    try:
        names = [entry.name for entry in path.parent.iterdir()]
    except OSError:
        return None
    return did_you_mean(path.name, names)
