"""Logs with contacts beside the same logs of the audit that they are compared with: an overlay in each run folder."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from collaudit.cli.batch.log_jobs import LogJob, Outcome
from collaudit.reports.files.atomic import atomic_write
from collaudit.reports.files.run_files import SIGNALS_NAME, read_run
from collaudit.reports.page.overlay_page import overlay_page

OVERLAY_NAME = "overlay.html"


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
