"""``collaudit init``: a commented configuration for a log."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from collaudit.cli.console import note, print_findings
from collaudit.cli.group import example_command
from collaudit.cli.obstacles import forbidding, read_findings
from collaudit.cli.settings import config_option, given_paths, load_settings, robot_options
from collaudit.core.errors import EXIT_NOT_JUDGED, EXIT_PASS, CollauditError, ConfigError

if TYPE_CHECKING:
    from collaudit.core.api import LogFiles
    from collaudit.core.config import LoadedConfig
    from collaudit.core.findings import Finding


@example_command(
    "init",
    "collaudit init run.mcap --urdf arm.urdf -o collaudit.toml",
    "collaudit init run.bag --urdf arm.urdf",
    "collaudit init position.csv velocity.csv effort.csv -o collaudit.toml --force",
)
@click.argument("logs", nargs=-1, required=True, metavar="LOG...")
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), metavar="FILE", help="File to write; stdout when absent."
)
@click.option("--force", is_flag=True, help="Replace an existing file.")
@config_option
@robot_options
def command(logs: tuple[str, ...], output: Path | None, force: bool) -> int:
    """Write a commented configuration for a log: topic, joint names, units, robot, rule.

    What was stated nowhere is a guess and marked GUESS. With a robot, the log is read with the new
    configuration, and what shows (an inverted effort, a wrong unit) is printed and written beside the
    setting that would mend it; nothing is changed silently.

    Exit code 3 when the log cannot be judged with it as it stands.
    """
    from collaudit.cli.draft import Draft
    from collaudit.cli.log_arguments import one_log
    from collaudit.core.config import parse_config
    from collaudit.core.logs import describe, guess_csv_columns
    from collaudit.core.robot.robot_description import describe_robot
    from collaudit.reports.files.run_files import atomic_write

    if output is not None and output.exists() and not force:
        raise ConfigError("this file exists", where=str(output), hint="--force replaces it")
    loaded = load_settings(replaced=output)
    files = one_log(logs, loaded)
    summary = describe(files, loaded.config.log)
    folder = output.parent if output is not None else Path()
    csv = guess_csv_columns(files)
    robot = describe_robot(loaded.config.robot, loaded.base_dir)
    draft = Draft(
        summary,
        robot.movable if robot else (),
        loaded,
        folder,
        csv,
        [joint.name for joint in robot.joints if joint.kind == "prismatic"] if robot else (),
        given_paths(),
    )
    obstacle, findings = _check(files, parse_config(draft.text(), output or Path("collaudit.toml")))
    if obstacle is not None and not summary.csv_columns and not draft.problems:
        raise obstacle  # no line of a configuration would mend this; naming columns or joints may
    draft.remark(findings)
    text = draft.text()
    parse_config(text, output)
    if output is None:
        click.echo(text, nl=False)
    else:
        atomic_write(output, text)
        note(f"configuration written to {output}; {text.count('GUESS:')} lines in it are guesses: check them")
    print_findings(findings, err=True)
    reasons = _missing(draft.problems, obstacle, findings)
    if not reasons:
        return EXIT_PASS
    note("the log cannot be judged with this configuration yet:\n" + "\n".join(reasons))
    return EXIT_NOT_JUDGED


def _missing(problems: Sequence[str], obstacle: CollauditError | None, findings: Sequence[Finding]) -> list[str]:
    """What keeps the log from being judged with the configuration."""
    if obstacle is not None:
        return [obstacle.render()]
    forbids = forbidding(findings)
    return [*(f"to be answered in the file: {problem}" for problem in problems), *([forbids] if forbids else [])]


def _check(files: LogFiles, loaded: LoadedConfig) -> tuple[CollauditError | None, tuple[Finding, ...]]:
    """What reading the log with the new configuration shows: why it cannot be judged, or findings."""
    try:
        return None, read_findings(files, loaded)
    except CollauditError as error:
        return error, ()
