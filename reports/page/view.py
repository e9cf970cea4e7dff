"""What the page shows of one audit: rows, drawings and sentences, ready for the template."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup
from matplotlib.ticker import MaxNLocator

from collaudit.core.data.audit_result import Audit, AuditResult, Collision, NearMiss
from collaudit.core.data.friction_result import FrictionFit
from collaudit.core.findings import Finding
from collaudit.core.friction.friction_model import FrictionModel
from collaudit.reports.page.selection import select
from collaudit.reports.page.study_section import StudySection, study_section
from collaudit.reports.plots.coverage_bar import coverage_bar
from collaudit.reports.plots.plot_against import draw_against
from collaudit.reports.plots.plot_events import draw_event
from collaudit.reports.plots.plot_friction import draw_friction
from collaudit.reports.plots.plot_overview import draw_overview
from collaudit.reports.values import rows
from collaudit.reports.values.contact_rows import ContactRow, contact_rows, contacts_of
from collaudit.reports.values.identified import Table, identification_tables
from collaudit.reports.values.numbers import against, duration, interval, percent, significant, stated
from collaudit.reports.values.rows import NONE
from collaudit.reports.values.sensitivity_rows import (
    ForceRow,
    SensitivityRow,
    force_rows,
    joint_time,
    sensitivity_row,
    sensitivity_rows,
)
from collaudit.reports.values.visible_text import visible
from collaudit.reports.values.words import counted, effort_unit, law_text, speed_unit, torque_unit, verdict_word

#: What a headline says of the watched joints' time, all joints together.
_TIME_WORDS = ("Joint time in which a contact was detectable", "Joint time hidden by friction", "Joint time not judged")
_EVENT_WORDS = {"collision": "Alarm", "near-miss": "Near miss"}


@dataclass(frozen=True, slots=True)
class Plot:
    """A drawing: anchor, what it shows (title, joint, words), the SVG or None, and a note on what is left out."""

    anchor: str
    title: str
    joint: str
    caption: str
    svg: Markup | None
    note: str | None


@dataclass(frozen=True, slots=True)
class EventRow:
    """A table row, with the anchor of its plot when it has one."""

    row: rows.CollisionRow | rows.NearMissRow
    anchor: str | None


@dataclass(frozen=True, slots=True)
class Events:
    """A table of events and the plots of those that are drawn."""

    rows: tuple[EventRow, ...]
    plots: tuple[Plot, ...]
    note: str | None


@dataclass(frozen=True, slots=True)
class FrictionView:
    """One joint's friction."""

    joint: str
    fit: FrictionFit
    model: str
    plot: Plot | None
    parameters: tuple[rows.ParameterRow, ...]
    known: tuple[tuple[str, str, str, str], ...]
    speeds: str
    rmse: str
    hold: str
    torque_unit: str
    speed_unit: str
    has_band: bool


@dataclass(frozen=True, slots=True)
class FindingRow:
    """One data finding, with its time as text."""

    finding: Finding
    when: str


@dataclass(frozen=True, slots=True)
class Bar:
    """One joint's coverage as a row and a bar over time (None when the signals lack the joint)."""

    row: rows.CoverageRow
    detectable: str
    svg: Markup | None


@dataclass(frozen=True, slots=True)
class AuditView:
    """Everything the template needs of one audit."""

    key: str
    result: AuditResult
    word: str
    headline: tuple[tuple[str, str], ...]
    contacts: tuple[ContactRow, ...]
    sensitivity: tuple[SensitivityRow, ...]
    forces: tuple[ForceRow, ...]
    bars: tuple[Bar, ...]
    ticks: tuple[tuple[float, str], ...]
    phases: tuple[tuple[str, float, float, str], ...]
    collisions: Events
    near_misses: Events
    residual: tuple[rows.ResidualRow, ...]
    overviews: tuple[Plot, ...]
    friction: tuple[FrictionView, ...]
    against: tuple[Plot, ...]
    identified: tuple[Table, ...]
    recommended: tuple[rows.RuleRow, ...]
    study: StudySection | None
    findings: tuple[FindingRow, ...]
    gammas: tuple[tuple[str, str], ...]


