"""Stored nights: ``collaudit trend`` shows them, ``query`` asks them in SQL, ``store prune`` takes old ones away."""

from __future__ import annotations

import re
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path

import click

from collaudit.cli.console import note, progress, say, say_object, terminal_width
from collaudit.cli.group import example_command
from collaudit.cli.settings import config_option, load_settings
from collaudit.core.errors import EXIT_NOT_JUDGED, EXIT_PASS, ConfigError, did_you_mean


@example_command(
    "trend",
    "collaudit trend store/",
    "collaudit trend store/ -o trend.html",
    "collaudit trend store/ --robot cell-7 --json",
)
@click.argument("store", metavar="STORE")
@click.option("-o", "--output", type=click.Path(path_type=Path), metavar="FILE", help="Also write the page with plots.")
@click.option("--robot", "robots", multiple=True, metavar="NAME", help="Only this robot; may be given several times.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON: every night of every joint.")
def trend_command(store: str, output: Path | None, robots: tuple[str, ...], as_json: bool) -> int:
    """Show each joint over the nights: whether it was tested, contacts, level of the residual, gamma, friction.

    A night without a tested log is no quiet night: the table counts both, and says which joints the last night did not
    test. Level and friction stand with their 95 % intervals before and since the night that divides them best; the logs
    of a night are replicates. Nothing is extrapolated; collaudit query asks the same table in SQL.

    Exit code 3 when no log in the store was judged.
    """
    from collaudit.core.history.night_row import joint_nights
    from collaudit.reports.files.result_store import ResultStore
    from collaudit.reports.sections.joint_sections import nights_section
    from collaudit.reports.terminal.text_table import section_text

    with progress("reading the store"):
        rows = ResultStore(store).rows()
    _check_robots(robots, {row.robot for row in rows})
    rows = [row for row in rows if not robots or row.robot in robots]
    joints = joint_nights(rows)
    if output is not None:
        from collaudit.reports.files.written_files import atomic_write
        from collaudit.reports.page.matter_pages import trend_page

        atomic_write(output, trend_page(joints))
    if as_json:
        say_object("collaudit/trend/2", {"joints": [asdict(one) for one in joints]})
    else:
        say(section_text(nights_section(joints), terminal_width()), nl=False)
    if output is not None:
        note(f"page of trends: {output}")
    return EXIT_PASS if any(row.verdict != "not_judged" for row in rows) else EXIT_NOT_JUDGED


def _check_robots(wanted: tuple[str, ...], known: set[str]) -> None:
    for robot in wanted:
        if robot not in known:
            raise ConfigError(
                "the store has no log of this robot",
                where="--robot",
                found=robot,
                expected=", ".join(sorted(known)[:10]) or "any robot",
                hint=did_you_mean(robot, known),
            )


@example_command(
    "query",
    "collaudit query store/ \"SELECT robot, count(DISTINCT log) FROM nights WHERE verdict = 'fail' GROUP BY robot\"",
    'collaudit query store/ "SELECT night, joint, friction_nm FROM nights ORDER BY night" --json',
    'collaudit query s3://bucket/store "DESCRIBE nights"',
)
@click.argument("store", metavar="STORE")
@click.argument("sql", metavar="SQL")
@click.option("--json", "as_json", is_flag=True, help="Print JSON: columns, and rows as lists.")
def query_command(store: str, sql: str, as_json: bool) -> int:
    """Answer a question in SQL from a store that collaudit audit --store keeps.

    Tables: nights (a row for each joint of each log, as it was last judged), contacts (a row for each joint in each
    contact), and records (every row that was ever appended). docs/fleet.md lists their columns and answers five
    questions. Nothing can be changed, and no other file be read.

    Needs DuckDB: python -m pip install 'collaudit[fleet]'.
    """
    from collaudit.reports.files.result_store import ResultStore
    from collaudit.reports.files.store_query import query_store
    from collaudit.reports.terminal.text_table import table

    found = query_store(ResultStore(store), sql)
    if as_json:
        say_object("collaudit/query/1", {"columns": found.columns, "rows": found.rows}, indent=1)
        return EXIT_PASS
    lines = [[_shown(value) for value in row] for row in found.rows]
    say(table(found.columns, lines, found.numeric, terminal_width()), nl=False)
    return EXIT_PASS


