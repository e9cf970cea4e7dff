"""``collaudit selftest``: proof of an installation."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import click

from collaudit.cli.console import note, progress
from collaudit.cli.group import example_command
from collaudit.core.errors import EXIT_FAIL, EXIT_PASS

if TYPE_CHECKING:
    from collaudit.fixtures.installation_checks import Selftest


@example_command("selftest", "collaudit selftest", "collaudit selftest -o selftest.json", "collaudit selftest --seed 7")
@click.option("-o", "--output", type=click.Path(path_type=Path), metavar="FILE", help="Keep the result as JSON.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
@click.option("--seed", type=click.IntRange(min=0), default=1, show_default=True, help="Of the simulated logs.")
@click.option("--keep", type=click.Path(path_type=Path), metavar="DIR", help="Keep the simulated logs there.")
def command(output: Path | None, as_json: bool, seed: int, keep: Path | None) -> int:
    """Simulate logs whose truth is known, audit them on this machine, and compare.

    Friction curves, pushes and their delay, clean motion without alarms, the same audit from every log
    format, and a named finding for spoilt logs.

    Exit code 0 when everything is as it should be, 1 otherwise.
    """
    from collaudit.fixtures.installation_checks import run_selftest
    from collaudit.reports.files.run_files import atomic_write

    note("simulating and auditing known-truth logs (a minute or two) …")
    with TemporaryDirectory(prefix="collaudit-selftest-") as scratch, progress("selftest") as report:
        result = run_selftest(keep or Path(scratch), seed=seed, progress=report)
    if output is not None:
        atomic_write(output, result.to_json())
        note(f"result written to {output}")
    click.echo(result.to_json() if as_json else _text(result), nl=False)
    return EXIT_PASS if result.passed else EXIT_FAIL


def _text(result: Selftest) -> str:
    from collaudit.reports.terminal.audit_text import table

    rows = [("ok" if row.passed else "WRONG", row.robot, row.check, row.wanted, row.found) for row in result.rows]
    passed = sum(row.passed for row in result.rows)
    return table(("", "robot", "check", "wanted", "found"), rows) + f"\n{passed} of {len(rows)} checks passed\n"
