"""Friction: ``collaudit fit`` identifies it, ``collaudit plan`` makes the motion that would settle what is open."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import click

from collaudit.cli.console import note, print_findings, progress, say, say_json, terminal_width
from collaudit.cli.group import example_command
from collaudit.cli.settings import config_option, load_settings
from collaudit.cli.shared_steps import known_contact, known_loads, truth_option
from collaudit.core.config import LoadedConfig
from collaudit.core.data.audit_result import Audit, FrictionFile
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
def fit_command(
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
    from collaudit.reports.files.run_files import earlier_friction, result_json, write_friction
    from collaudit.reports.files.written_files import atomic_write, read_result
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


def _names(_context: click.Context, _param: click.Parameter, text: str | None) -> tuple[str, ...]:
    return tuple(part.strip() for part in (text or "").split(",") if part.strip())


@example_command(
    "plan",
    "collaudit plan friction.json -c collaudit.toml -o plan/",
    "collaudit plan run.mcap -c collaudit.toml -o plan/ --minutes 5",
    "collaudit plan out/*/ -c collaudit.toml -o plan/ --set detect.gamma_nm=4",
    "collaudit plan -c collaudit.toml -o plan/ --joints joint1,joint2 --speed-scale 0.3",
    "collaudit fit planned.mcap -c collaudit.toml --plan plan/plan.json -o friction.json",
)
@click.argument("inputs", nargs=-1, metavar="[FRICTION|RUN|LOG]...")
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), required=True, metavar="DIR", help="Folder of the plan's files."
)
@click.option(
    "--minutes", type=click.FloatRange(min=0.1, max=600.0), default=10.0, show_default=True,
    help="The motion is no longer than this.",
)  # fmt: skip
@click.option(
    "--joints", callback=_names, metavar="NAMES", help="Joints to move, separated by commas; all when absent."
)
@click.option(
    "--speed-scale", type=click.FloatRange(min=0.01, max=1.0), default=1.0, show_default=True,
    help="Share of the highest speeds; accelerations shrink by its square, jerks by its cube.",
)  # fmt: skip
@click.option("--json", "as_json", is_flag=True, help="Print plan.json instead of a table.")
@config_option
def plan_command(
    inputs: tuple[str, ...],
    output: Path,
    minutes: float,
    joints: tuple[str, ...],
    speed_scale: float,
    as_json: bool,
) -> int:
    """Plan a motion that would settle what logs so far leave open, within hard limits.

    Sweeps of every joint at the speeds that its friction law lacks; moves between poses that tell inertials, rotors,
    gains and load friction; and how many clean hours thresholds need, and the one that [detect] gamma_nm states. Known
    friction comes from FRICTION (a friction.json), from a RUN's folder, or is fitted on LOGs; without any, all is open.

    The motion starts and ends at rest at [plan] start_rad and keeps the limits of the description or of [plan]: range,
    speed, acceleration, jerk, torque, links apart, table, workspace. A limit that neither states is refused. It is a
    proposal: a person must check it on the robot before it runs, slowly first.

    Files in DIR: plan.html, plan.json, plan.txt, motion.csv (time, q, dq), trajectory.mcap and trajectory.yaml
    (JointTrajectory), motion.script (URScript, for six joints). `collaudit fit --plan` says what it delivered.
    """
    from collaudit.core.plan.planning import PlanRequest, make_plan
    from collaudit.reports.files.run_files import result_json
    from collaudit.reports.formats.plan_files import write_plan
    from collaudit.reports.page.matter_pages import plan_page
    from collaudit.reports.terminal.command_texts import plan_text

    loaded = load_settings()
    friction, audits = _known(inputs, loaded)
    detect = loaded.config.detect
    gamma = detect.gamma_nm if "gamma_nm" in detect.given and isinstance(detect.gamma_nm, float | int) else None
    request = PlanRequest(minutes, joints or None, speed_scale=speed_scale, gamma_nm=gamma)
    with progress("planning") as report:
        plan = make_plan(loaded, friction, audits, request, loaded.provenance(None, None), report)
    by_model = {model: log for log, model in loaded.config.log.joint_names.items()}
    names = [by_model.get(name, name) for name in plan.robot.joint_names]
    files = write_plan(output, plan, names, plan_page(plan))
    if as_json:
        say_json(result_json(plan.file))
    else:
        say(plan_text(plan.file, terminal_width(), brief=True), nl=False)
    note("a proposal, to be checked on the robot and run slowly first: " + ", ".join(str(path) for path in files))
    return EXIT_PASS


def _known(inputs: Sequence[str], loaded: LoadedConfig) -> tuple[FrictionFile | None, list[Audit]]:
    """Friction and audits that the inputs give; the friction of the configuration where they give none.

    Raises:
        ConfigError: inputs that give friction in two ways.
    """
    from collaudit.core import api
    from collaudit.reports.files.run_files import AUDIT_NAME, friction_of_run, read_friction, read_run

    files = [Path(text) for text in inputs if Path(text).suffix == ".json"]
    runs = [Path(text) for text in inputs if (Path(text) / AUDIT_NAME).is_file()]
    logs = [text for text in inputs if Path(text) not in files and Path(text) not in runs]
    if len(files) > 1 or (files and logs):
        raise ConfigError(
            "friction is given twice",
            where="plan",
            found=", ".join(map(str, [*files, *logs])),
            expected="one friction.json, or logs to fit",
        )
    audits = [read_run(run) for run in runs]
    if logs:
        with progress("fitting") as report:
            return api.fit(api.find_logs(logs, loaded), loaded, report), audits
    paths = [*files, *(path for run in runs if (path := friction_of_run(run)) is not None)]
    path = paths[0] if paths else loaded.friction_path
    return (None if path is None else read_friction(path)), audits
