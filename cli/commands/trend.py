"""``collaudit trend``: the nights of a store."""

from __future__ import annotations

from pathlib import Path

import click

from collaudit.cli.console import note, progress, say, say_object, terminal_width
from collaudit.cli.group import example_command
from collaudit.core.errors import EXIT_NOT_JUDGED, EXIT_PASS


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
def command(store: str, output: Path | None, robots: tuple[str, ...], as_json: bool) -> int:
    """Show each joint over the nights: whether it was tested, contacts, level of the residual, gamma, friction.

    A night without a tested log is no quiet night: the table counts both, and says which joints the last night did not
    test. Level and friction stand with their 95 % intervals before and since the night that divides them best; the logs
    of a night are replicates. Nothing is extrapolated; collaudit query asks the same table in SQL.

    Exit code 3 when no log in the store was judged.
    """
    from dataclasses import asdict

    from collaudit.core.history.night_row import joint_nights
    from collaudit.reports.sections.joint_sections import nights_section
    from collaudit.reports.store.result_store import ResultStore
    from collaudit.reports.terminal.text_table import section_text

    with progress("reading the store"):
        rows = ResultStore(store).rows()
    _check(robots, {row.robot for row in rows})
    rows = [row for row in rows if not robots or row.robot in robots]
    joints = joint_nights(rows)
    if output is not None:
        from collaudit.reports.files.atomic import atomic_write
        from collaudit.reports.page.plane_page import trend_page

        atomic_write(output, trend_page(joints))
    if as_json:
        say_object("collaudit/trend/2", {"joints": [asdict(one) for one in joints]})
    else:
        say(section_text(nights_section(joints), terminal_width()), nl=False)
    if output is not None:
        note(f"page of trends: {output}")
    return EXIT_PASS if any(row.verdict != "not_judged" for row in rows) else EXIT_NOT_JUDGED


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
