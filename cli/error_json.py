"""Errors for machines: with ``--json`` a command that fails prints one JSON object on stdout, the text on stderr."""

from __future__ import annotations

import json
from collections.abc import Sequence

import click

from collaudit.cli.console import say_json
from collaudit.core.errors import CollauditError

ERROR_SCHEMA = "collaudit/error/1"


def wants_json(arguments: Sequence[str]) -> bool:
    """Whether a command line asks for JSON; what follows ``--`` is no option."""
    before = arguments[: arguments.index("--")] if "--" in arguments else arguments
    return "--json" in before


def say_error_json(error: BaseException, exit_code: int) -> None:
    """Print an error as JSON on stdout.

    Args:
        error: what ended the command.
        exit_code: of the command.
    """
    content: dict[str, object] = {"schema": ERROR_SCHEMA, "exit_code": exit_code, **_facts(error)}
    say_json(json.dumps(content, ensure_ascii=True, indent=2, allow_nan=False) + "\n")


def _facts(error: BaseException) -> dict[str, object]:
    if isinstance(error, CollauditError):
        names = ("message", "where", "found", "expected", "hint")
        return {"kind": type(error).__name__, **{name: _plain(getattr(error, name)) for name in names}}
    if isinstance(error, click.ClickException):
        return {"kind": "UsageError", "message": error.format_message()}
    if isinstance(error, OSError):
        return {"kind": "OSError", "message": error.strerror or str(error), "where": _plain(error.filename)}
    return {"kind": type(error).__name__, "message": str(error)}


def _plain(value: object) -> str | None:
    return None if value is None else str(value).encode("utf-8", "backslashreplace").decode("utf-8")
