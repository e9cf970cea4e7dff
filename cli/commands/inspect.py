"""``collaudit inspect``: what is in a log."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

import click

from collaudit.cli.console import bytes_text, note, print_findings, progress
from collaudit.cli.group import example_command
from collaudit.cli.settings import config_option, load_settings, robot_options
from collaudit.core.errors import EXIT_NOT_JUDGED, EXIT_PASS, CollauditError, LogError, NotJudgedError

if TYPE_CHECKING:
    from collaudit.core.api import LogFiles
    from collaudit.core.config import LoadedConfig
    from collaudit.core.findings import Finding
    from collaudit.core.logs import LogSummary, TopicInfo

INSPECT_SCHEMA = "collaudit/inspect/1"
_LONGEST_LIST = 24


@example_command(
    "inspect",
    "collaudit inspect run.mcap",
    "collaudit inspect run.bag -c collaudit.toml",
    "collaudit inspect run.db3 --urdf arm.urdf",
    "collaudit inspect position.csv velocity.csv effort.csv --json",
)
@click.argument("logs", nargs=-1, required=True, metavar="LOG...")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
@config_option
@robot_options
def command(logs: tuple[str, ...], as_json: bool) -> int:
    """Show what is in a log: topics, types, joints, rates, gaps, units as understood, findings.

    With a robot (-c or --urdf) the log is also read as an audit would read it, and its effort is compared
    with the model's gravity torque: a wrong sign or unit shows here.

    Exit code 3 when something found here forbids judging.
    """
    from collaudit.core.api import find_logs
    from collaudit.core.logs import describe

    loaded = load_settings()
    looks = []
    for files in find_logs(logs, loaded):
        summary = describe(files, loaded.config.log)
        error, checked = _audit_findings(files, loaded)
        known = set(summary.findings)
        findings = (*summary.findings, *(finding for finding in checked if finding not in known))
        looks.append(_Look(summary, findings, error))
    if as_json:
        click.echo(_json(looks))
    else:
        for look in looks:
            click.echo(_text(look.summary))
            print_findings(look.findings)
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
        if self.error is not None:
            return self.error.render()
        if not any(topic.role == "joint_states" and topic.readable for topic in self.summary.topics):
            return "no joint states were found in it"
        errors = sorted({finding.code for finding in self.findings if finding.severity == "error"})
        return f"see {', '.join(errors)} above" if errors else None


def _audit_findings(files: LogFiles, loaded: LoadedConfig) -> tuple[CollauditError | None, tuple[Finding, ...]]:
    """What reading the log with its robot shows; nothing without a robot.

    Raises:
        CollauditError: the robot or the settings cannot be used at all.
    """
    from collaudit.core.api import prepare

    if loaded.config.robot.urdf is None and not loaded.config.robot.dh:
        return None, ()
    try:
        with progress("reading") as report:
            return None, prepare(files, loaded, progress=report).findings
    except (LogError, NotJudgedError) as error:
        return error, ()


def _json(looks: list[_Look]) -> str:
    logs = [
        {
            **asdict(look.summary),
            "findings": [asdict(finding) for finding in look.findings],
            "error": None if look.error is None else look.error.render(),
        }
        for look in looks
    ]
    return json.dumps({"schema": INSPECT_SCHEMA, "logs": logs}, indent=2, ensure_ascii=False)


def _text(summary: LogSummary) -> str:
    from collaudit.reports.terminal.audit_text import table

    title = [click.style(summary.name, bold=True), f"{summary.format}, {bytes_text(summary.size_bytes)}"]
    if summary.duration_s is not None:
        title.append(f"{summary.duration_s:.3f} s")
    if summary.start_ns is not None:
        title.append(f"starts {_utc(summary.start_ns)}")
    lines = ["  ".join(title)]
    if summary.csv_columns:
        lines.append(f"  {len(summary.csv_columns)} columns: {_listed(summary.csv_columns)}")
    if summary.topics:
        rows = [
            (
                topic.name,
                topic.type,
                topic.role.replace("_", " "),
                str(topic.count),
                "" if topic.rate_hz is None else f"{topic.rate_hz:.1f}",
                "" if topic.largest_gap_s is None else f"{topic.largest_gap_s:.3f}",
                topic.note,
            )
            for topic in summary.topics
        ]
        head = ("topic", "type", "role", "messages", "Hz", "largest gap s", "note")
        lines.append(_indent(table(head, rows, numeric=(3, 4, 5)).rstrip()))
        lines += [f"  joints of {topic.name}: {_joints(topic)}" for topic in summary.topics if topic.joints]
    return "\n".join(lines)


def _joints(topic: TopicInfo) -> str:
    present = {"velocity": topic.has_velocity, "effort": topic.has_effort}
    lacking = [f"no {name}" for name, there in present.items() if there is False]
    return _listed(topic.joints) + (f" ({', '.join(lacking)})" if lacking else "")


def _listed(names: tuple[str, ...]) -> str:
    shown = [name for name in names if name][:_LONGEST_LIST]
    return ", ".join(shown) + (", …" if len(names) > _LONGEST_LIST else "")


def _indent(text: str) -> str:
    return "\n".join(f"  {line}" for line in text.splitlines())


def _utc(start_ns: int) -> str:
    from datetime import UTC, datetime

    return datetime.fromtimestamp(start_ns / 1e9, UTC).strftime("%Y-%m-%d %H:%M:%S UTC")