def make_view(audit: Audit, key: str, max_collisions: int, max_near_misses: int) -> AuditView:
    """Draw and word one audit.

    Args:
        audit: the audit.
        key: prefix of its anchors, unique in the page.
        max_collisions, max_near_misses: how many get a plot of their own at most.
    """
    result = audit.result
    end = _end(audit)
    return AuditView(
        key=key,
        result=result,
        word=verdict_word(result.verdict, result.exclusions),
        headline=_headline(result),
        contacts=tuple(contact_rows(result)),
        sensitivity=tuple(sensitivity_rows(result)),
        forces=tuple(force_rows(result)),
        bars=tuple(_bar(audit, joint) for joint in result.coverage.joints),
        ticks=_ticks(end),
        phases=tuple(_phase(span.phase, span.start_s, span.end_s, end) for span in result.phases),
        collisions=_events(audit, key, "collision", max_collisions),
        near_misses=_events(audit, key, "near-miss", max_near_misses),
        residual=tuple(rows.residual_row(joint, result) for joint in result.residual),
        overviews=_overviews(audit, key),
        friction=tuple(_friction(joint, fit, f"{key}-friction-{k}") for k, (joint, fit) in _numbered(result)),
        against=_against(audit, key),
        identified=() if result.identification is None else identification_tables(result.identification),
        recommended=tuple(rows.rule_row(joint, rule, result) for joint, rule in result.recommended.items()),
        study=study_section(audit.study),
        findings=tuple(
            FindingRow(finding, rows.finding_place(finding, result)) for finding in rows.worst_first(result.findings)
        ),
        gammas=tuple(
            (joint, f"{stated(gamma)} {torque_unit(result, joint)}") for joint, gamma in result.rule.gamma_nm.items()
        ),
    )


def _numbered(result: AuditResult) -> enumerate[tuple[str, FrictionFit]]:
    return enumerate(result.friction.items(), 1)


def _end(audit: Audit) -> float:
    return float(audit.signals.time_s[-1]) if len(audit.signals.time_s) else audit.result.log.duration_s


def _headline(result: AuditResult) -> tuple[tuple[str, str], ...]:
    time = joint_time(result)
    shares = [(word, NONE) for word in _TIME_WORDS]
    if time is not None and time.time_s > 0:
        parts = (time.detectable_s, time.hidden_s, time.not_judged_s)
        shares = [(word, percent(part / time.time_s)) for word, part in zip(_TIME_WORDS, parts, strict=True)]
    return (
        ("Contacts", counted(len(contacts_of(result)), result)),
        ("Near misses", counted(len(result.near_misses), result)),
        ("Joints watched", _watched(result)),
        *shares,
        ("Recorded", duration(result.coverage.recorded_s)),
    )


def _watched(result: AuditResult) -> str:
    """How many, and how many of them were left out in some phase."""
    joints = result.coverage.joints.values()
    parts = sum(joint.watched and "not-watched" in joint.not_judged_s for joint in joints)
    text = f"{sum(joint.watched for joint in joints)} of {len(joints)}"
    return f"{text}, {parts} of them not in every phase" if parts else text


def _bar(audit: Audit, joint: str) -> Bar:
    row = rows.coverage_row(joint, audit.result.coverage.joints[joint], audit.result)
    found = sensitivity_row(joint, audit.result)
    detectable = NONE if found is None else found.detectable
    if joint not in audit.signals.joint_names:
        return Bar(row, detectable, None)
    column = audit.signals.joint_names.index(joint)
    label = visible(
        f"{joint}: alarms above γ for {row.judged}, beyond friction for {row.standing}, detectable {detectable}"
    )
    return Bar(row, detectable, coverage_bar(audit.signals.state[:, column], label))


def _ticks(end_s: float) -> tuple[tuple[float, str], ...]:
    """(per cent of the width, label) of round times over the log."""
    if end_s <= 0:
        return ()
    times = [t for t in MaxNLocator(8, steps=[1, 2, 5, 10]).tick_values(0.0, end_s) if 0 <= t <= end_s]
    return tuple((round(100 * t / end_s, 3), f"{t:g}") for t in times)


def _phase(phase: str, start_s: float, end_s: float, end: float) -> tuple[str, float, float, str]:
    """Name, left and width in per cent, and words."""
    scale = 100 / end if end > 0 else 0.0
    left, right = (min(max(t, 0.0), end) * scale for t in (start_s, end_s))
    return phase, round(left, 3), round(right - left, 3), f"{phase}: {start_s:.3f} to {end_s:.3f} s"


