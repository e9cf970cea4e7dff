"""One joint's friction: a small curve, and what stands beside it."""

from __future__ import annotations

from dataclasses import dataclass

from markupsafe import Markup

from collaudit.core.data.audit_result import AuditResult
from collaudit.core.data.friction_result import FrictionFit
from collaudit.core.friction.friction_model import FrictionModel
from collaudit.reports.plots.plot_friction import draw_friction
from collaudit.reports.sections.fit_sections import friction_sections
from collaudit.reports.sections.section import Section
from collaudit.reports.values.numbers import significant
from collaudit.reports.values.visible_text import visible
from collaudit.reports.values.words import effort_unit, speed_unit


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
