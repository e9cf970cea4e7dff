"""``collaudit selftest``: proof of an installation."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import click

from collaudit.cli.console import note, progress, say, say_json, terminal_width
from collaudit.cli.group import example_command
from collaudit.core.errors import EXIT_FAIL, EXIT_PASS


@example_command("selftest", "collaudit selftest", "collaudit selftest --json")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def command(as_json: bool) -> int:
    """Simulate logs whose truth is known, audit them on this machine, and compare.

    Friction curves, pushes and their delay, clean motion without alarms, the same audit from every log
    format, and a named finding for spoilt logs.

    Exit code 0 when everything is as it should be, 1 otherwise.
    """
    from collaudit.fixtures.installation_checks import run_selftest
    from collaudit.reports.files.json_files import json_text
    from collaudit.reports.terminal.command_texts import checks_text

    note("simulating and auditing known-truth logs (a minute or two) …")
    with TemporaryDirectory(prefix="collaudit-selftest-") as scratch, progress("selftest") as report:
        result = run_selftest(Path(scratch), progress=report)
    text = json_text(result)
    rows = [(row.passed, row.robot, row.check, row.wanted, row.found) for row in result.rows]
    if as_json:
        say_json(text)
    else:
        say(checks_text(rows, terminal_width()), nl=False)
    return EXIT_PASS if result.passed else EXIT_FAIL
