"""One log of an audit of many: judged, written, and summed up; never an exception."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from collaudit.core.errors import CollauditError
from collaudit.core.result import Verdict

if TYPE_CHECKING:
    from collaudit.cli.chain import LogFiles, Progress
    from collaudit.core.config import LoadedConfig

_RUN_FILES = ("audit.json", "signals.parquet", "friction.json", "report.html")


@dataclass(frozen=True, slots=True)
class LogOutcome:
    """What became of one log; an entry of ``summary.json``.

    Attributes:
        log: its name.
        verdict: of its audit; ``not_judged`` when there was none.
        reasons: why.
        run: folder of its files, relative to OUT; None when there are none.
        report: its page, relative to OUT.
        sha256: of the log.
        collisions, near_misses: counts.
        judged_h: hours judged by the rule, of the watched joint with the most.
        findings: code to how often.
        error: the message when there was no audit.
    """

    log: str
    verdict: Verdict
    reasons: tuple[str, ...]
    run: str | None
    report: str | None
    sha256: str | None
    collisions: int
    near_misses: int
    judged_h: float
    findings: Mapping[str, int]
    error: str | None

    def as_json(self) -> dict[str, object]:
        """The outcome as JSON-able values."""
        return asdict(self)


def audit_one(files: LogFiles, folder: str, loaded: LoadedConfig, out: Path, progress: Progress | None) -> LogOutcome:
    """Judge one log and write its run and report into ``out / folder``.

    A log that cannot be judged gives an outcome with its one message, and leaves no files of an earlier run.
    """
    from collaudit.cli.chain import judge, log_name
    from collaudit.reports.files import write_audit
    from collaudit.reports.html import write_html

    run = out / folder
    try:
        audit, friction = judge(files, loaded, progress)
    except CollauditError as error:
        _remove_old(run)
        return _failed(log_name(files), error.render(), error.message)
    except MemoryError:
        _remove_old(run)
        return _failed(log_name(files), "not enough memory for this log", "not enough memory")
    write_audit(run, audit, friction)
    write_html(run / "report.html", [audit])
    result = audit.result
    judged = [cover.judged_s for cover in result.coverage.joints.values() if cover.watched]
    counts: dict[str, int] = {}
    for finding in result.findings:
        counts[finding.code] = counts.get(finding.code, 0) + 1
    return LogOutcome(
        log=result.log.name,
        verdict=result.verdict,
        reasons=result.reasons,
        run=folder,
        report=f"{folder}/report.html",
        sha256=result.log.sha256,
        collisions=len(result.collisions),
        near_misses=len(result.near_misses),
        judged_h=max(judged, default=0.0) / 3600,
        findings=counts,
        error=None,
    )


def _failed(name: str, error: str, reason: str) -> LogOutcome:
    return LogOutcome(name, "not_judged", (reason,), None, None, None, 0, 0, 0.0, {}, error)


def _remove_old(run: Path) -> None:
    """Take away an earlier run's files, which would stand for a log that was not judged now."""
    for name in _RUN_FILES:
        (run / name).unlink(missing_ok=True)
