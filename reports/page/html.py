"""``report.html``: one self-contained page that works offline, with and without JavaScript."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from markupsafe import Markup

from collaudit.core.data.audit_result import Audit, AuditResult
from collaudit.core.data.friction_result import FrictionFit
from collaudit.core.data.signals import Signals
from collaudit.core.friction.friction_model import FrictionModel
from collaudit.core.numeric.parallel import Progress, stage
from collaudit.reports.files.run_files import StoredRun
from collaudit.reports.files.signals_file import in_memory
from collaudit.reports.files.written_files import atomic_write
from collaudit.reports.page.environment import environment, page_scripts, page_style, shared_scripts
from collaudit.reports.page.figures import ContactCard, Detail, JointFigures, contact_cards, joint_figures
from collaudit.reports.page.first_screen import Fact, LogStrip, log_strip, verdict_facts
from collaudit.reports.plots.plot_friction import draw_friction
from collaudit.reports.plots.signal_data import pose_block
from collaudit.reports.sections.event_sections import (
    contact_section,
    detection_sections,
    disturbance_section,
    near_miss_section,
)
from collaudit.reports.sections.finding_sections import fact_lines, finding_section
from collaudit.reports.sections.fit_sections import friction_sections, identified_sections
from collaudit.reports.sections.judged_sections import (
    coverage_section,
    cycle_section,
    force_section,
    judged_section,
    residual_section,
    span_section,
    threshold_evidence,
)
from collaudit.reports.sections.section import Section
from collaudit.reports.values.first_words import excluded_lines, first_lines, more_reasons, strongest, unsaid
from collaudit.reports.values.numbers import significant
from collaudit.reports.values.visible_text import visible
from collaudit.reports.values.words import effort_unit, plural, speed_unit, verdict_word

#: Contacts that the page lists.
MOST_CONTACTS = 500
_CONTACT = (
    "#",
    "onset",
    "wall clock",
    "lasted",
    "alarms",
    "link or further out",
    "force (95 %)",
    "after it",
    "tool speed",
    "kind",
    "state",
    "controller",
    "id",
)
_RESIDUAL = ("joint", "mean |r|", "RMS", "99 % below", "largest", "γ", "judged", "clean mean")
_SMALL = ("histogram, ±1.2 γ", "autocorrelation, to 0.5 s", "RMS over the log")


@dataclass(frozen=True, slots=True, eq=False)
class AuditView:
    """Everything the templates need of one audit; fields in the order of the page.

    Attributes:
        key: prefix of its anchors, unique in the page.
        end_s: time of the last sample.
        word: the verdict in words.
        first: what comes before anything else.
        reasons, excluded: those of the verdict that it does not say.
    """

    key: str
    result: AuditResult
    end_s: float
    word: str
    first: tuple[str, ...]
    reasons: list[str]
    excluded: list[str]
    facts: tuple[Fact, ...]
    strip: LogStrip
    judged: Section
    time: tuple[Section, ...]
    cards: tuple[ContactCard, ...]
    contacts: Section
    near_misses: Section
    disturbances: Section
    recommended: Section
    friction: tuple[FrictionSheet, ...]
    residual: Section
    figures: tuple[JointFigures, ...]
    detection: tuple[Section, ...]
    cycles: Section
    findings: tuple[Section, ...]
    identified: tuple[Section, ...]

    def drawings(self) -> list[tuple[str, list[Markup | None]]]:
        """Small drawings beside :attr:`residual`: of each kind its title, and one for each row."""
        small = {figure.joint: figure.small for figure in self.figures}
        none = (None,) * len(_SMALL)
        return [(title, [small.get(row[0], none)[k] for row in self.residual.rows]) for k, title in enumerate(_SMALL)]


def make_view(audit: Audit | StoredRun, key: str, detail: Detail, progress: Progress | None = None) -> AuditView:
    """Draw and word one audit.

    Args:
        audit: the audit; its signals in memory or in the file of its run.
        key: prefix of its anchors, unique in the page.
        detail: how much is drawn.
        progress: called with steps done and in all.
    """
    result = audit.result
    source = in_memory(audit.signals) if isinstance(audit.signals, Signals) else audit.signals
    end = result.log.duration_s if source.end_s is None else source.end_s
    contacts, first = strongest(result, detail.cards), first_lines(result)
    figures = joint_figures(source, result, contacts, key, detail, stage(progress, 0.0, 1.0))
    return AuditView(
        key=key,
        result=result,
        end_s=end,
        word=verdict_word(result.verdict, result.exclusions),
        first=first,
        reasons=more_reasons(result, first),
        excluded=unsaid(excluded_lines(result), first),
        facts=verdict_facts(result),
        strip=log_strip(result, end, figures),
        judged=judged_section(result),
        time=tuple(s for s in (coverage_section(result), force_section(result), span_section(result)) if s.rows),
        cards=contact_cards(result, contacts, figures, source.force_n() if contacts else None, key),
        contacts=contact_section(result).only(*_CONTACT),
        near_misses=near_miss_section(result),
        disturbances=disturbance_section(result),
        recommended=threshold_evidence(result),
        friction=friction_sheets(result, key),
        residual=residual_section(result).only(*_RESIDUAL),
        figures=figures,
        detection=detection_sections(result),
        cycles=cycle_section(result),
        findings=_findings(result),
        identified=() if result.identification is None else identified_sections(result.identification),
    )


def _findings(result: AuditResult) -> tuple[Section, ...]:
    """What forbids judging or limits trust, what is worth knowing, and facts."""
    errors = [finding for finding in result.findings if finding.severity == "error"]
    warnings = [finding for finding in result.findings if finding.severity == "warning"]
    other = [finding for finding in result.findings if finding.severity == "info" and not finding.is_fact]
    facts = fact_lines(result.findings)
    found = (
        finding_section("Errors forbid judging", errors),
        replace(finding_section(f"{plural(len(warnings), 'warning')}: they limit trust", warnings), folded=True),
        replace(finding_section("Worth knowing", other), folded=True),
        Section(f"{len(facts)} facts of the log, and choices that were made", (), (), facts, folded=True),
    )
    return tuple(one for one in found if one.rows or one.notes)


@dataclass(frozen=True, slots=True)
class FrictionSheet:
    """One joint's friction.

    Attributes:
        facts: points, speeds, quality, in a line.
        summary: what stands beside the curve.
    """

    joint: str
    fit: FrictionFit
    anchor: str
    plot: Markup | None
    sections: tuple[Section, ...]
    facts: str
    summary: str


def friction_sheets(result: AuditResult, key: str) -> tuple[FrictionSheet, ...]:
    """Every joint's friction, as applied."""
    return tuple(_sheet(joint, fit, f"{key}-friction-{k}") for k, (joint, fit) in enumerate(result.friction.items(), 1))


