"""Configurations: ``collaudit init`` drafts one for a log, ``collaudit check`` says whether one can be used."""

from __future__ import annotations

from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

import click

from collaudit.cli.console import note, print_findings, say, say_object
from collaudit.cli.group import example_command
from collaudit.cli.settings import config_option, given_paths, load_settings, overrides, urdf_option
from collaudit.core.errors import EXIT_NOT_JUDGED, EXIT_PASS, EXIT_USAGE, CollauditError, ConfigError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from collaudit.cli.drafts.draft import Known
    from collaudit.cli.drafts.drafted_log import Drafted
    from collaudit.core.logs.log_guess import Arm


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
@urdf_option
def init_command(logs: tuple[str, ...], output: Path | None, force: bool, as_json: bool) -> int:
    """Write a commented configuration for a log: topic, joint names, units, robot, rule.

    What was stated nowhere is a guess and marked GUESS. The log, or of a long one the stretch with the most
    motion, is audited with the new configuration; what it measures of the effort (delay, sign, kind) is written
    beside the settings. A question that the log does not answer becomes commented choices in
    the file; nothing is changed silently. Of a log with several arms each gets a configuration, beside the one that
    names them all.

    Exit code 0 when that audit judged the log, whatever it found; 3 with what is missing when it could not.
    """
    from collaudit.cli.drafts.config_text import guesses_of
    from collaudit.cli.drafts.draft import Known
    from collaudit.cli.drafts.drafted_log import arms_in, drafted, key_paths
    from collaudit.cli.drafts.trial import next_step
    from collaudit.cli.shared_steps import one_log
    from collaudit.core.config import load_config
    from collaudit.core.logs.log_description import describe
    from collaudit.core.logs.log_guess import guess_csv_columns, guess_layout
    from collaudit.core.robot.robot_description import describe_robot

    if str(output) == "-":
        output = None
    if output is not None and output.exists() and not force:
        raise ConfigError("this file exists", where=str(output), hint="--force replaces it")
    loaded = load_settings(replaced=output)
    files = one_log(logs, loaded)
    robot = describe_robot(loaded.config.robot, loaded.base_dir)
    movable = robot.movable if robot else ()
    summary, flags, guesses = (
        describe(files, loaded.config.log, movable),
        overrides(),
        guesses_of(loaded.path, overrides()),
    )
    asked = next((topic.time_unit for topic in summary.topics if topic.time_unit is not None), None)
    layout: dict[str, object] = {"log.units.time": asked} if asked is not None else {}
    if summary.csv_columns and not summary.topics[0].readable:
        layout = guess_layout(files, loaded.config.log, movable)
    if layout:
        flags, guesses = {**flags, **layout}, guesses | key_paths(layout)
        loaded = load_config(loaded.path, flags)
        summary = describe(files, loaded.config.log, movable)
    columns = guess_csv_columns(files, movable, loaded.config.log.csv)
    known = Known(files, summary, columns, loaded, robot, given_paths(), guesses)
    if arms := arms_in(known, flags):
        if output is None or as_json:
            raise ConfigError(
                "the log is of several arms",
                where=known.summary.name,
                found=", ".join(arms),
                hint="-o FILE writes a configuration for each, and one that names them",
            )
        return _of_arms(arms, logs, output)
    made = drafted(known, output)
    if output is None and not as_json:
        say(made.text, nl=False)
    elif output is not None:
        _write(output, made.text)
    _say_trial(made)
    if as_json:
        say_object("collaudit/init/1", _answer(made, output))
    if not made.missing:
        note(next_step(made.trial, " ".join(logs), output, fitted=loaded.friction_path is not None))
        return EXIT_PASS
    _say_missing(made, output)
    return EXIT_NOT_JUDGED


def _of_arms(arms: Mapping[str, tuple[Arm, Known]], logs: tuple[str, ...], output: Path) -> int:
    """A configuration for each arm beside the one that names them; whether all arms can be judged."""
    from collaudit.cli.drafts.drafted_log import drafted, fleet_text, friction_of

    files = {name: output.with_name(f"{output.stem}.{name}{output.suffix}") for name in arms}
    log, code = "", EXIT_PASS
    for name, (_, known) in arms.items():
        note(f"{name}: one of {len(arms)} arms in this log")
        made = drafted(known, files[name], of_fleet=True)
        log = known.summary.name
        _write(files[name], made.text)
        _say_trial(made)
        if made.missing:
            _say_missing(made, files[name])
            code = EXIT_NOT_JUDGED
    _write(output, fleet_text(log, {name: arm for name, (arm, _) in arms.items()}, files))
    if code == EXIT_PASS:
        fits = "".join(f"\n  collaudit fit LOG -c {file} -o {friction_of(file)}" for file in files.values())
        note(
            "next: record a run free of contact in which all joints of all arms move, then"
            f"{fits}\n  collaudit audit {' '.join(logs)} -c {output} -o out"
        )
    return code


