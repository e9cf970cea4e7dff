"""What keeps a log from being judged, as ``inspect`` and ``init`` see it: reading errors and findings, judged alike."""

from __future__ import annotations

from collections.abc import Sequence

from collaudit.cli.progress_bar import progress
from collaudit.core.api import LogFiles, prepare
from collaudit.core.config import LoadedConfig
from collaudit.core.findings import Finding


def read_findings(files: LogFiles, loaded: LoadedConfig) -> tuple[Finding, ...]:
    """What reading a log as an audit would shows of it.

    Raises:
        CollauditError: it cannot be read so.
    """
    from collaudit.core.verdict.verdict import asked_findings

    with progress("reading") as report:
        return asked_findings(prepare(files, loaded, progress=report), loaded.config)


def forbidding(findings: Sequence[Finding]) -> str | None:
    """Where to look for what forbids judging; None when no finding does."""
    codes = sorted({finding.code for finding in findings if finding.forbids_pass})
    return f"see {', '.join(codes)} above" if codes else None