def _shown(value: object) -> str:
    if value is None:
        return ""
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _days(_ctx: click.Context, _param: click.Parameter, text: str) -> int:
    """Whole days of "30d", "8w", or "30"."""
    found = re.fullmatch(r"(\d{1,5})([dw]?)", text)
    if found is None:
        raise click.BadParameter(f"{text!r} is no number of days, such as 30d or 8w")
    return int(found[1]) * (7 if found[2] == "w" else 1)


@example_command(
    "store",
    "collaudit store prune nights/ -c collaudit.toml",
    "collaudit store prune nights/ -c collaudit.toml --keep 30d --keep-failed 180d --most 200 --yes",
    "collaudit store prune store/ -c collaudit.toml --keep 365d",
)
@click.argument("action", type=click.Choice(["prune"]))
@click.argument("place", metavar="FOLDER|STORE")
@click.option("--keep", default="30d", show_default=True, callback=_days, metavar="DAYS", help="Runs that passed.")
@click.option(
    "--keep-failed",
    default="180d",
    show_default=True,
    callback=_days,
    metavar="DAYS",
    help="Runs that failed or were not judged.",
)
@click.option(
    "--most",
    type=click.FloatRange(min=0),
    metavar="GB",
    help="Most GB that stay: beyond, the oldest go earlier, first of those that passed.",
)
@click.option(
    "--baseline",
    "baselines",
    multiple=True,
    type=click.Path(path_type=Path, exists=True),
    metavar="DIR",
    help="An audit or run that others are compared with: its logs stay. May be given several times.",
)
@click.option("--yes", is_flag=True, help="Do it; without, the plan is said and nothing goes.")
@click.option(
    "--as-of", type=click.DateTime(["%Y-%m-%d"]), metavar="YYYY-MM-DD", help="Day from which ages count; today (UTC)."
)
@click.option("--json", "as_json", is_flag=True, help="Print the plan as JSON.")
@config_option
def store_command(
    action: str,
    place: str,
    keep: int,
    keep_failed: int,
    most: float | None,
    baselines: tuple[Path, ...],
    yes: bool,
    as_of: datetime | None,
    as_json: bool,
) -> int:
    """Say which stored runs are old enough to go; with --yes, take them away.

    Of a FOLDER that holds audits (OUT of collaudit audit, at any depth) signals.parquet, friction.json and report.html
    of a run go; audit.json stays, with the verdict and every contact, and SHA256SUMS still holds. Of a STORE the rows
    of a log go, and with them its part in trends and in what is known.

    Whatever its age, a run stays that a contact in accepted.toml of the configuration may mean while the entry counts,
    one that a --baseline has, and of each robot and program the latest that was judged.
    """
    from collaudit.cli.batch.precedents import is_store, read_accepted
    from collaudit.cli.batch.stored_runs import (
        audits_below,
        needs_of,
        prune_audits,
        prune_store,
        runs_of_audits,
        runs_of_store,
    )
    from collaudit.core.history.retention import runs_to_prune
    from collaudit.reports.files.result_store import ResultStore
    from collaudit.reports.terminal.command_texts import prune_text

    if keep_failed < keep:
        raise ConfigError(
            "runs that failed would go before runs that passed",
            where="--keep-failed",
            found=f"{keep_failed}d",
            expected=f"no less than --keep, {keep}d",
        )
    today = (as_of or datetime.now(UTC)).date()
    needed = needs_of(read_accepted(load_settings()), baselines, today)
    rows = is_store(place)
    audits = [] if rows else audits_below(Path(place))
    if not (rows or audits):
        raise ConfigError("neither a store nor a folder with audits", where=place, expected="OUT of collaudit audit")
    with progress(f"{action}: reading what is stored"):
        runs = runs_of_store(ResultStore(place), needed) if rows else runs_of_audits(audits, needed)
    gone = runs_to_prune(runs, keep, keep_failed, None if most is None else round(1e9 * most), today)
    if as_json:
        listed = [{**asdict(run), "night": run.night.isoformat()} for run in gone]
        plan = {"place": place, "kept": len(runs) - len(gone), "done": yes, "runs": listed}
        say_object("collaudit/prune/1", plan)
    else:
        say(prune_text(runs, gone, terminal_width()), nl=False)
    if not yes:
        note("nothing was deleted; --yes does it" if gone else "nothing to delete")
    elif rows:
        prune_store(ResultStore(place), gone)
    else:
        prune_audits(gone, today)
    return EXIT_PASS
