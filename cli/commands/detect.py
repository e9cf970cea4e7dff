"""``collaudit detect``: judge one log."""

from __future__ import annotations

import shlex
from pathlib import Path

import click

from collaudit.cli.console import note, progress, say, say_json, say_result, terminal_width, verbose_option
from collaudit.cli.group import example_command
from collaudit.cli.settings import (
    config_option,
    friction_option,
    load_settings,
    part_options,
)
from collaudit.cli.shared_steps import audit_files, exit_code, one_log
from collaudit.core.data.audit_result import AuditResult

SCORE_SCHEMA = "collaudit/score/1"


@example_command(
    "detect",
    "collaudit detect run.mcap -c collaudit.toml --friction friction.json -o run/",
    "collaudit detect run.bag --set robot.urdf=arm.urdf --set detect.gamma_nm=4 --set detect.n=13 --json",
    "collaudit detect hits.mcap -c hits.toml --friction friction.json --truth hits.truth.json",
    "collaudit detect run.db3 -c collaudit.toml --set 'detect.gamma_nm={joint1=4, joint2=6}'",
)
@click.argument("logs", nargs=-1, required=True, metavar="LOG...")
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), metavar="RUN", help="Folder for audit.json and signals."
)
@click.option("--json", "as_json", is_flag=True, help="Print audit.json.")
@click.option(
    "--truth",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Known events to score against: NAME.truth.json, or a .csv with onset_s, end_s, joint.",
)
@verbose_option
@config_option
@part_options
@friction_option
def command(logs: tuple[str, ...], output: Path | None, as_json: bool, truth: Path | None, verbose: bool) -> int:
    """Judge one log: residual torque against gamma for n samples; contacts and near misses.

    Several files are taken as CSV parts of one recording. Without a friction file, friction is fitted on
    the log itself, which is no evidence: [policy] same_log = "folds" judges each part by a fit of the others.

    Exit codes: 0 policy kept, 1 policy broken, 3 not judged.
    """
    from collaudit.cli.fleet.precedents import precedents_of_log
    from collaudit.reports.files.atomic import atomic_write, refuse_link
    from collaudit.reports.files.json_files import json_text
    from collaudit.reports.files.run_files import result_json, write_run

    loaded = load_settings()
    files = one_log(logs, loaded)
    if output is not None:
        refuse_link(output)
        (output / "audit.json").unlink(missing_ok=True)  # an earlier verdict must not outlive a run that fails
    with progress("judging") as report:
        audit, friction = audit_files(files, loaded, report, truth, precedents_of_log(files, loaded))
        if output is not None:
            write_run(output, audit, friction)
    scores = audit.result.detection.scores if audit.result.detection else ()
    if output is not None and scores:
        atomic_write(output / "score.json", json_text({"schema": SCORE_SCHEMA, "scores": scores}))
    if as_json:
        say_json(result_json(audit.result))
    else:
        _say(audit.result, output, verbose)
    if output is not None:
        command = shlex.join(["collaudit", "report", str(output), "-o", "report.html"])
        note(f"run written to {output}: {command} makes the page")
    return exit_code([audit.result.verdict])


def _say(result: AuditResult, output: Path | None, verbose: bool) -> None:
    from collaudit.reports.sections.event_sections import score_section
    from collaudit.reports.terminal.screen_text import audit_text, detection_text, screen_text
    from collaudit.reports.terminal.text_table import section_text

    width = terminal_width()
    if verbose:
        say_result(audit_text(result, width))
    else:
        kept = "" if output is None else f"; {output / 'audit.json'}"
        say_result(screen_text(result, width, f"-v{kept}"))
    if verbose:
        say(detection_text(result, width), nl=False)
    elif result.detection is not None and result.detection.scores:
        say("\n" + section_text(score_section(result.detection.scores), width), nl=False)
