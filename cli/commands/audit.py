"""``collaudit audit``: one log or thousands, with an index page."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from collaudit.cli.group import example_command
from collaudit.cli.settings import config_option, load_settings, robot_options, rule_options
from collaudit.cli.words import note, progress, table, verdict_word

if TYPE_CHECKING:
    from collaudit.cli.audit_one import LogOutcome
    from collaudit.core.result import Verdict

SUMMARY_SCHEMA = "collaudit/summary/1"


@example_command(
    "audit",
    "collaudit audit run.mcap -c collaudit.toml -o out/",
    "collaudit audit nightly/ -c collaudit.toml --friction friction.json -o out/ -j 4",
    "collaudit audit 'logs/*.bag' --urdf arm.urdf --gamma 4 --n 13 -o out/ --json",
)
@click.argument("logs", nargs=-1, required=True, metavar="LOG|DIR|GLOB...")
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), required=True, metavar="OUT", help="Folder for everything."
)
@click.option(
    "-j", "--jobs", type=click.IntRange(min=1), default=1, show_default=True, help="Logs judged at the same time."
)
@click.option("--json", "as_json", is_flag=True, help="Print summary.json.")
@config_option
@robot_options
@rule_options
def command(logs: tuple[str, ...], output: Path, jobs: int, as_json: bool) -> int:
    """Judge one log or thousands; write a run folder and a report for each, and an index page.

    OUT holds index.html, summary.json and, per log, audit.json, signals.parquet, friction.json and
    report.html. Without a friction file, friction is fitted on each log itself, and its result says so. A log
    that cannot be judged is listed with its reason and stops no other.

    Exit codes: 0 all judged, policy kept; 1 policy broken somewhere; 3 something not judged.
    """
    from collaudit.cli.batch import audit_logs
    from collaudit.cli.chain import find_logs, friction_path
    from collaudit.cli.summary import exit_code
    from collaudit.reports.files import atomic_write, read_friction

    loaded = load_settings()
    friction = friction_path(loaded)
    if friction is not None:
        read_friction(friction)  # a broken one is one error of the settings, not one of every log
    found = find_logs(logs, loaded)
    output.mkdir(parents=True, exist_ok=True)
    with progress(f"auditing {len(found)} log{'s' if len(found) > 1 else ''}") as report:
        outcomes = audit_logs(found, loaded, output, jobs, report, _say_error)
    code = exit_code([outcome.verdict for outcome in outcomes])
    summary = summary_json(outcomes, loaded.sha256)
    atomic_write(output / "summary.json", summary)
    write_index_page(output, outcomes)
    click.echo(summary if as_json else outcomes_text(outcomes), nl=not as_json)
    note(f"index page: {output / 'index.html'}")
    return code


def _say_error(outcome: LogOutcome) -> None:
    if outcome.error is not None:
        note(f"{outcome.log}: not judged\n  {outcome.error.replace(chr(10), chr(10) + '  ')}")


def overall(outcomes: Sequence[LogOutcome]) -> Verdict:
    """The verdict on all logs together: fail wins, then what could not be judged."""
    verdicts = {outcome.verdict for outcome in outcomes}
    return "fail" if "fail" in verdicts else "not_judged" if "not_judged" in verdicts else "pass"


def summary_json(outcomes: Sequence[LogOutcome], config_sha256: str) -> str:
    """``summary.json``: the overall verdict and every log's outcome."""
    content = {
        "schema": SUMMARY_SCHEMA,
        "verdict": overall(outcomes),
        "counts": dict(sorted(Counter(outcome.verdict for outcome in outcomes).items())),
        "config_sha256": config_sha256,
        "logs": [outcome.as_json() for outcome in outcomes],
    }
    return json.dumps(content, indent=2, ensure_ascii=False) + "\n"


def write_index_page(output: Path, outcomes: Sequence[LogOutcome]) -> None:
    """``index.html``: every log with its verdict and a link to its report."""
    from collaudit.reports.index import IndexEntry, write_index

    write_index(
        output,
        [
            IndexEntry(
                name=outcome.log,
                verdict=outcome.verdict,
                reasons=outcome.reasons,
                report=outcome.report,
                collisions=outcome.collisions,
                near_misses=outcome.near_misses,
                judged_h=outcome.judged_h,
                error=outcome.error,
            )
            for outcome in outcomes
        ],
    )


def outcomes_text(outcomes: Sequence[LogOutcome]) -> str:
    """One line a log."""
    rows = [
        (
            verdict_word(outcome.verdict),
            outcome.log,
            str(outcome.collisions),
            str(outcome.near_misses),
            f"{60 * outcome.judged_h:.1f}",
            "; ".join(outcome.reasons),
        )
        for outcome in outcomes
    ]
    return table(("verdict", "log", "collisions", "near misses", "judged min", "reasons"), rows)
