"""``collaudit demo``: the whole chain on simulated runs."""

from __future__ import annotations

from pathlib import Path

import click

from collaudit.cli.console import note, progress, say, say_object, terminal_width
from collaudit.cli.group import example_command
from collaudit.core.errors import EXIT_FAIL, EXIT_PASS


@example_command("demo", "collaudit demo", "collaudit demo -o demo-out")
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    default=Path("demo-out"),
    show_default=True,
    metavar="OUT",
    help="Folder for logs, runs and the report.",
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON: friction, pushes and residual beside their truth.")
def command(output: Path, as_json: bool) -> int:
    """Run the whole chain on simulated logs: a friction run, two polishing runs with a person pushing the arm.

    Simulates the logs, identifies friction, judges both runs, writes the report, and prints what was found
    beside what is true.

    Exit code 0 when every push was found and nothing else; 1 otherwise.
    """
    from collaudit.cli.demonstration import evaluate, simulate_all
    from collaudit.reports.terminal.command_texts import demo_text

    output.mkdir(parents=True, exist_ok=True)
    note("simulating the friction run and polishing runs A and B (about a minute) …")
    files = simulate_all(output)
    with progress("auditing") as report:
        demo = evaluate(files, output, report)
    if as_json:
        content = {"report": str(demo.report), "right": demo.right}
        rows = {"friction": demo.friction, "pushes": demo.pushes, "residual": demo.residual}
        say_object("collaudit/demo/1", {**content, **rows})
    else:
        say(demo_text(demo.friction, demo.pushes, demo.residual, terminal_width()), nl=False)
        say(f"Report: {demo.report}")
    return EXIT_PASS if demo.right else EXIT_FAIL
