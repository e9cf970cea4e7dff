"""Words for people: notes on stderr, progress on a terminal, tables as plain text."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

import click

from collaudit.core.findings import Finding

_SEVERITY_COLOR = {"info": None, "warning": "yellow", "error": "red"}


def note(text: str) -> None:
    """A line on stderr."""
    click.echo(text, err=True)


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


def bytes_text(size: int) -> str:
    """A size in the unit a reader thinks in."""
    value, units = float(size), ["B", "kB", "MB", "GB"]
    while value >= 1000 and len(units) > 1:
        value, units = value / 1000, units[1:]
    return f"{value:.0f} {units[0]}" if units[0] == "B" else f"{value:.1f} {units[0]}"
