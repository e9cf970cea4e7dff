"""``collaudit audit``: one log or thousands, with an index page."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import click

from collaudit.cli.console import (
    note,
    progress,
    say_json,
    say_result,
    terminal_width,
    verbose_option,
)
from collaudit.cli.group import example_command
from collaudit.cli.settings import config_option, friction_option, load_settings, overrides, part_options
from collaudit.reports.formats.registry import formats_of_many

_DAY = click.DateTime(["%Y-%m-%d"])


@example_command(
    "audit",
    "collaudit audit run.mcap -c collaudit.toml -o out/",
    "collaudit audit nightly/ -c collaudit.toml --friction friction.json -o out/ -j 4",
    "find nightly -name '*.mcap' | collaudit audit - -c fleet.toml -o out/",
    "collaudit audit 'logs/*.bag' -c collaudit.toml --set detect.gamma_nm=4 -o out/ --format junit",
)
@click.argument("logs", nargs=-1, required=True, metavar="LOG|DIR|GLOB|URL|-...")
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), required=True, metavar="OUT", help="Folder for everything."
)
@click.option(
    "-j",
    "--jobs",
    "--workers",
    "jobs",
    type=click.IntRange(min=1),
    default=1,
    show_default=True,
    help="Logs judged at a time; of a single log, threads that judge it.",
)
@click.option("--scheduler", metavar="ADDRESS", help="Judge on the workers of this Dask scheduler; see docs/fleet.md.")
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
    help="Continue an interrupted audit of OUT: keep finished results whose log, settings and versions are the same.",
)
@click.option(
    "--baseline",
    metavar="DIR|FILE|STORE",
    help="An earlier audit, or a store of nights: contacts that it has are called known, and break the policy all the "
    "same.",
)
@click.option(
    "--against",
    type=click.Path(path_type=Path, exists=True),
    metavar="DIR|RUN|LOG",
    help="Say what changed in each log's program since an earlier audit, run or log: path, speed, load, friction.",
)
@click.option(
    "--as-of", type=_DAY, metavar="YYYY-MM-DD", help="Day on which acceptances are looked at; today (UTC) when absent."
)
@click.option("--store", metavar="STORE", help="Append the results to a store over nights: a folder or URL.")
@click.option("--robot", metavar="NAME", help="Robot of these logs, for a store; {folder} is the folder of each log.")
@click.option(
    "--night",
    "day",
    type=_DAY,
    metavar="DATE",
    help="Night that the logs count to in a store; default: their own dates.",
)
@click.option(
    "--root",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Names of logs begin below this folder; default: found from robot, configuration, or a folder that is a date.",
)
@click.option("--link", default="", metavar="URL", help="What links in messages begin with: where OUT will be found.")
@click.option("--json", "as_json", is_flag=True, help="Print summary.json.")
@verbose_option
@config_option
@part_options
@friction_option
def audit_command(
    logs: tuple[str, ...],
    output: Path,
    jobs: int,
    scheduler: str | None,
    formats: str | None,
    timeout: float | None,
    memory_limit: float | None,
    resume: bool,
    baseline: str | None,
    against: Path | None,
    as_of: datetime | None,
    store: str | None,
    robot: str | None,
    day: datetime | None,
    root: Path | None,
    link: str,
    as_json: bool,
    verbose: bool,
) -> int:
    """Judge one log or thousands; write a run folder and a report for each, and an index page.

    "-" reads a list of logs from stdin, one a line. With [fleet] each log is judged with the settings of its robot.

    OUT holds index.html, summary.json, assets that reports share, each friction file once and, per log, audit.json,
    signals.parquet and report.html. Without a friction file, friction is fitted on each log itself, and its result says
    so. A log that cannot be judged is listed with its reason and stops no other: also one that takes too long, or
    whose process dies, and an argument that names no log. All results of earlier audits in OUT are removed first;
    until the new ones are complete, OUT holds AUDIT-UNDER-WAY.txt. An audit that was ended goes on with --resume.

    Each log has one verdict, in audit.json, report, index and all formats. A contact that earlier nights had, too, is
    called known and breaks the policy like a new one; only accepted.toml (collaudit accept) takes one out. Files of a
    folder that were not judged are named, and count as [policy] other_files says. Check OUT by sha256sum -c SHA256SUMS.

    With --store, what was found of every log is appended to a store, which collaudit trend and query read.

    Exit codes: 0 all judged, policy kept; 1 policy broken somewhere; 3 something not judged.
    """
    from collaudit.cli.batch.audit_folder import audit_under_way, own_files
    from collaudit.cli.batch.audit_one import finished_outcomes
    from collaudit.cli.batch.log_inputs import night_of
    from collaudit.cli.batch.log_jobs import Limits, night_rows, robot_of
    from collaudit.cli.batch.logs_in_turn import audit_logs
    from collaudit.cli.batch.night_pages import (
        changes_since,
        night_facts,
        say_copies,
        say_error,
        say_left_out,
        say_night,
        say_stale,
        write_night,
        write_overlays,
    )
    from collaudit.cli.batch.precedents import (
        is_store,
        keep_references,
        read_accepted,
        read_history,
        with_precedents,
        with_references,
    )
    from collaudit.cli.shared_steps import exit_code
    from collaudit.core.history.night_groups import night_groups
    from collaudit.core.history.night_row import joint_nights
    from collaudit.reports.files.result_store import ResultStore
    from collaudit.reports.files.run_files import FRICTION_FOLDER, keep_friction, read_friction
    from collaudit.reports.files.written_files import json_text, write_checksums
    from collaudit.reports.formats.registry import parse_formats
    from collaudit.reports.page.index import summarise
    from collaudit.reports.terminal.text_table import section_text
    from collaudit.reports.values.entries import nights_before
    from collaudit.reports.values.night import change_section, left_out_entries

    extra = parse_formats(formats, formats_of_many()) if formats else []
    loaded = load_settings()
    accepted = read_accepted(loaded)
    found, of_robots, others = night_of(logs, loaded, overrides(), root)
    say_left_out(others)
    frictions = sorted({path for settings in of_robots if (path := settings.friction_path) is not None})
    for friction in frictions:
        read_friction(friction)  # a broken one is one error of the settings, not one of every log
    nights = store or (baseline if baseline is not None and is_store(baseline) else None)
    counts_to = None if nights is None or day is None else day.date().isoformat()
    if nights is not None:
        found = [job._replace(robot=robot_of(job, robot)) for job in found]
        ResultStore(nights).check()
    places = [place for place in dict.fromkeys([baseline, nights]) if place is not None]
    history = [one for place in places for one in read_history(place, counts_to)]
    today = (as_of or datetime.now(UTC)).date()
    work = with_precedents(found, history, accepted, today, counts_to)
    work = work if nights is None else with_references(work, nights)
    kept = finished_outcomes(work, output) if resume else {}
    folders, kept_folders = [job.folder for job in work], [work[index].folder for index in kept]
    if resume:
        note(f"{len(kept)} of {len(work)} logs were finished earlier; their results are kept")
    with audit_under_way(output, folders, kept_folders):
        keep_friction(output, frictions)
        left = len(work) - len(kept)
        with progress(f"auditing {left} log{'s' if left != 1 else ''}") as report:
            limits = Limits(jobs, timeout, memory_limit, scheduler)
            outcomes = audit_logs(work, kept, output, limits, report, say_error)
        entries = [*(outcome.entry for outcome in outcomes), *left_out_entries(others)]
        results = [outcome.result for outcome in outcomes if outcome.result is not None]
        tonight = {} if nights is None else night_rows(work, outcomes, counts_to)
        stored = [] if nights is None else ResultStore(nights).rows()
        night = night_facts(work, outcomes, others, accepted, today)
        rows = [*stored, *(row for own in tonight.values() for row in own)]
        since = max((row.night for own in tonight.values() for row in own), default=today.isoformat())
        groups = night_groups(results, night.robots, history, since, joint_nights(rows))
        reports = {entry.name: entry.report for entry in entries if entry.report is not None}
        folder = None if baseline is None or is_store(baseline) else Path(baseline)
        overlays = {} if folder is None else write_overlays(output, work, outcomes, folder)
        night = replace(night, groups=groups, reports=reports, link=link, overlays=overlays)
        if against is not None:
            night = replace(night, changes=changes_since(output, work, outcomes, against))
        write_night(output, entries, results, night, nights_before(tonight, stored), extra)
        write_checksums(output, own_files(), [FRICTION_FOLDER, *folders], others)
        if store is not None:
            ResultStore(store).append([row for rows in tonight.values() for row in rows])
            keep_references(store, output, work, outcomes, tonight)
            note(f"{len(tonight)} logs added to the store {store}")
        code = exit_code([night.verdict(entries)])
    say_copies(results)
    say_stale(night)
    if as_json:
        say_json(json_text(summarise(entries, night)))
    else:
        say_night(entries, results, night, verbose)
        if night.changes:
            say_result(f"\n{section_text(change_section(night.changes), terminal_width())}")
    note(f"index page: {output / 'index.html'}")
    return code
