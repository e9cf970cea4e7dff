"""What is stored of nights, for ``collaudit store prune``: rows of a store, and runs in the folders of audits."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from datetime import UTC, date, datetime
from html import escape
from pathlib import Path
from typing import cast

from collaudit.cli.batch.precedents import SUMMARY_NAME, audited_results, robots_in
from collaudit.core.config.accepted import Acceptance
from collaudit.core.contacts.contact_states import Precedents, concerns, day_refusal, program_of
from collaudit.core.data.audit_result import AUDIT_SCHEMA, AuditResult, Verdict
from collaudit.core.history.retention import KeptRun
from collaudit.reports.files.result_store import ResultStore
from collaudit.reports.files.run_files import AUDIT_NAME, FRICTION_NAME, SIGNALS_NAME
from collaudit.reports.files.written_files import CHECKSUMS_NAME, atomic_write, read_result
from collaudit.reports.values.words import VERDICT_WORD

_PAGE = "report.html"
#: Of a run, what is large; audit.json stays: the verdict, its reasons, every contact.
_LARGE = (SIGNALS_NAME, FRICTION_NAME, _PAGE)

#: About what a row takes in a batch.
_ROW_BYTES = 200

#: Why a log and its contacts are needed: of robot, name, hash, and whether it has contacts; empty where not.
Needs = Callable[[str | None, str, str | None, bool], str]


def needs_of(accepted: Sequence[Acceptance], baselines: Sequence[Path], today: date) -> Needs:
    """What an acceptance that counts, or a folder that audits are compared with, needs.

    An entry may mean a log by its path, which is not stored: the names of files are compared, without folders.

    Args:
        accepted: entries of accepted.toml.
        baselines: folders of audits or runs.
        today: day on which entries are looked at.
    """
    counting = [
        entry.changed({"log": _last(entry.log), "program": _last(entry.program)})
        for entry in accepted
        if day_refusal(entry, today) is None
    ]
    known = {result.log.sha256 for folder in baselines for result, _ in audited_results(folder)}

    def needed(robot: str | None, log: str, sha256: str | None, touched: bool) -> str:
        if sha256 in known:
            return "a baseline has it"
        name = log.rpartition("/")[2]
        asked = Precedents(robot, name, name, today)
        for entry in counting if touched else ():
            if concerns(entry, asked, sha256 or ""):
                return f"accepted by {entry.owner} until {entry.until}"
        return ""

    return needed


def _last(path: str | None) -> str | None:
    """The part behind the last folder."""
    return None if path is None else path.rpartition("/")[2]


def runs_of_store(store: ResultStore, needed: Needs) -> list[KeptRun]:
    """The judgements of a store; of one the size is that of its rows in memory, about."""
    return [
        KeptRun(
            place="\n".join((batch, *identity)),
            robot=rows[0].robot,
            program=program_of(rows[0].log),
            night=date.fromisoformat(rows[0].night),
            verdict=cast("Verdict", rows[0].verdict),
            size=_ROW_BYTES * len(rows),
            needed=needed(rows[0].robot, rows[0].log, rows[0].log_sha256, any(row.contacts for row in rows)),
        )
        for (batch, identity), rows in store.by_batch().items()
    ]


def prune_store(store: ResultStore, gone: Collection[KeptRun]) -> None:
    """Take judgements out of a store, batch by batch."""
    named = [run.place.split("\n") for run in gone]
    for batch in dict.fromkeys(one[0] for one in named):
        store.without(batch, {(robot, identity) for name, robot, identity in named if name == batch})


def audits_below(folder: Path) -> list[Path]:
    """Folders of audits: this one, or those below it that hold a summary and its runs."""
    return sorted(path.parent for path in folder.rglob(SUMMARY_NAME) if robots_in(path.parent))


def runs_of_audits(audits: Sequence[Path], needed: Needs) -> list[KeptRun]:
    """The runs in folders of audits that still have their signals."""
    return [run for out in audits for run in _runs(out, needed)]


def _runs(out: Path, needed: Needs) -> Iterator[KeptRun]:
    for name, robot in robots_in(out).items():
        run = out / name
        if run.is_symlink() or not (run / AUDIT_NAME).is_file() or not (run / SIGNALS_NAME).is_file():
            continue
        result = read_result(run / AUDIT_NAME, AuditResult, AUDIT_SCHEMA)
        audited = datetime.fromtimestamp((run / AUDIT_NAME).stat().st_mtime, UTC).date().isoformat()
        log = result.log
        yield KeptRun(
            place=run.as_posix(),
            robot=robot,
            program=program_of(log.name),
            night=date.fromisoformat((log.start or audited)[:10]),
            verdict=result.verdict,
            size=sum((run / part).stat().st_size for part in _LARGE if (run / part).is_file()),
            needed=needed(robot, log.name, log.sha256, bool(result.contacts)),
        )


def prune_audits(gone: Collection[KeptRun], today: date) -> None:
    """Take what is large out of runs: links still lead to a page, which says so, and checksums still hold."""
    for run in gone:
        folder = Path(run.place)
        for name in (SIGNALS_NAME, FRICTION_NAME):
            (folder / name).unlink(missing_ok=True)
        log = read_result(folder / AUDIT_NAME, AuditResult, AUDIT_SCHEMA).log.name
        said = f"{escape(log)}: {VERDICT_WORD[run.verdict]}. Page and signals were pruned on {today}."
        text = f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{escape(log)}</title><h1>Pruned</h1>'
        atomic_write(folder / _PAGE, f'{text}<p>{said} <a href="{AUDIT_NAME}">{AUDIT_NAME}</a> has the verdict.</p>\n')
    for out in {Path(run.place).parent for run in gone}:
        gone_here = {f"{Path(run.place).name}/{name}" for run in gone for name in _LARGE}
        sums = out / CHECKSUMS_NAME
        if sums.is_file():
            lines = sums.read_text(encoding="utf-8", errors="surrogateescape").splitlines()
            kept = [line for line in lines if line.partition("  ")[2] not in gone_here]
            atomic_write(sums, "".join(f"{line}\n" for line in kept).encode("utf-8", "surrogateescape"))
