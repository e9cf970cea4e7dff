"""What people see of a running command: notes on stderr, findings, progress and the width of the terminal."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

import click

from collaudit.core.findings import Finding

_SEVERITY_COLOR = {"info": None, "warning": "yellow", "error": "red"}


def note(text: str) -> None:
    """A line on stderr."""
    click.echo(text, err=True)


def terminal_width() -> int | None:
    """Columns of the terminal that results go to; None for a file or a pipe, where nothing is cut."""
    return shutil.get_terminal_size().columns if sys.stdout.isatty() else None


def print_findings(findings: Sequence[Finding], err: bool = False) -> None:
    """One line a finding: severity, code, text, place."""
    for finding in findings:
        severity = click.style(f"{finding.severity:<8}", fg=_SEVERITY_COLOR[finding.severity])
        place = f" [{finding.where}]" if finding.where else ""
        click.echo(f"  {severity}{finding.code}: {finding.text}{place}", err=err)


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
