"""``report.html``: one self-contained page that works offline, with and without JavaScript."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from markupsafe import Markup

from collaudit.core.data.audit_result import Audit
from collaudit.core.numeric.stage_progress import Progress, stage
from collaudit.reports.files.atomic import atomic_write
from collaudit.reports.files.run_files import StoredRun
from collaudit.reports.page.environment import environment
from collaudit.reports.page.scripts import page_scripts, page_style, shared_scripts
from collaudit.reports.page.sections.figures import Detail
from collaudit.reports.page.view import MOST_CONTACTS, AuditView, make_view
from collaudit.reports.plots.signal_data import pose_block

#: Contacts with plots of their own, of a single log and of each of several; the others have a row and the signals.
_CARDS = 10
_CARDS_OF_MANY = 2
_MANY = 6
#: Samples of each joint in the page, over all logs of it, and beside them around contacts and near misses.
_POINTS = 510
_LONG_POINTS = 3000
_LONG_S = 600.0
_AROUND_EVENTS = 300
_LONG_AROUND_EVENTS = 1500
_SEVERITY = {"fail": 0, "not_judged": 1, "pass": 2}


def write_html(path: Path, audits: Sequence[Audit | StoredRun], assets: str | None = None) -> None:
    """Write the page of one or several audits; the same audits give the same bytes.

    Args:
        path: the file to make.
        audits: at least one; several are shown worst first.
        assets: folder of its scripts, relative to the page; None puts them into it.

    Raises:
        CollauditError: the file cannot be written.
    """
    atomic_write(path, html_text(audits, assets=assets))


def html_text(
    audits: Sequence[Audit | StoredRun],
    progress: Progress | None = None,
    assets: str | None = None,
) -> str:
    """The page as text; of several logs less is drawn of each.

    Args:
        audits: at least one.
        progress: called with steps done and in all.
        assets: as of :func:`write_html`.
    """
    ordered = sorted(audits, key=lambda audit: _SEVERITY[audit.result.verdict])
    views = []
    for k, audit in enumerate(ordered, 1):
        part = stage(progress, 0.9 * (k - 1) / len(ordered), 0.9 * k / len(ordered))
        views.append(make_view(audit, f"log{k}", _detail(audit, len(ordered)), part))
    versions = sorted({view.result.provenance.collaudit for view in views})
    scripts = page_scripts() if assets is None else shared_scripts(assets)
    return (
        environment()
        .get_template("report.html.j2")
        .render(
            views=views,
            version=", ".join(versions),
            scripts=scripts,
            plot_style=page_style(),
            blocks={view.key: signal_block(view) for view in views},
            most_contacts=MOST_CONTACTS,
        )
    )


def _detail(audit: Audit | StoredRun, logs: int) -> Detail:
    long = audit.result.log.duration_s >= _LONG_S
    points, around = (_LONG_POINTS, _LONG_AROUND_EVENTS) if long else (_POINTS, _AROUND_EVENTS)
    cards = _CARDS if logs < _MANY else _CARDS_OF_MANY
    return Detail(cards, max(300, points // logs), max(300, around // logs))


def signal_block(view: AuditView) -> Markup | None:
    """Curves of every joint of one audit, its contacts, and the arm; None where no joint has a residual."""
    joints = [{"id": f"{view.key}-joint-{k}"} | dict(f.data) for k, f in enumerate(view.figures, 1) if f.data]
    if not joints:
        return None
    block = {"end": view.end_s, "start": view.result.log.start, "joints": joints, "contacts": _contacts(view)}
    text = json.dumps(block | {"arm": _arm(view)}, allow_nan=False, separators=(",", ":"))
    for char in "<>&\u2028\u2029":
        text = text.replace(char, f"\\u{ord(char):04x}")
    return Markup(text)


def _contacts(view: AuditView) -> list[list[object]]:
    """Of each contact its number, the time to show, its own, and which joints alarmed, by their place in the arm."""
    links = [] if view.result.arm is None else [link.joint for link in view.result.arm.links]
    listed = list(zip(view.result.contacts, view.contacts.windows, strict=True))[:MOST_CONTACTS]
    return [
        [
            number,
            *(round(s, 4) for s in (*window, contact.onset_s, contact.end_s)),
            [k for k, joint in enumerate(links) if joint in contact.joints],
        ]
        for number, (contact, window) in enumerate(listed, 1)
    ]


def _arm(view: AuditView) -> dict[str, object] | None:
    poses = {figure.joint: figure.pose for figure in view.figures if figure.pose is not None}
    if view.result.arm is None or any(link.joint and link.joint not in poses for link in view.result.arm.links):
        return None
    kept = next(iter(poses.values()))[0]
    position = np.stack([values for _, values in poses.values()], axis=1)
    return pose_block(view.result.arm, list(poses), position, kept)
