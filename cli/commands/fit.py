"""``collaudit fit``: friction from constant-velocity motion."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import click

from collaudit.cli.console import note, print_findings, progress, say, say_json, terminal_width
from collaudit.cli.group import example_command
from collaudit.cli.settings import config_option, load_settings
from collaudit.cli.shared_steps import known_contact, known_loads, truth_option
from collaudit.core.errors import EXIT_NOT_JUDGED, EXIT_PASS, ConfigError


@example_command(
    "fit",
    "collaudit fit friction-run.mcap -c collaudit.toml -o friction.json",
    "collaudit fit day1.bag day2.bag -c collaudit.toml -o friction.json",
    "collaudit fit run.db3 -c collaudit.toml --set friction.model=coulomb-viscous --json",
    "collaudit fit empty.mcap laden.mcap -c collaudit.toml --load 0 --load 2.5,0,0,0.06 -o friction.json",
    "collaudit fit earlier.mcap planned.mcap -c collaudit.toml --plan plan/plan.json -o friction.json",
    "collaudit fit touched.mcap -c collaudit.toml --truth contacts.csv -o friction.json",
)
@click.argument("logs", nargs=-1, required=True, metavar="LOG...")
@click.option("-o", "--output", type=click.Path(path_type=Path), metavar="FILE", help="Where to write friction.json.")
@click.option(
    "--urdf-out",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Also write the robot with what was fitted, for simulators: its URDF, or MuJoCo's MJCF in a FILE.xml.",
)
@click.option("--json", "as_json", is_flag=True, help="Print friction.json instead of a table.")
@click.option("-v", "--verbose", is_flag=True, help="Print all that was identified: ways to fit, delays, trends.")
@click.option(
    "--load",
    "loads",
    multiple=True,
    metavar="KG[,X,Y,Z]",
    help="Known mass beyond the configured tool, and where in the tool's frame, m; once for each log, in order. Logs "
    'that differ by it tell the drive gains ([fit] estimate with "gain").',
)
@click.option(
    "--plan",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="A plan.json that the logs carried out: also say what it delivered beside its predictions.",
)
@truth_option
@config_option
def command(
    logs: tuple[str, ...],
    output: Path | None,
    urdf_out: Path | None,
    as_json: bool,
    verbose: bool,
    loads: tuple[str, ...],
    plan: Path | None,
    truth: tuple[Path, ...],
) -> int:
    """Identify friction per joint from stretches of constant velocity, of one log or several together.

    It prints a line a joint; -v prints all that was identified, and the motion that would settle what is open. Every
    parameter comes with its 95 % interval; parameters that the data cannot determine are listed.

    Contacts, stops and faults in a log are found and left out, or known ones where --truth or [detect] true_events
    says so.

    Exit code 3 when no joint has usable friction (none could be fitted, or every effort looks inverted), or most of
    the motion looks like contact.
    """
    from collaudit.core import api
    from collaudit.core.data.plan_result import PLAN_SCHEMA, PlanFile
    from collaudit.core.detection.fitted_rule import rise_findings
    from collaudit.core.plan.prediction import delivered
    from collaudit.reports.files.atomic import atomic_write
    from collaudit.reports.files.json_files import read_result
    from collaudit.reports.files.run_files import earlier_friction, result_json, write_friction
    from collaudit.reports.sections.plan_sections import delivered_section
    from collaudit.reports.terminal.command_texts import fit_text
    from collaudit.reports.terminal.text_table import section_text

    loaded = load_settings()
    described = loaded.config.robot.urdf
    mjcf = urdf_out is not None and urdf_out.suffix == ".xml"
    same = urdf_out is not None and described and urdf_out.resolve() == (loaded.base_dir / described).resolve()
    if urdf_out is not None and (same or (described is None and not mjcf)):
        raise ConfigError(
            "--urdf-out needs a robot described by a URDF, and another file than that", where=str(urdf_out)
        )
    planned = None if plan is None else read_result(plan, PlanFile, PLAN_SCHEMA)
    found = api.find_logs(logs, loaded)
    known = known_contact(truth, len(found))
    with progress("fitting") as report:
        friction = api.fit(found, loaded, report, known, known_loads(loads, len(found)))
    if output is not None:
        earlier = earlier_friction(output)
        if earlier is not None and earlier.provenance.model_sha256 == friction.provenance.model_sha256:
            risen = rise_findings(friction.thresholds, earlier.thresholds)
            friction = replace(friction, findings=(*friction.findings, *risen))
        write_friction(output, friction)
    if urdf_out is not None:
        atomic_write(urdf_out, api.identified_description(friction, loaded, mjcf))
    if as_json:
        say_json(result_json(friction))
    else:
        say(fit_text(friction, terminal_width(), verbose), nl=False)
    if planned is not None:
        say(
            "\n" + section_text(delivered_section(delivered(planned, friction)), terminal_width()),
            nl=False,
            err=as_json,
        )
    findings = [finding for finding in friction.findings if finding.severity != "info"]
    print_findings(findings, err=True, short=not verbose)
    if output is not None:
        note(f"friction written to {output}")
    elif not as_json:
        note("friction was not written: -o friction.json keeps the result")
    if urdf_out is not None:
        note(f"description written to {urdf_out}, the stated tool included; its head says where it holds")
    if friction.usable:
        return EXIT_PASS
    note("not judged: no joint has friction that a log could be judged with; the findings above say why")
    return EXIT_NOT_JUDGED
