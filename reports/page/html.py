"""``report.html``: one self-contained page that works offline and runs no script."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from collaudit.core.data.audit_result import Audit
from collaudit.reports.files.atomic import atomic_write
from collaudit.reports.page.environment import environment
from collaudit.reports.page.view import AuditView, make_view

_MOST_COLLISION_PLOTS = 40
_MOST_NEAR_MISS_PLOTS = 20
_LEAST_PLOTS = 4
_SEVERITY = {"fail": 0, "not_judged": 1, "pass": 2}


def write_html(path: Path, audits: Sequence[Audit]) -> None:
    """Write the page of one or several audits; the same audits give the same bytes.

    Args:
        path: the file to make.
        audits: at least one; several are shown worst first.

    Raises:
        CollauditError: the file cannot be written.
    """
    atomic_write(path, html_text(audits))


def html_text(audits: Sequence[Audit]) -> str:
    """The page as text; of several logs fewer events are drawn for each."""
    ordered = sorted(audits, key=lambda audit: _SEVERITY[audit.result.verdict])
    views = [_view(audit, f"log{k}", len(ordered)) for k, audit in enumerate(ordered, 1)]
    versions = sorted({view.result.provenance.collaudit for view in views})
    return environment().get_template("report.html.j2").render(views=views, version=", ".join(versions))


def _view(audit: Audit, key: str, logs: int) -> AuditView:
    return make_view(
        audit,
        key,
        max(_LEAST_PLOTS, _MOST_COLLISION_PLOTS // logs),
        max(_LEAST_PLOTS, _MOST_NEAR_MISS_PLOTS // logs),
    )
