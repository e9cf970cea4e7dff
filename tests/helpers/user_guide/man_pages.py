"""Manual pages out of the commands themselves, as roff for ``man``."""

from __future__ import annotations

import re
from collections.abc import Iterator
from inspect import cleandoc

import click

from collaudit.cli.group import ExampleCommand
from collaudit.cli.main import collaudit

_EXIT = (
    ("0", "judged, policy kept"),
    ("1", "judged, policy broken; wins over 3"),
    ("2", "usage or configuration error, or a bug"),
    ("3", "something could not be judged; never a pass"),
    ("130", "interrupted"),
)


def man_pages() -> dict[str, str]:
    """File name to manual page: one for the program, one for each command."""
    top = click.Context(collaudit, info_name="collaudit")
    made = {"collaudit.1": _program()}
    for name, summary in collaudit.summaries.items():
        command = collaudit.get_command(top, name)
        assert isinstance(command, ExampleCommand)
        made[f"collaudit-{name}.1"] = _command(command, summary, top)
    return made


def _program() -> str:
    lines = _head("collaudit", "audit robot logs for collisions")
    lines += [".SH SYNOPSIS", ".B collaudit", "COMMAND [OPTIONS] [ARGUMENTS]", ".SH DESCRIPTION"]
    lines += _paragraphs(collaudit.help or "")
    lines.append(".SH COMMANDS")
    for name, summary in collaudit.summaries.items():
        lines += [".TP", f".BR collaudit\\-{name} (1)", _roff(summary)]
    lines += [".SH OPTIONS", *_options(collaudit), *_exit_status(), ".SH ENVIRONMENT"]
    for name, text in (
        ("NO_COLOR", "No colours, if it is not empty."),
        ("COLLAUDIT_DEBUG", "Tracebacks of unexpected errors."),
    ):
        lines += [".TP", f".B {name}", text]
    lines += [".SH EXAMPLES", ".nf", *map(_roff, collaudit.examples), ".fi"]
    return "\n".join(lines) + "\n"


def _command(command: ExampleCommand, summary: str, top: click.Context) -> str:
    context = click.Context(command, info_name=str(command.name), parent=top)
    title = f"collaudit-{command.name}"
    usage = " ".join(command.collect_usage_pieces(context))
    lines = _head(title, summary.rstrip("."))
    lines += [".SH SYNOPSIS", f".B collaudit {command.name}", _roff(usage), ".SH DESCRIPTION"]
    lines += _paragraphs(command.help or "")
    lines += [".SH OPTIONS", *_options(command), *_exit_status()]
    lines += [".SH EXAMPLES", ".nf", *map(_roff, command.examples), ".fi", ".SH SEE ALSO", ".BR collaudit (1)"]
    return "\n".join(lines) + "\n"


def _head(title: str, summary: str) -> list[str]:
    name = _roff(title)
    return [
        f'.TH "{name.upper()}" 1 "" collaudit "collaudit manual"',
        ".SH NAME",
        f"{name} \\- {_roff(summary[:1].lower() + summary[1:])}",
    ]


def _paragraphs(text: str) -> Iterator[str]:
    """Paragraphs of a help text; those that click must not wrap stay lines."""
    for k, part in enumerate(cleandoc(text).split("\n\n")):
        if k:
            yield ".PP"
        if part.startswith("\b"):
            yield ".nf"
            yield from map(_roff, part.removeprefix("\b").strip("\n").split("\n"))
            yield ".fi"
        else:
            yield _roff(" ".join(part.split()))


def _options(command: click.Command) -> Iterator[str]:
    context = click.Context(command)
    for param in command.get_params(context):
        record = param.get_help_record(context)
        if record is not None:
            yield from (".TP", f".B {_roff(record[0])}", _roff(record[1]))


def _exit_status() -> Iterator[str]:
    yield ".SH EXIT STATUS"
    for code, meaning in _EXIT:
        yield from (".TP", f".B {code}", meaning)


def _roff(text: str) -> str:
    """Text that roff takes for nothing but text."""
    plain = text.replace("\\", "\\e").replace("-", "\\-").replace("'", "\\(aq")
    plain = "".join(char if ord(char) < 128 else f"\\[u{ord(char):04X}]" for char in plain)
    return re.sub(r"^([.'])", r"\\&\1", plain)
