"""Audits with a store: what is to be recorded of each log, and the records of a night."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

from collaudit.cli.batch.audit_one import Outcome
from collaudit.cli.batch.log_jobs import LogJob, RecordWanted
from collaudit.core.errors import ConfigError
from collaudit.core.history.log_record import LogRecord
from collaudit.reports.values.entries import IndexEntry

#: In ``--robot``: the name of the folder that a log lies in.
FOLDER = "{folder}"


def with_records(
    jobs: Sequence[LogJob], store: str | None, robot: str | None, night: datetime | None
) -> Sequence[LogJob]:
    """The jobs, told what to record of each log; unchanged without a store.

    Args:
        jobs: the logs.
        store: folder or URL, made where it is new.
        robot: whose logs they are, with :data:`FOLDER` for a log's folder; None: as a fleet's configuration says.
        night: that they count to, None: their own.

    Raises:
        ConfigError: a log's robot is not known. CollauditError: the store cannot be used.
    """
    if store is None:
        return jobs
    from collaudit.reports.store.result_store import ResultStore

    stated = None if night is None else night.date().isoformat()
    today = datetime.now(UTC).date().isoformat()
    made = []
    for job in jobs:
        name = _robot(job, robot)
        made.append(job if name is None else job._replace(wanted=RecordWanted(name, stated, today)))
    ResultStore(store).check()
    return made


def night_records(
    jobs: Sequence[LogJob], outcomes: Sequence[Outcome], decided: Sequence[IndexEntry]
) -> dict[str, LogRecord]:
    """The records of all logs of which one is wanted, by name.

    Args:
        jobs, outcomes: of the audit, in one order.
        decided: in that order, with the verdicts that the policy of the night came to.
    """
    made = {}
    for job, one, entry in zip(jobs, outcomes, decided, strict=True):
        record = one.record
        if record is None and job.wanted is not None:
            record = job.wanted.of_unread(job.files, one.entry.name, one.entry.error or "")
        if record is not None:
            made[entry.name] = replace(record, decided_verdict=entry.verdict, decided_reasons=entry.reasons)
    return made


def _robot(job: LogJob, stated: str | None) -> str | None:
    """Whose log it is; None for one that cannot be judged because no robot is known for it."""
    name = stated or job.robot
    if not name and job.problem is not None:
        return None
    if not name:
        raise ConfigError(
            "a store must know whose logs these are",
            where=f"store, {job.name}",
            expected="a [fleet] in the configuration that this log belongs to, --robot NAME, or --robot '{folder}' "
            "where each robot's logs lie in a folder of its name",
        )
    return name.replace(FOLDER, job.files[0].absolute().parent.name if job.files else Path(job.name).parent.name)
