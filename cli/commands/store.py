"""``collaudit store prune``: say what may go of stored nights, and take it away."""

from __future__ import annotations

import re
from datetime import UTC, datetime
from pathlib import Path

import click

from collaudit.cli.console import note, progress, say, say_object, terminal_width
from collaudit.cli.group import example_command
from collaudit.cli.settings import config_option, load_settings
from collaudit.core.errors import EXIT_PASS, ConfigError


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
def command(
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
    from dataclasses import asdict

    from collaudit.cli.fleet.precedents import is_store, read_accepted
    from collaudit.cli.fleet.stored_runs import (
        audits_below,
        needs_of,
        prune_audits,
        prune_store,
        runs_of_audits,
        runs_of_store,
    )
    from collaudit.core.history.retention import runs_to_prune
    from collaudit.reports.store.result_store import ResultStore
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
