"""``collaudit fit``: friction from constant-velocity motion."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from collaudit.cli.console import note, print_findings, progress
from collaudit.cli.group import example_command
from collaudit.cli.settings import config_option, friction_options, load_settings, robot_options
from collaudit.core.errors import EXIT_NOT_JUDGED, EXIT_PASS

if TYPE_CHECKING:
    from collaudit.core.data.audit_result import FrictionFile
    from collaudit.core.data.friction_result import FrictionFit


@example_command(
    "fit",
    "collaudit fit friction-run.mcap -c collaudit.toml -o friction.json",
    "collaudit fit day1.bag day2.bag --urdf arm.urdf -o friction.json",
    "collaudit fit run.db3 -c collaudit.toml --model coulomb-viscous --json",
)
@click.argument("logs", nargs=-1, required=True, metavar="LOG...")
@click.option("-o", "--output", type=click.Path(path_type=Path), metavar="FILE", help="Where to write friction.json.")
@click.option("--json", "as_json", is_flag=True, help="Print friction.json instead of a table.")
@config_option
@robot_options
@friction_options
def command(logs: tuple[str, ...], output: Path | None, as_json: bool) -> int:
    """Identify friction per joint from stretches of constant velocity, of one log or several together.

    Every parameter comes with its 95 % interval; what the data cannot tell apart is named.

    Exit code 3 when no joint could be fitted.
    """
    from collaudit.core import api
    from collaudit.reports.files.run_files import friction_json, write_friction

    loaded = load_settings()
    prepared = []
    for files in api.find_logs(logs, loaded):
        with progress(f"reading {files[0].name}") as report:
            prepared.append(api.prepare(files, loaded, progress=report))
    friction = api.fit(prepared, loaded)
    if output is not None:
        write_friction(output, friction)
    click.echo(friction_json(friction) if as_json else fit_table(friction), nl=not as_json)
    if not as_json:
        click.echo(identification_text(friction), nl=False)
    print_findings([finding for finding in friction.findings if finding.severity != "info"], err=True)
    if output is not None:
        note(f"friction written to {output}")
    elif not as_json:
        note("nothing was written: -o friction.json keeps the result")
    fitted = [fit for fit in friction.joints.values() if fit.model is not None]
    return EXIT_PASS if fitted else EXIT_NOT_JUDGED


def identification_text(friction: FrictionFile) -> str:
    """What was identified besides friction, table by table; long tables stay in friction.json and the page."""
    from collaudit.core.data.identification_result import Identification
    from collaudit.reports.terminal.audit_text import table
    from collaudit.reports.values.identified import identification_tables

    found = Identification(friction.identified, friction.channels, friction.trends)
    parts = []
    for each in identification_tables(found):
        if not each.folded:
            notes = "".join(f"  {note}\n" for note in each.notes)
            parts.append(f"\n{each.title}\n{table(each.head, each.rows)}{notes}")
    return "".join(parts)


def fit_table(friction: FrictionFile) -> str:
    """One line a joint: model, parameters with intervals, quality; below it what is not identifiable."""
    from collaudit.reports.terminal.audit_text import table

    rows = []
    remarks = []
    for name, fit in friction.joints.items():
        rows.append(
            (name, fit.model or "not fitted", _parameters(fit), str(fit.n_points), *_quality(fit), _speeds(fit))
        )
        if fit.reason:
            remarks.append(f"  {name}: {fit.reason}")
        remarks += [f"  {name}: {text}" for text in fit.not_identifiable]
        if fit.identifiability is not None and fit.identifiability.motion_needed:
            remarks.append(f"  {name}: to settle it: {'; '.join(fit.identifiability.motion_needed)}")
    head = ("joint", "model", "parameters [95 % interval]", "points", "RMSE (of rated)", "R²", "speeds")
    return "\n".join([table(head, rows, numeric=(3,)).rstrip(), *remarks])


def _parameters(fit: FrictionFit) -> str:
    parts = []
    for name, value in fit.parameters.items():
        bounds = fit.ci95.get(name)
        interval = "" if bounds is None else f" [{_bound(bounds[0])}, {_bound(bounds[1])}]"
        parts.append(f"{name.partition('_')[0]} {value:.4g}{interval}")
    return "  ".join(parts)


def _bound(value: float | None) -> str:
    return "open" if value is None else f"{value:.3g}"


def _quality(fit: FrictionFit) -> tuple[str, str]:
    """RMSE with its share of the joint's rated torque, and R²."""
    if fit.rmse_nm is None:
        return "", ""
    share = "" if fit.rmse_share is None else f" ({100 * fit.rmse_share:.2g} %)"
    return f"{fit.rmse_nm:.3g} {fit.effort_unit}{share}", "" if fit.r_squared is None else f"{fit.r_squared:.4f}"


def _speeds(fit: FrictionFit) -> str:
    return "" if fit.speed_range_rad_s is None else f"{fit.speed_range_rad_s[0]:.3g} to {fit.speed_range_rad_s[1]:.3g}"
