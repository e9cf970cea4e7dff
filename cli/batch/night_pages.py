"""What speaks of all logs of an audit together: index and summaries, the terminal, and the logs beside earlier ones.

Beside earlier ones stand an overlay of each log with contacts, and what changed in each program.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from datetime import date
from pathlib import Path

from collaudit.cli.batch.log_jobs import LogJob, Outcome
from collaudit.cli.batch.precedents import audits_in
from collaudit.cli.console import note, say_result, terminal_width
from collaudit.cli.shared_steps import audit_files
from collaudit.core.api import load_robot
from collaudit.core.causes.program_change import compare_programs
from collaudit.core.config.accepted import Acceptance
from collaudit.core.contacts.contact_states import acceptance_uses, program_of
from collaudit.core.data.audit_result import AUDIT_SCHEMA, Audit, AuditResult, Verdict
from collaudit.core.data.joint_log import LeftOut
from collaudit.core.data.signals import ProgramComparison
from collaudit.core.verdict.verdict import budget_breaches
from collaudit.reports.files.run_files import AUDIT_NAME, SIGNALS_NAME, read_run
from collaudit.reports.files.written_files import atomic_write, read_result
from collaudit.reports.formats.registry import FORMATS, summary_text
from collaudit.reports.page.environment import write_assets
from collaudit.reports.page.index import write_index
from collaudit.reports.page.matter_pages import overlay_page
from collaudit.reports.terminal.command_texts import summary_table
from collaudit.reports.terminal.screen_text import audit_text, screen_text
from collaudit.reports.values.entries import IndexEntry
from collaudit.reports.values.night import NightFacts
from collaudit.reports.values.visible_text import visible, wrapped

OVERLAY_NAME = "overlay.html"
#: Lines of a screen.
_MOST_LOGS = 20
#: Files that are left out, and entries of accepted.toml, are named up to so many.
_MOST_NAMED = 5


def night_facts(
    jobs: Sequence[LogJob],
    outcomes: Sequence[Outcome],
    others: Sequence[LeftOut],
    accepted: Sequence[Acceptance],
    today: date,
) -> NightFacts:
    """What is said of the night beside its logs.

    Args:
        jobs, outcomes: of the audit, in one order.
        others: files that were left out.
        accepted: entries of accepted.toml.
        today: day on which they are looked at.
    """
    judged = [(job, one.result) for job, one in zip(jobs, outcomes, strict=True) if one.result is not None]
    looked_at = [(job.known, result) for job, result in judged if job.known is not None]
    return NightFacts(
        breaches=tuple(budget_breaches([(job.robot, result) for job, result in judged])),
        left_out=tuple(others),
        accepted=tuple(acceptance_uses(accepted, looked_at, today)),
        robots={job.name: job.robot for job in jobs if job.robot is not None},
    )


def write_night(
    output: Path,
    entries: Sequence[IndexEntry],
    results: Sequence[AuditResult],
    night: NightFacts,
    before: Mapping[str, Sequence[Verdict]],
    formats: Sequence[str],
) -> None:
    """Write what speaks of all logs together: the index page and summaries.

    Args:
        output: folder of the audit.
        entries: a line for every log, and for every file that counts as one.
        results: of the logs that were audited.
        night: what is said of all of them.
        before: by name of log, what became of it in earlier nights.
        formats: of the summaries.
    """

    write_index(output, entries, night, before)
    write_assets(output)
    unread = [entry for entry in entries if entry.error is not None]
    for name in formats:
        atomic_write(output / f"summary{FORMATS[name].suffix}", summary_text(results, name, unread, night))


def write_overlays(out: Path, jobs: Sequence[LogJob], outcomes: Sequence[Outcome], baseline: Path) -> dict[str, str]:
    """Lay the residual of each log with contacts over that of the log of its name in an earlier audit.

    Args:
        out: folder of the audit.
        jobs, outcomes: of the audit, in one order.
        baseline: folder of the earlier audit; logs whose signals it does not have get no page.

    Returns:
        Links, relative to ``out``, by name of log.

    Raises:
        CollauditError: a run cannot be read, or a page not be written.
    """
    links = {}
    for job, outcome in zip(jobs, outcomes, strict=True):
        earlier = baseline / job.folder
        if outcome.result is None or not outcome.result.contacts or not (earlier / SIGNALS_NAME).is_file():
            continue
        page = overlay_page(read_run(out / job.folder), read_run(earlier), "residual")
        atomic_write(out / job.folder / OVERLAY_NAME, page)
        links[job.name] = f"{job.folder}/{OVERLAY_NAME}"
    return links


def changes_since(
    out: Path, jobs: Sequence[LogJob], outcomes: Sequence[Outcome], against: Path
) -> tuple[ProgramComparison, ...]:
    """What changed in each log's program since an earlier audit, run or log.

    Args:
        out: folder of the audit.
        jobs, outcomes: of it, in one order.
        against: folder of an audit, whose logs are found by their program; a run, or a log, for every log.

    Raises:
        CollauditError: nothing can be read there.
    """
    earlier = _earlier(against)
    made = []
    for job, outcome in zip(jobs, outcomes, strict=True):
        if outcome.result is None:
            continue
        old = earlier(job)
        if old is None:
            made.append(ProgramComparison(job.name, "", (0, 0), reason=f"{against} has no log of this program"))
            continue
        new = read_run(out / job.folder)
        made.append(compare_programs(old, new, load_robot(job.loaded, new.signals.joint_names)))
    return tuple(made)


def _earlier(against: Path) -> Callable[[LogJob], Audit | None]:
    """What finds the earlier log of a job."""
    if against.is_file() and against.name != AUDIT_NAME:
        return lambda job: audit_files((against,), job.loaded)[0]
    runs = [file.parent for file, _ in audits_in(against)]
    programs = {program_of(read_result(run / AUDIT_NAME, AuditResult, AUDIT_SCHEMA).log.name): run for run in runs}

    def of_program(job: LogJob) -> Audit | None:
        run = runs[0] if len(runs) == 1 else programs.get(program_of(job.name))
        return None if run is None else read_run(run)

    return of_program


def say_night(entries: Sequence[IndexEntry], results: Sequence[AuditResult], night: NightFacts, verbose: bool) -> None:
    """Print as much as was asked for: of one log its screen, of several the worst."""
    width = terminal_width()
    if len(entries) == 1 and results:
        text = audit_text(results[0], width) if verbose else screen_text(results[0], width, "-v; the index page")
        say_result(text)
        return
    say_result(f"{wrapped(visible(night.sentence(entries)), width)}\n\n")
    say_result(summary_table(entries, width, None if verbose else _MOST_LOGS))
    for text in night.breaches:
        say_result(f"FAIL  {visible(text)}\n")


def say_left_out(others: Sequence[LeftOut]) -> None:
    """Name files that were not taken as logs, companions of logs aside."""
    named = [f"{file.name} ({file.text})" for file in others if file.kind != "companion"]
    more = [f"{len(named) - _MOST_NAMED} more"] if len(named) > _MOST_NAMED else []
    if named:
        note(f"not taken as logs: {'; '.join([*named[:_MOST_NAMED], *more])}")


def say_stale(night: NightFacts) -> None:
    """Name entries of accepted.toml that a person should look at."""
    for use in night.stale[:_MOST_NAMED]:
        note(f"accepted.toml, entry {use.number}, {use.state}: {use.text}")
    if night.stale:
        note(f"{len(night.stale)} of {len(night.accepted)} entries: collaudit accept OUT --prune takes them out")


def say_copies(results: Sequence[AuditResult]) -> None:
    """Name logs of the same content: each counts."""
    names: dict[str, dict[str, None]] = {}
    for result in results:
        names.setdefault(result.log.sha256, {})[result.log.name] = None
    for alike in names.values():
        if len(alike) > 1:
            note(f"the same log {len(alike)} times, and judged as often: {', '.join(alike)}")


def say_error(outcome: Outcome) -> None:
    """Say why a log could not be judged, as soon as it is known."""
    error = outcome.entry.error
    if error is not None:
        note(f"{outcome.entry.name}: not judged\n  " + error.replace("\n", "\n  "))
