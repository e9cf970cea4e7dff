"""What people see of a running command: notes on stderr, findings, progress and the width of the terminal."""

from __future__ import annotations

import re
import shutil
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

import click

from collaudit.core.findings import Finding
from collaudit.reports.values.visible_text import visible, visible_json, visible_lines

_COLOUR = re.compile(r"(\x1b\[[0-9;]*m)")
_SEVERITY_COLOR = {"info": None, "warning": "yellow", "error": "red"}


def say(text: str, *, err: bool = False, nl: bool = True) -> None:
    """Write text: the only way to stdout and stderr.

    Names from logs, files and settings may hold anything: what could steer a terminal or a CI system is spelt out.
    Colours of :func:`click.style` stay.
    """
    parts = _COLOUR.split(text)
    click.echo("".join(part if k % 2 else visible_lines(part) for k, part in enumerate(parts)), err=err, nl=nl)


def say_json(text: str) -> None:
    """Write JSON to stdout."""
    click.echo(visible_json(text), nl=False)


def say_document(text: str) -> None:
    """Write a document of a report format to stdout as it is: its writer has spelt out what it was given."""
    click.echo(text, nl=False)


def note(text: str) -> None:
    """A line on stderr."""
    say(text, err=True)


def terminal_width() -> int | None:
    """Columns of the terminal that results go to; None for a file or a pipe, where nothing is cut."""
    return shutil.get_terminal_size().columns if sys.stdout.isatty() else None


def print_findings(findings: Sequence[Finding], err: bool = False) -> None:
    """One line a finding: severity, code, text, place."""
    for finding in findings:
        severity = click.style(f"{finding.severity:<8}", fg=_SEVERITY_COLOR[finding.severity])
        place = f" [{finding.where}]" if finding.where else ""
        say(f"  {severity}{finding.code}: {visible(finding.text)}{visible(place)}", err=err)


@contextmanager
def progress(label: str) -> Iterator[Callable[[int, int], None]]:
    """A bar on stderr while it is a terminal; yields ``report(done, total)``."""
    if not sys.stderr.isatty():
        yield lambda _done, _total: None
        return
    with click.progressbar(length=1, label=label, file=sys.stderr) as bar:

        def report(done: int, total: int) -> None:
            bar.length = max(total, 1)
            bar.update(max(done - bar.pos, 0))

        yield report
