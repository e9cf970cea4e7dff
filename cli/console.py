"""What people see of a running command: notes, findings, a bar while something takes long; and how much of it."""

from __future__ import annotations

import os
import re
import shutil
import sys
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TextIO

import click

from collaudit.core.findings import Finding
from collaudit.reports.values.visible_text import visible_json, visible_lines, wrapped

_STEPS = 1000
#: Clears a line; of a bar that has ended, which stands above the cursor.
_CLEAR, _CLEAR_ABOVE = "\r\x1b[K", "\x1b[1A\x1b[2K"

_active: list[object] = []
_COLOUR = re.compile(r"(\x1b\[[0-9;]*m)")
_VERDICT = re.compile(r"^(PASS|FAIL|NOT JUDGED)(, WITH EXCLUSIONS)?(?=  )", re.MULTILINE)
_WARNING = re.compile(r"^  (warning|error)(?= )", re.MULTILINE)
_LABEL = re.compile(r" *(?:found|expected|try): +|- ")
_VERDICT_COLOR = {"PASS": "green", "FAIL": "red", "NOT JUDGED": "yellow"}
_SEVERITY_COLOR = {"info": None, "warning": "yellow", "error": "red"}
#: So many kinds of finding are named where only their first words are said.
_MOST_SHORT = 3


@contextmanager
def progress(label: str) -> Iterator[Callable[[int, int], None]]:
    """A bar on stderr while it is a terminal; yields ``report(done, total)``."""
    if not sys.stderr.isatty():
        yield lambda _done, _total: None
        return
    with click.progressbar(length=_STEPS, label=label, file=sys.stderr) as bar:

        def report(done: int, total: int) -> None:
            if total > 0:
                bar.update(max(0, _STEPS * done // total - bar.pos))

        _active.append(bar)
        try:
            yield report
        finally:
            _active.remove(bar)
    sys.stderr.write(_CLEAR_ABOVE)


def silence_library_warnings() -> None:
    """Keep warnings of libraries, which carry paths of source files, off stderr.

    They are for developers: ``COLLAUDIT_DEBUG`` or ``python -W`` shows them. What a user must know is a finding.
    """
    if not sys.warnoptions and os.environ.get("COLLAUDIT_DEBUG", "") in ("", "0"):
        warnings.simplefilter("ignore")


def say(text: str, *, err: bool = False, nl: bool = True) -> None:
    """Write text: the only way to stdout and stderr.

    Names from logs, files and settings may hold anything: what could steer a terminal or a CI system is spelt out.
    Colours of :func:`click.style` stay.
    """
    parts = _COLOUR.split(text)
    if _active:
        sys.stderr.write(_CLEAR)  # the text stands in place of the bar, which is drawn again below it
    click.echo("".join(part if k % 2 else visible_lines(part) for k, part in enumerate(parts)), err=err, nl=nl)


def say_result(text: str) -> None:
    """Write lines of a result; on a terminal the verdict at the beginning of a line has its colour."""
    coloured = _VERDICT.sub(lambda match: click.style(match[0], fg=_VERDICT_COLOR[match[1]], bold=True), text)
    say(_WARNING.sub(lambda match: click.style(match[0], fg=_SEVERITY_COLOR[match[1]]), coloured), nl=False)


def say_json(text: str) -> None:
    """Write JSON to stdout."""
    click.echo(visible_json(text), nl=False)


def say_object(schema: str, content: Mapping[str, object], indent: int = 2) -> None:
    """Write what a command answers with ``--json``: its schema, then its content."""
    from collaudit.reports.files.written_files import json_text

    say_json(json_text({"schema": schema, **content}, indent))


def say_document(text: str) -> None:
    """Write a document of a report format to stdout as it is: its writer has spelt out what it was given."""
    click.echo(text, nl=False)


def note(text: str) -> None:
    """Lines on stderr; on a terminal they are folded at words, under the text behind a label such as ``found:``."""
    width = terminal_width(sys.stderr)
    say("\n".join(wrapped(line, width, _under(line)) for line in text.split("\n")), err=True)


def _under(line: str) -> str:
    """What the lines that a line goes on in begin with."""
    label = _LABEL.match(line)
    return " " * len(label[0]) if label else " " * (len(line) - len(line.lstrip()) + 2)


def terminal_width(stream: TextIO | None = None) -> int | None:
    """Columns of the terminal that a stream, or stdout, goes to; None for a file or a pipe, where nothing is cut."""
    return shutil.get_terminal_size().columns if (stream or sys.stdout).isatty() else None


def print_findings(findings: Sequence[Finding], err: bool = False, brief: bool = False, short: bool = False) -> None:
    """Severity, code, text, place; a line for all joints or logs of which the same is found.

    ``brief``: of three and more joints that differ in numbers only, the numbers of the first. ``short``: one line a
    kind.
    """
    from collaudit.reports.sections.finding_sections import finding_lines, short_finding_lines

    width = terminal_width(sys.stderr if err else sys.stdout)
    lines = short_finding_lines(findings) if short else finding_lines(findings, brief)
    for severity, line in lines[: _MOST_SHORT if short else None]:
        text = wrapped(f"  {severity:<8}{line}", width, " " * 10)
        head = click.style(f"  {severity:<8}", fg=_SEVERITY_COLOR[severity])
        say(head + text.removeprefix(f"  {severity:<8}"), err=err)
    if short and lines:
        more = f"{len(lines) - _MOST_SHORT} more kinds, and all" if len(lines) > _MOST_SHORT else "all"
        say(f"  {more} in full: -v", err=err)


verbose_option = click.option(
    "-v", "--verbose", is_flag=True, help="Print everything: every alarm, near miss and finding."
)