def _sheet(joint: str, fit: FrictionFit, anchor: str) -> FrictionSheet:
    law = FrictionModel.of(fit)
    plot = None
    if fit.points:
        label = visible(f"Friction of {joint} against speed: {fit.n_points} points, {fit.model or 'no curve'}")
        plot = draw_friction(fit, effort_unit(fit), speed_unit(fit), f"{anchor}-plot", label)
    return FrictionSheet(
        joint=joint,
        fit=fit,
        anchor=anchor,
        plot=plot,
        sections=friction_sections(fit),
        facts=_facts(fit, None if law is None else law.hold),
        summary=_summary(fit),
    )


def _facts(fit: FrictionFit, hold_nm: float | None) -> str:
    torque, reach = effort_unit(fit), fit.speed_range_rad_s
    facts = [f"{fit.n_points} points, {fit.n_pairs} of them from both directions"]
    facts += [f"speeds {significant(reach[0])} to {significant(reach[1])} {speed_unit(fit)}"] if reach else []
    if fit.rmse_nm is not None:
        share = "" if fit.rmse_share is None else f" ({significant(100 * fit.rmse_share, 2)} % of rated torque)"
        facts.append(f"RMSE {significant(fit.rmse_nm)} {torque}{share}")
    facts += [f"R² {significant(fit.r_squared, 4)}"] if fit.r_squared is not None else []
    facts += [f"{fit.section_count} sections"] if fit.section_count else []
    facts += [f"taken to hold up to {significant(hold_nm)} {torque} at rest"] if hold_nm is not None else []
    return " · ".join(facts)


def _summary(fit: FrictionFit) -> str:
    if not fit.model:
        return f"Not fitted: {fit.reason or 'no reason was recorded'}"
    if fit.identifiable and not fit.not_identifiable:
        return f"{fit.model}, determined"
    if fit.identifiable:
        return f"{fit.model}, determined with a reservation"
    return f"{fit.model}, in part undetermined"


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
