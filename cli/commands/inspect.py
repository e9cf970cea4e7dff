"""``collaudit inspect``: what is in a log."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import click

from collaudit.cli.console import note, print_findings, progress, say, say_object, terminal_width
from collaudit.cli.group import example_command
from collaudit.cli.settings import config_option, load_settings, urdf_option
from collaudit.cli.shared_steps import forbidding
from collaudit.core.api import LogFiles, find_logs, open_log, prepare
from collaudit.core.config import LoadedConfig
from collaudit.core.errors import EXIT_NOT_JUDGED, EXIT_PASS, CollauditError, ConfigError, LogError, NotJudgedError
from collaudit.core.findings import Finding
from collaudit.core.logs.log_summary import LogSummary
from collaudit.core.logs.signals.signal_roles import is_usable, refusal_hint
from collaudit.core.logs.topics.field_paths import fields_line


@example_command(
    "inspect",
    "collaudit inspect run.mcap",
    "collaudit inspect run.bag -c collaudit.toml",
    "collaudit inspect run.db3 --urdf arm.urdf",
    "collaudit inspect position.csv velocity.csv effort.csv --json",
)
@click.argument("logs", nargs=-1, required=True, metavar="LOG...")
@click.option("-v", "--verbose", is_flag=True, help="Print facts, too: what was chosen, and leaves nothing to do.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
@config_option
@urdf_option
def command(logs: tuple[str, ...], verbose: bool, as_json: bool) -> int:
    """Show what is in a log: topics, types, joints, rates, gaps, units as understood, findings.

    With a robot (-c or --urdf) the log is also read as an audit would read it, and its effort is compared
    with the model's gravity torque: a wrong sign or unit shows here.

    Exit code 3 when something found here forbids judging.
    """
    from collaudit.core.logs.log_description import describe
    from collaudit.core.robot.robot_description import describe_robot
    from collaudit.reports.terminal.log_text import log_text
    from collaudit.reports.values.visible_text import visible

    loaded = load_settings()
    robot = describe_robot(loaded.config.robot, loaded.base_dir)
    looks, unusable = [], None
    for files in find_logs(logs, loaded):
        summary = describe(files, loaded.config.log, robot.movable if robot else ())
        error, checked = _audit_findings(files, loaded)
        unusable = unusable or (error if isinstance(error, ConfigError) else None)
        known = set(summary.findings)
        findings = (*summary.findings, *(finding for finding in checked if finding not in known))
        looks.append(_Look(summary, findings, error))
    if as_json:
        say_object("collaudit/inspect/1", {"logs": [_answer(look) for look in looks]})
    else:
        for look in looks:
            described = log_text(look.summary, terminal_width())
            name = visible(look.summary.name)
            say(click.style(name, bold=True) + described.removeprefix(look.summary.name).removeprefix(name))
            print_findings([one for one in look.findings if verbose or not one.is_fact], brief=True)
    if unusable is not None:
        raise unusable  # what is in the log was said first
    obstacles = [(look.summary.name, text) for look in looks if (text := look.obstacle())]
    for name, text in obstacles:
        note(f"{name}: cannot be judged as it is: {text}")
    return EXIT_NOT_JUDGED if obstacles else EXIT_PASS


@dataclass(frozen=True, slots=True)
class _Look:
    """What was seen of one log, and why it could not be read as an audit would (None: it could, or no robot)."""

    summary: LogSummary
    findings: tuple[Finding, ...]
    error: CollauditError | None

    def obstacle(self) -> str | None:
        """Why nothing in the log could be judged; None when it could."""
        if self.error is not None and not any(one.text in self.error.message for one in self.findings):
            return self.error.render()
        found = [topic for topic in self.summary.topics if topic.role == "joint_states" and topic.readable]
        if not found:
            lines = [fields_line(topic.name, topic.fields) for topic in self.summary.topics if topic.fields]
            offered = "\n  try:      if these are measured, say where they stand: " + "; or ".join(lines)
            return "no joint states were found in it" + (offered if lines else "")
        if not any(topic.joints for topic in found):
            names = ", ".join(topic.name for topic in found)
            return f"no message of its joint states ({names}) could be read"
        if not any(is_usable(topic.signal) for topic in found):
            kinds = ", ".join(f"{topic.name} ({topic.signal})" for topic in found)
            line = f'[log] joint_states = "{found[0].name}"'
            return f"no joint states are measured by their names: {kinds}\n  try:      {refusal_hint(line)}"
        return forbidding(self.findings)


def _audit_findings(files: LogFiles, loaded: LoadedConfig) -> tuple[CollauditError | None, tuple[Finding, ...]]:
    """What reading the log with its robot shows, or why it cannot be read so; without a robot, why none could read it.

    Raises:
        CollauditError: the robot cannot be used at all.
    """
    if loaded.config.robot.urdf is None and not loaded.config.robot.dh:
        try:
            open_log(files, loaded)
        except (LogError, NotJudgedError) as error:
            return error, ()
        except ConfigError:  # what init asks about
            pass
        return None, ()
    try:
        with progress("reading") as report:
            prepared = prepare(files, loaded, progress=report)
        from collaudit.core.verdict.verdict import asked_findings  # a log that is refused needs none of it

        return None, asked_findings(prepared, loaded.config)
    except (ConfigError, LogError, NotJudgedError) as error:
        return error, ()


def _answer(look: _Look) -> dict[str, object]:
    return {
        **asdict(look.summary),
        "findings": [asdict(finding) for finding in look.findings],
        "error": None if look.error is None else look.error.render(),
    }
