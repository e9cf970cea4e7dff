"""What is known before a night is judged: contacts of a store or of an earlier audit, and accepted.toml."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from datetime import UTC, date, datetime
from functools import cache
from pathlib import Path

from collaudit.cli.batch.log_jobs import LogJob, Outcome
from collaudit.core.api import LogFiles, log_name
from collaudit.core.config import LoadedConfig
from collaudit.core.config.accepted import ACCEPTED_NAME, Acceptance, load_accepted
from collaudit.core.contacts.contact_states import EarlierContact, EarlierLog, Precedents, program_of
from collaudit.core.data.audit_result import AUDIT_SCHEMA, AuditResult
from collaudit.core.errors import ConfigError
from collaudit.core.history.night_row import NightRow, rows_of_result
from collaudit.core.small_files import read_object
from collaudit.reports.files.run_files import AUDIT_NAME, CYCLES_NAME
from collaudit.reports.files.written_files import read_result

#: What makes a folder a store.
STORE_NAME = "store.json"
SUMMARY_NAME = "summary.json"


def accepted_path(loaded: LoadedConfig) -> Path:
    """The file of accepted contacts: it lies beside the configuration."""
    return (Path() if loaded.path is None else loaded.path.parent) / ACCEPTED_NAME


def read_accepted(loaded: LoadedConfig) -> tuple[Acceptance, ...]:
    """The entries of accepted.toml; none where there is none.

    Raises:
        ConfigError: it cannot be used.
    """
    return load_accepted(accepted_path(loaded))


def precedents_of_log(files: LogFiles, loaded: LoadedConfig) -> Precedents:
    """What is known of a log that is judged by itself: what is accepted."""
    path, today = files[0].absolute().as_posix(), datetime.now(UTC).date()
    return Precedents(None, log_name(files), path, today, accepted=read_accepted(loaded))


def with_precedents(
    jobs: Sequence[LogJob],
    history: Sequence[EarlierLog],
    accepted: Sequence[Acceptance],
    today: date,
    night: str | None = None,
) -> list[LogJob]:
    """The jobs, told what is known of each log's robot.

    Args:
        jobs: the logs of a night.
        history: judged logs of before.
        accepted: entries of accepted.toml.
        today: day on which they are looked at.
        night: ISO date that the logs count to in a store; None: their own.
    """
    made = []
    for job in jobs:
        own = [log for log in history if log.robot in (None, job.robot)]
        program = program_of(job.name)
        known = Precedents(
            robot=job.robot,
            log=job.name,
            path=job.place,
            today=today,
            night=night,
            contacts=tuple(contact for log in own for contact in log.contacts),
            nights=tuple(sorted({log.night for log in own if log.program == program})),
            accepted=tuple(accepted),
        )
        made.append(job._replace(known=known))
    return made


def with_references(jobs: Sequence[LogJob], store: str) -> list[LogJob]:
    """The jobs, told what passed nights of a store say of each program's cycles.

    Args:
        jobs: the logs of a night.
        store: folder or URL.

    Raises:
        CollauditError: a file of it cannot be read.
    """
    from collaudit.reports.files.result_store import ResultStore

    known = cache(ResultStore(store).references)
    return [job if job.robot is None else job._replace(earlier=known(job.robot, program_of(job.name))) for job in jobs]


def keep_references(
    store: str,
    out: Path,
    jobs: Sequence[LogJob],
    outcomes: Sequence[Outcome],
    rows: Mapping[str, Sequence[NightRow]],
) -> None:
    """Keep the cycles of logs that passed without contact.

    Args:
        store: folder or URL.
        out: folder of the audit.
        jobs, outcomes: of the audit, in one order.
        rows: of each log, by name, which tell its night.

    Raises:
        CollauditError: the store cannot be written.
    """
    from collaudit.reports.files.result_store import ResultStore

    for job, outcome in zip(jobs, outcomes, strict=True):
        file, result = out / job.folder / CYCLES_NAME, outcome.result
        if job.robot is None or result is None or result.verdict != "pass" or result.contacts or not file.is_file():
            continue
        of_log = rows[outcome.entry.name][0].night, result.log.sha256
        ResultStore(store).keep_reference(job.robot, program_of(job.name), *of_log, file.read_bytes())


def is_store(place: str) -> bool:
    """Whether a place is a store of nights: a URL, or a folder that says so."""
    return "://" in place or (Path(place) / STORE_NAME).is_file()


def read_history(place: str, tonight: str | None) -> list[EarlierLog]:
    """The judged logs of a store, or of the folder of an audit.

    Args:
        place: folder or URL of a store, folder of an audit or a run, or an ``audit.json``.
        tonight: ISO date that the logs to be judged count to: of a store only nights before it are read; None: all.

    Raises:
        ConfigError: there is no audit. CollauditError: a file of it is damaged.
    """
    if is_store(place):
        from collaudit.reports.files.result_store import ResultStore

        stored = ResultStore(place).by_batch().values()
        judged: list[Sequence[NightRow]] = [rows for rows in stored if tonight is None or rows[0].night < tonight]
    else:
        judged = [
            rows_of_result(result, robot or "", (result.log.start or "")[:10], "log")
            for result, robot in audited_results(Path(place))
        ]
        if not judged:
            raise ConfigError(
                "there is no audit to compare with",
                where=place,
                expected=f"a store of nights, the folder of an audit or a run, or an {AUDIT_NAME}",
                hint="collaudit audit LOGS -c collaudit.toml -o BASELINE makes one",
            )
    return [known for rows in judged if (known := _earlier(rows, is_store(place))) is not None]


def _earlier(rows: Sequence[NightRow], stored: bool) -> EarlierLog | None:
    """A log of before by its rows, of a store or not; None where it was not judged and has no contacts."""
    first, program = rows[0], program_of(rows[0].log)
    peaks: dict[int, dict[str, float]] = {}
    places = {}
    for row in rows:
        for contact in row.contacts:
            peaks.setdefault(contact.number, {})[row.joint or ""] = contact.peak_nm
            places[contact.number] = contact.place_m
    if first.verdict == "not_judged" and not peaks:
        return None
    contacts = (EarlierContact(first.night, program, own, places[k], stored) for k, own in sorted(peaks.items()))
    return EarlierLog(first.robot or None, first.night, program, tuple(contacts))


def audited_results(path: Path) -> list[tuple[AuditResult, str | None]]:
    """Results in the folder of an audit, of a run, or in an ``audit.json``, each with its robot.

    Raises:
        CollauditError: a file is damaged.
    """
    return [(read_result(file, AuditResult, AUDIT_SCHEMA), robot) for file, robot in audits_in(path)]


def robots_in(out: Path) -> dict[str, str | None]:
    """Whose each run folder of an audit is, by its name, as the audit's summary says; empty without one."""
    logs = read_object(out / SUMMARY_NAME, 1 << 30).get("logs")
    lines = [one for one in logs if isinstance(one, dict)] if isinstance(logs, list) else []
    return {Path(line["report"]).parent.name: line.get("robot") for line in lines if line.get("report")}


def audits_in(path: Path) -> Iterator[tuple[Path, str | None]]:
    """Every ``audit.json``, and whose log it is about; run folders of the audit's summary, else all there are."""
    if path.is_file():
        yield path, None
    elif (path / AUDIT_NAME).is_file():
        yield path / AUDIT_NAME, robots_in(path.parent).get(path.name)
    else:
        robots = robots_in(path)
        for audit in sorted(path.glob(f"*/{AUDIT_NAME}")):
            if not robots or audit.parent.name in robots:
                yield audit, robots.get(audit.parent.name)
