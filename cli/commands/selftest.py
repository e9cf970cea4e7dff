"""``collaudit selftest``: proof of an installation."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import click

from collaudit.cli.group import example_command
from collaudit.cli.words import note, progress
from collaudit.core.errors import EXIT_FAIL, EXIT_PASS


@example_command("selftest", "collaudit selftest", "collaudit selftest -o selftest.json")
@click.option("-o", "--output", type=click.Path(path_type=Path), metavar="FILE", help="Keep the result as JSON.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def command(output: Path | None, as_json: bool) -> int:
    """Simulate logs whose truth is known, audit them on this machine, and compare.

    Friction curves and intervals, pushes and their delay, the same audit from every log format, and a named
    finding for every kind of spoilt log.

    Exit code 0 when everything is as it should be, 1 otherwise.
    """
    from collaudit.cli.selftest import run_selftest, selftest_json
    from collaudit.reports.files import atomic_write
    from collaudit.reports.text import table

    note("simulating and auditing known-truth logs (about a minute) …")
    with TemporaryDirectory(prefix="collaudit-selftest-") as scratch, progress("selftest") as report:
        checks = run_selftest(Path(scratch), report)
    text = selftest_json(checks)
    if output is not None:
        atomic_write(output, text)
        note(f"result written to {output}")
    if as_json:
        click.echo(text, nl=False)
    else:
        rows = [("ok" if check.passed else "WRONG", check.name, check.expected, check.found) for check in checks]
        click.echo(table(("", "check", "expected", "found"), rows), nl=False)
    wrong = [check for check in checks if not check.passed]
    click.echo(f"{len(checks) - len(wrong)} of {len(checks)} checks passed", err=as_json)
    return EXIT_FAIL if wrong else EXIT_PASS