def _answer(made: Drafted, output: Path | None) -> dict[str, object]:
    """The draft, what trying it showed, and what keeps the log from being judged with it."""
    return {
        "file": None if output is None else str(output),
        "toml": made.text,
        "guesses": made.text.count("GUESS:"),
        "judged": not made.missing,
        "verdict": made.trial.verdict,
        "missing": list(made.missing),
        "findings": [asdict(finding) for finding in made.trial.findings],
    }


def _write(output: Path, text: str) -> None:
    from collaudit.reports.files.written_files import atomic_write

    atomic_write(output, text)
    note(f"configuration written to {output}; {text.count('GUESS:')} lines in it are guesses: check them")


def _say_trial(made: Drafted) -> None:
    from collaudit.cli.drafts.trial import came_of_it

    print_findings([found for found in made.trial.findings if found.severity != "info"], err=True, brief=True)
    if made.trial.result is not None:
        note(came_of_it(made.trial, made.trial.result))


def _say_missing(made: Drafted, output: Path | None) -> None:
    from collaudit.cli.shared_steps import forbidding

    listed = "\n".join(f"- {each}" for each in made.missing)
    note(f"the log cannot be judged with this configuration yet; missing:\n{listed}")
    if forbidding(made.trial.findings) is not None:
        where = output or "the text above"
        note(f"next: if a commented line (#) in {where} is true, uncomment it, and run collaudit inspect again")


@example_command("check", "collaudit check", "collaudit check collaudit.toml fleet/collaudit-cell1.toml")
@click.argument("configs", nargs=-1, type=click.Path(path_type=Path), metavar="[CONFIG]...")
@click.option("--json", "as_json", is_flag=True, help="Print JSON: whether each can be used, and why not.")
def check_command(configs: tuple[Path, ...], as_json: bool) -> int:
    """Check configurations: keys, values, keys without effect, files, the fleet, and accepted contacts that are over.

    Without an argument collaudit.toml of this folder is checked. As a hook of pre-commit: collaudit-check.

    Exit codes: 0 all can be used; 2 one cannot. An acceptance that is over is said, and is no error.
    """

    problems: dict[str, str | None] = {}
    for path in configs or (Path("collaudit.toml"),):
        try:
            _check(path)
        except CollauditError as error:
            note(error.render())
            problems[str(path)] = error.render()
        else:
            problems[str(path)] = None
            if not as_json:
                say(f"ok  {path}")
    if as_json:
        say_object("collaudit/check/1", {"problems": problems})
    return EXIT_USAGE if any(problems.values()) else EXIT_PASS


def _check(path: Path) -> None:
    from collaudit.cli.batch.log_jobs import robot_settings
    from collaudit.cli.batch.precedents import read_accepted
    from collaudit.core.config import load_config
    from collaudit.core.config.describe import without_effect
    from collaudit.core.contacts.contact_states import day_refusal
    from collaudit.reports.files.run_files import read_friction

    loaded = load_config(path)
    robots = loaded.config.fleet.robots
    for settings in (loaded, *robot_settings(loaded, {}, robots).values()):
        if idle := without_effect(settings.config):
            raise ConfigError(
                "a key is stated that has no effect",
                where=str(settings.path or path),
                found=", ".join(need.key for need in idle),
                expected="; ".join(f"{need.key} with {need.needs}" for need in idle),
                hint="state what it goes with, or take it out",
            )
        urdf = settings.urdf_path
        if urdf is not None and not urdf.is_file():
            raise ConfigError("the robot's description is not there", where=str(path), found=str(urdf))
        if settings.friction_path is not None:
            read_friction(settings.friction_path)
    today = datetime.now(UTC).date()
    for entry in read_accepted(loaded):
        why = day_refusal(entry, today)
        if why is not None:
            note(f"accepted contact that does not count, {why}: {entry.words}")
