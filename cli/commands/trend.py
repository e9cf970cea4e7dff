"""``collaudit trend``: what changed over the nights of a store."""

from __future__ import annotations

from pathlib import Path

import click

from collaudit.cli.console import note, progress, say, say_json, terminal_width
from collaudit.cli.group import example_command
from collaudit.core.errors import EXIT_NOT_JUDGED, EXIT_PASS


@example_command(
    "trend",
    "collaudit trend store/",
    "collaudit trend store/ -o trend.html",
    "collaudit trend store/ --robot cell-7 --json",
)
@click.argument("store", metavar="STORE")
@click.option("-o", "--output", type=click.Path(path_type=Path), metavar="FILE", help="Also write the page of trends.")
@click.option("--robot", "robots", multiple=True, metavar="NAME", help="Only this robot; may be given several times.")
@click.option("--since", metavar="NIGHT", help="Only nights from this date on, such as 2026-09-01.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON: every series, change and interval.")
def command(store: str, output: Path | None, robots: tuple[str, ...], since: str | None, as_json: bool) -> int:
    """Show what changed over the nights of each robot: friction, load, residual, near misses, contacts, coverage.

    Drifts and steps are tested against chance over all robots, joints and nights together (docs/history.md says how);
    each is stated with the night it began with, the interval of that night, and its size with an interval. Wear-like
    growth of friction is distinguished from payload, and from temperature where the logs hold it. Nothing is
    extrapolated.

    Exit code 3 when no log in the store was judged.
    """
    from collaudit.core.history.robot_trend import robot_trends
    from collaudit.reports.sections.trend_sections import trend_json
    from collaudit.reports.store.result_store import ResultStore
    from collaudit.reports.terminal.command_texts import trend_text

    with progress("reading the store"):
        records = ResultStore(store).records()
    _check(robots, {r.robot for r in records})
    records = [r for r in records if (not robots or r.robot in robots) and (since is None or r.night >= since)]
    with progress("looking for changes"):
        trends = robot_trends(records)
    if output is not None:
        from collaudit.reports.files.atomic import atomic_write
        from collaudit.reports.page.trend_page import trend_page

        atomic_write(output, trend_page(trends))
    if as_json:
        say_json(trend_json(trends))
    else:
        say(trend_text(trends, terminal_width()), nl=False)
    if output is not None:
        note(f"page of trends: {output}")
    return EXIT_PASS if any(record.verdict != "not_judged" for record in records) else EXIT_NOT_JUDGED


def _check(wanted: tuple[str, ...], known: set[str]) -> None:
    from collaudit.core.errors import ConfigError, did_you_mean

    for robot in wanted:
        if robot not in known:
            raise ConfigError(
                "the store has no log of this robot",
                where="--robot",
                found=robot,
                expected=", ".join(sorted(known)[:10]) or "any robot",
                hint=did_you_mean(robot, known),
            )
