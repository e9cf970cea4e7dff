"""One log: ``collaudit inspect`` says what is in it, ``detect`` judges it, ``explain`` what takes its residual away."""

from __future__ import annotations

import shlex
from dataclasses import asdict, dataclass
from pathlib import Path

import click

from collaudit.cli.console import (
    note,
    print_findings,
    progress,
    say,
    say_json,
    say_object,
    say_result,
    terminal_width,
    verbose_option,
)
from collaudit.cli.group import example_command
from collaudit.cli.settings import (
    config_option,
    friction_option,
    load_settings,
    part_options,
    urdf_option,
)
from collaudit.cli.shared_steps import audit_files, exit_code, forbidding, one_log
from collaudit.core.api import LogFiles, find_logs, open_log, prepare
from collaudit.core.config import LoadedConfig
from collaudit.core.data.audit_result import AuditResult
from collaudit.core.errors import EXIT_NOT_JUDGED, EXIT_PASS, CollauditError, ConfigError, LogError, NotJudgedError
from collaudit.core.findings import Finding
from collaudit.core.logs.log_summary import LogSummary
from collaudit.core.logs.signals.signal_names import is_usable, refusal_hint
from collaudit.core.logs.topics.log_topics import fields_line


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
def inspect_command(logs: tuple[str, ...], verbose: bool, as_json: bool) -> int:
    """Show what is in a log: topics, types, joints, rates, gaps, units as understood, findings.

    With a robot (-c or --urdf) the log is also read as an audit would read it, and its effort is compared
    with the model's gravity torque: a wrong sign or unit shows here.

    Exit code 3 when something found here forbids judging.
    """
    from collaudit.core.logs.log_description import describe
    from collaudit.core.robot.robot_description import describe_robot
    from collaudit.reports.terminal.screen_text import log_text
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
        say_object("collaudit/inspect/1", {"logs": [_described(look) for look in looks]})
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


def _described(look: _Look) -> dict[str, object]:
    return {
        **asdict(look.summary),
        "findings": [asdict(finding) for finding in look.findings],
        "error": None if look.error is None else look.error.render(),
    }


SCORE_SCHEMA = "collaudit/score/1"


@example_command(
    "detect",
    "collaudit detect run.mcap -c collaudit.toml --friction friction.json -o run/",
    "collaudit detect run.bag --set robot.urdf=arm.urdf --set detect.gamma_nm=4 --set detect.n=13 --json",
    "collaudit detect hits.mcap -c hits.toml --friction friction.json --truth hits.truth.json",
    "collaudit detect run.db3 -c collaudit.toml --set 'detect.gamma_nm={joint1=4, joint2=6}'",
)
@click.argument("logs", nargs=-1, required=True, metavar="LOG...")
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), metavar="RUN", help="Folder for audit.json and signals."
)
@click.option("--json", "as_json", is_flag=True, help="Print audit.json.")
@click.option(
    "--truth",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Known events to score against: NAME.truth.json, or a .csv with onset_s, end_s, joint.",
)
@verbose_option
@config_option
@part_options
@friction_option
def detect_command(logs: tuple[str, ...], output: Path | None, as_json: bool, truth: Path | None, verbose: bool) -> int:
    """Judge one log: residual torque against gamma for n samples; contacts and near misses.

    Several files are taken as CSV parts of one recording. Without a friction file, friction is fitted on
    the log itself, which is no evidence: [policy] same_log = "folds" judges each part by a fit of the others.

    Exit codes: 0 policy kept, 1 policy broken, 3 not judged.
    """
    from collaudit.cli.batch.precedents import precedents_of_log
    from collaudit.reports.files.run_files import result_json, write_run
    from collaudit.reports.files.written_files import atomic_write, json_text, refuse_link

    loaded = load_settings()
    files = one_log(logs, loaded)
    if output is not None:
        refuse_link(output)
        (output / "audit.json").unlink(missing_ok=True)  # an earlier verdict must not outlive a run that fails
    with progress("judging") as report:
        audit, friction = audit_files(files, loaded, report, truth, precedents_of_log(files, loaded))
        if output is not None:
            write_run(output, audit, friction)
    scores = audit.result.detection.scores if audit.result.detection else ()
    if output is not None and scores:
        atomic_write(output / "score.json", json_text({"schema": SCORE_SCHEMA, "scores": scores}))
    if as_json:
        say_json(result_json(audit.result))
    else:
        _say_judged(audit.result, output, verbose)
    if output is not None:
        command = shlex.join(["collaudit", "report", str(output), "-o", "report.html"])
        note(f"run written to {output}: {command} makes the page")
    return exit_code([audit.result.verdict])


def _say_judged(result: AuditResult, output: Path | None, verbose: bool) -> None:
    from collaudit.reports.sections.event_sections import score_section
    from collaudit.reports.terminal.screen_text import audit_text, detection_text, screen_text
    from collaudit.reports.terminal.text_table import section_text

    width = terminal_width()
    if verbose:
        say_result(audit_text(result, width))
    else:
        kept = "" if output is None else f"; {output / 'audit.json'}"
        say_result(screen_text(result, width, f"-v{kept}"))
    if verbose:
        say(detection_text(result, width), nl=False)
    elif result.detection is not None and result.detection.scores:
        say("\n" + section_text(score_section(result.detection.scores), width), nl=False)


EXPLAIN_SCHEMA = "collaudit/explain/1"


@example_command(
    "explain",
    "collaudit explain run.mcap -c collaudit.toml --friction friction.json",
    "collaudit explain run.csv -c collaudit.toml --friction friction.json --json",
)
@click.argument("logs", nargs=-1, required=True, metavar="LOG...")
@click.option("--json", "as_json", is_flag=True, help="Print JSON: causes with share, interval and line to paste.")
@config_option
@friction_option
def explain_command(logs: tuple[str, ...], as_json: bool) -> int:
    """Try causes on a log that fails or is not judged: tool, mounting, scale, friction, zero, delay, exchanged joints.

    Each is a small solve on what the residual has beyond that of the fitted motion, and is tried on blocks of time that
    the solve has not seen. A cause tells what to state before the next run; it never changes a verdict.

    Exit codes: as of detect.
    """
    from collaudit.reports.terminal.screen_text import causes_text
    from collaudit.reports.values.visible_text import visible, wrapped
    from collaudit.reports.values.words import cause_sentence, verdict_word

    loaded = load_settings()
    with progress("judging") as report:
        audit, _ = audit_files(one_log(logs, loaded), loaded, report)
    result = audit.result
    if as_json:
        say_object(EXPLAIN_SCHEMA, {"log": result.log.name, "verdict": result.verdict, "causes": result.causes})
        return exit_code([result.verdict])
    width = terminal_width()
    say_result(f"{verdict_word(result.verdict, result.exclusions)}  {visible(result.log.name)}\n")
    passed = "It passes: there is nothing to explain."
    nothing = passed if result.verdict == "pass" else "No single cause explains enough of its residual to be named."
    say_result(f"{wrapped(cause_sentence(result) or nothing, width, '  ')}\n")
    say(causes_text(result, width), nl=False)
    return exit_code([result.verdict])