def _events(audit: Audit, key: str, kind: str, limit: int) -> Events:
    result = audit.result
    events: Sequence[Collision | NearMiss] = (
        rows.in_time(result.collisions) if kind == "collision" else rows.in_time(result.near_misses)
    )
    chosen = select(events, limit)
    listed, plots = [], []
    for k, event in enumerate(events):
        row = rows.collision_row(event, result) if isinstance(event, Collision) else rows.near_miss_row(event, result)
        drawn = k in chosen.drawn and event.joint in audit.signals.joint_names
        anchor = f"{key}-{kind}-{k + 1}" if drawn else None
        listed.append(EventRow(row, anchor))
        if anchor is not None:
            plots.append(_event_plot(audit, event, row, anchor, f"{_EVENT_WORDS[kind]} {k + 1}, "))
    return Events(tuple(listed), tuple(plots), chosen.note)


def _event_plot(
    audit: Audit,
    event: Collision | NearMiss,
    row: rows.CollisionRow | rows.NearMissRow,
    anchor: str,
    title: str,
) -> Plot:
    unit = torque_unit(audit.result, event.joint)
    peak, gamma = against(event.peak_nm, event.gamma_nm)
    caption = f"peak {peak} {unit}, γ {gamma} {unit}, at {row.onset}"
    label = visible(f"{title}residual of {event.joint} over time: {caption}")
    svg, note = draw_event(audit.signals, audit.result.rule, event, unit, anchor, label)
    return Plot(anchor, title, event.joint, caption, svg, note)


def _overviews(audit: Audit, key: str) -> tuple[Plot, ...]:
    plots = []
    for k, joint in enumerate(audit.signals.joint_names, 1):
        unit = torque_unit(audit.result, joint)
        gamma = audit.result.rule.gamma_nm.get(joint)
        caption = "no threshold" if gamma is None else f"γ = {stated(gamma)} {unit}"
        anchor = f"{key}-residual-{k}"
        if not np.isfinite(audit.signals.residual_nm[:, k - 1]).any():
            plots.append(Plot(anchor, "", joint, "no residual could be computed", None, None))
            continue
        label = visible(f"Residual of {joint} over the whole log, {caption}")
        svg, note = draw_overview(audit.result, audit.signals, joint, unit, anchor, label)
        plots.append(Plot(anchor, "", joint, caption, svg, f"{note} {unit}" if note else None))
    return tuple(plots)


def _against(audit: Audit, key: str) -> tuple[Plot, ...]:
    plots = []
    for k, joint in enumerate(audit.signals.joint_names, 1):
        fit = audit.result.friction.get(joint)
        prismatic = fit is not None and speed_unit(fit) == "m/s"
        unit = torque_unit(audit.result, joint)
        anchor = f"{key}-against-{k}"
        label = visible(f"Residual of {joint} against its speed and its position, {unit}")
        svg = draw_against(audit.signals, joint, unit, prismatic, anchor, label)
        if svg is not None:
            plots.append(Plot(anchor, "", joint, "against speed (left) and position (right)", svg, None))
    return tuple(plots)


def _friction(joint: str, fit: FrictionFit, anchor: str) -> FrictionView:
    torque, speed = effort_unit(fit), speed_unit(fit)
    plot = None
    if fit.points:
        label = visible(f"Friction of {joint} against speed: {fit.n_points} points, {fit.model or 'no curve'}")
        plot = Plot(anchor, "", joint, "", draw_friction(fit, torque, speed, anchor, label), None)
    law = FrictionModel.of(fit)
    reach = fit.speed_range_rad_s
    return FrictionView(
        joint=joint,
        fit=fit,
        model=law_text(fit.model) if fit.model else "not fitted",
        plot=plot,
        parameters=tuple(rows.parameter_rows(fit)),
        known=tuple((k.name, significant(k.value), interval(*k.ci95), k.unit) for k in fit.known),
        speeds=f"{significant(reach[0])} to {significant(reach[1])} {speed}" if reach else rows.NONE,
        rmse=f"{significant(fit.rmse_nm)} {torque}" if fit.rmse_nm is not None else rows.NONE,
        hold=f"{significant(law.hold)} {torque}" if law is not None else rows.NONE,
        torque_unit=torque,
        speed_unit=speed,
        has_band=law is not None and fit.covariance is not None,
    )
