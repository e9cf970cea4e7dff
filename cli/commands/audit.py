"""``collaudit audit``: one log or thousands, with an index page."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from collaudit.cli.console import note, say_json, say_result, terminal_width
from collaudit.cli.detail import Detail, detail_options
from collaudit.cli.group import example_command
from collaudit.cli.progress_bar import progress
from collaudit.cli.settings import config_option, load_settings, robot_options, rule_options
from collaudit.reports.formats.registry import FORMATS, formats_of_many, summary_text

#: Lines of a screen.
_MOST_LOGS = 20

if TYPE_CHECKING:
    from collections.abc import Sequence

    from collaudit.cli.batch.audit_one import Outcome
    from collaudit.core.data.audit_result import AuditResult
    from collaudit.reports.values.entries import IndexEntry


@example_command(
    "audit",
    "collaudit audit run.mcap -c collaudit.toml -o out/",
    "collaudit audit nightly/ -c collaudit.toml --friction friction.json -o out/ -j 4",
    "collaudit audit 'logs/*.bag' --urdf arm.urdf --gamma 4 --n 13 -o out/ --format junit",
)
@click.argument("logs", nargs=-1, required=True, metavar="LOG|DIR|GLOB...")
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), required=True, metavar="OUT", help="Folder for everything."
)
@click.option("-j", "--jobs", type=click.IntRange(min=1), default=1, show_default=True, help="Logs judged at a time.")
@click.option(
    "--format",
    "formats",
    metavar="LIST",
    help=f"Also write these for all logs: {', '.join(formats_of_many())}, separated by commas.",
)
@click.option(
    "--timeout", type=click.FloatRange(min=0, min_open=True), metavar="S", help="Longest time for one log, s."
)
@click.option(
    "--memory-limit",
    type=click.FloatRange(min=0.5),
    metavar="GB",
    help="Most memory for one log, GB; a log that needs more is not judged.",
)
@click.option(
    "--resume",
    is_flag=True,
    help="Take over what an audit of OUT finished before it was ended, where log, settings and versions are the same.",
)
@click.option("--force", is_flag=True, help="Write into a folder that holds something else than an audit.")
@click.option("--json", "as_json", is_flag=True, help="Print summary.json.")
@detail_options
@config_option
@robot_options
@rule_options
def command(
    logs: tuple[str, ...],
    output: Path,
    jobs: int,
    formats: str | None,
    timeout: float | None,
    memory_limit: float | None,
    resume: bool,
    force: bool,
    as_json: bool,
    detail: Detail,
) -> int:
    """Judge one log or thousands; write a run folder and a report for each, and an index page.

    OUT holds index.html, summary.json and, per log, audit.json, signals.parquet, friction.json and
    report.html. Without a friction file, friction is fitted on each log itself, and its result says so. A log
    that cannot be judged is listed with its reason and stops no other: also one that takes too long, or whose
    process dies. Results of an earlier audit in OUT are removed first; until the new ones stand,
    AUDIT-UNDER-WAY.txt does. An audit that was ended goes on with --resume.

    Exit codes: 0 all judged, policy kept; 1 policy broken somewhere; 3 something not judged.
    """
    from collaudit.cli.batch.audit_folder import audit_under_way
    from collaudit.cli.batch.finished_logs import finished_outcomes, merged
    from collaudit.cli.batch.log_jobs import Limits, log_jobs
    from collaudit.cli.batch.logs_in_turn import audit_logs
    from collaudit.cli.exit_codes import exit_code
    from collaudit.cli.formats import parse_formats
    from collaudit.core.api import find_logs
    from collaudit.reports.files.run_files import read_friction
    from collaudit.reports.page.index import summary_json, write_index

    extra = parse_formats(formats, formats_of_many()) if formats else []
    loaded = load_settings()
    friction = loaded.friction_path
    if friction is not None:
        read_friction(friction)  # a broken one is one error of the settings, not one of every log
    found = find_logs(logs, loaded)
    work = log_jobs(found)
    kept = finished_outcomes(work, loaded, output) if resume else {}
    left = [job for index, job in enumerate(work) if index not in kept]
    if resume:
        note(f"{len(kept)} of {len(work)} logs were finished before and are taken over")
    with audit_under_way(output, [job.folder for job in left], force):
        with progress(f"auditing {len(left)} log{'s' if len(left) != 1 else ''}") as report:
            judged = audit_logs(left, loaded, output, Limits(jobs, timeout, memory_limit), report, _say_error)
        outcomes = merged(len(work), kept, judged)
        entries = [outcome.entry for outcome in outcomes]
        write_index(output, entries)
        _write_extra(output, extra, outcomes)
    if as_json:
        say_json(summary_json(entries))
    else:
        _say(entries, [outcome.result for outcome in outcomes if outcome.result is not None], detail)
    if detail is not Detail.VERDICT:
        note(f"index page: {output / 'index.html'}")
    return exit_code([entry.verdict for entry in entries])


def _say(entries: Sequence[IndexEntry], results: Sequence[AuditResult], detail: Detail) -> None:
    """Print as much as was asked for: of one log its screen, of several the worst."""
    from collaudit.reports.terminal.audit_text import audit_text, summary_table, total_text
    from collaudit.reports.terminal.screen_text import screen_text
    from collaudit.reports.values.entries import worst_verdict
    from collaudit.reports.values.visible_text import visible
    from collaudit.reports.values.words import VERDICT_WORD

    width = terminal_width()
    if detail is Detail.VERDICT:
        text = f"{VERDICT_WORD[worst_verdict(entries)]}  {total_text(entries)}"
        if len(entries) == 1:
            text = f"{entries[0].word}  {visible(entries[0].name)}\n"
        say_result(text)
        return
    if len(entries) == 1 and results:
        whole = detail is Detail.ALL
        text = audit_text(results[0], width) if whole else screen_text(results[0], width, "-v; the index page")
        say_result(text)
        return
    say_result(summary_table(entries, width, None if detail is Detail.ALL else _MOST_LOGS))


def _say_error(outcome: Outcome) -> None:
    error = outcome.entry.error
    if error is not None:
        note(f"{outcome.entry.name}: not judged\n  " + error.replace("\n", "\n  "))


def _write_extra(output: Path, formats: Sequence[str], outcomes: Sequence[Outcome]) -> None:
    from collaudit.reports.files.atomic import atomic_write

    results = [outcome.result for outcome in outcomes if outcome.result is not None]
    unread = [outcome.entry for outcome in outcomes if outcome.result is None]
    for name in formats:
        atomic_write(output / f"summary{FORMATS[name].suffix}", summary_text(results, name, unread))
