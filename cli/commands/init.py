"""``collaudit init``: a commented configuration for a log."""

from __future__ import annotations

from pathlib import Path

import click

from collaudit.cli.console import note, print_findings, say, say_json
from collaudit.cli.group import example_command
from collaudit.cli.settings import config_option, given_paths, load_settings, overrides, robot_options
from collaudit.core.errors import EXIT_NOT_JUDGED, EXIT_PASS, ConfigError


@example_command(
    "init",
    "collaudit init run.mcap --urdf arm.urdf -o collaudit.toml",
    "collaudit init run.bag --urdf arm.urdf",
    "collaudit init position.csv velocity.csv effort.csv -o collaudit.toml --force",
)
@click.argument("logs", nargs=-1, required=True, metavar="LOG...")
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), metavar="FILE", help="File to write; stdout when absent or -."
)
@click.option("--force", is_flag=True, help="Replace an existing file.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON: the configuration, its findings, what is missing.")
@config_option
@robot_options
def command(logs: tuple[str, ...], output: Path | None, force: bool, as_json: bool) -> int:
    """Write a commented configuration for a log: topic, joint names, units, robot, rule.

    What was stated nowhere is a guess and marked GUESS. The log, or of a long one the stretch with the most
    motion, is audited with the new configuration; what it measures (clock, steps, noise, delays, sign and kind
    of the effort) is written beside the settings. A question that the log does not answer becomes commented choices in
    the file; nothing is changed silently.

    Exit code 0 when that audit judged the log, whatever it found; 3 with what is missing when it could not.
    """
    from collaudit.cli.drafts.choice_evidence import add_choice_evidence
    from collaudit.cli.drafts.draft import Draft
    from collaudit.cli.drafts.draft_evidence import (
        add_channel_facts,
        add_effort_kind,
        add_measurements,
        add_rest_threshold,
    )
    from collaudit.cli.drafts.draft_json import draft_json
    from collaudit.cli.drafts.earlier_guesses import guesses_of
    from collaudit.cli.drafts.torque_constants import add_torque_constants
    from collaudit.cli.drafts.trial import try_again, try_log
    from collaudit.cli.drafts.trial_words import came_of_it, missing, next_step
    from collaudit.cli.log_arguments import one_log
    from collaudit.cli.obstacles import forbidding
    from collaudit.core.config import parse_config
    from collaudit.core.logs import describe, guess_csv_columns
    from collaudit.core.robot.robot_description import describe_robot
    from collaudit.reports.files.run_files import atomic_write

    if str(output) == "-":
        output = None
    if output is not None and output.exists() and not force:
        raise ConfigError("this file exists", where=str(output), hint="--force replaces it")
    loaded = load_settings(replaced=output)
    files = one_log(logs, loaded)
    summary = describe(files, loaded.config.log)
    folder = output.parent if output is not None else Path()
    csv = guess_csv_columns(files)
    robot = describe_robot(loaded.config.robot, loaded.base_dir)
    draft = Draft(
        summary,
        robot.movable if robot else (),
        loaded,
        folder,
        csv,
        [joint.name for joint in robot.joints if joint.kind == "prismatic"] if robot else (),
        given_paths(),
        guesses_of(loaded.path, overrides()),
    )
    place = output or Path("collaudit.toml")
    add_torque_constants(draft, files, place)
    trial = try_log(files, parse_config(draft.text(), place))
    if trial.obstacle is not None and not summary.csv_columns and not draft.problems:
        raise trial.obstacle  # no line of a configuration would mend this; naming columns or joints may
    if trial.obstacle is not None and summary.csv_columns and not draft.problems:
        draft.sections["log.csv"].remarks.append("MISSING: " + " ".join(trial.obstacle.render().split()))
    if draft.problems and robot is not None:
        add_choice_evidence(draft.sections, draft.text(), files, place)
    if trial.prepared is not None and add_effort_kind(draft.sections, trial.prepared):
        trial = try_again(trial, parse_config(draft.text(), place))
    add_measurements(draft.sections, trial)
    if trial.prepared is not None:
        delays = add_channel_facts(draft.sections, trial.prepared, loaded.config)
        resting = add_rest_threshold(draft.sections, trial.prepared)
        if delays or resting:
            trial = try_again(trial, parse_config(draft.text(), place))
    draft.remark(trial.findings)
    text = draft.text()
    parse_config(text, output)
    if output is None and not as_json:
        say(text, nl=False)
    elif output is not None:
        atomic_write(output, text)
        note(f"configuration written to {output}; {text.count('GUESS:')} lines in it are guesses: check them")
    print_findings([finding for finding in trial.findings if finding.severity != "info"], err=True, brief=True)
    if trial.result is not None:
        note(came_of_it(trial))
    reasons = missing(trial, draft.problems, robot=robot is not None)
    if as_json:
        say_json(draft_json(text, output, trial, reasons))
    if not reasons:
        note(next_step(trial, " ".join(logs), output, fitted=loaded.friction_path is not None))
        return EXIT_PASS
    listed = "\n".join(f"- {each}" for each in reasons)
    note(f"the log cannot be judged with this configuration yet; missing:\n{listed}")
    if forbidding(trial.findings) is not None:
        where = output or "the text above"
        note(f"next: if a commented line (#) in {where} is true, uncomment it, and run collaudit inspect again")
    return EXIT_NOT_JUDGED
