"""Two audits side by side, and forces beside the user's limits, as pages that work offline."""

from __future__ import annotations

from collections.abc import Sequence

from collaudit.core.data.audit_result import AuditResult
from collaudit.reports.page.environment import environment
from collaudit.reports.sections.comparison_sections import (
    CANNOT_BE_CONCLUDED,
    BodyLimits,
    body_region_section,
    compared_notes,
    compared_sections,
    compared_sides,
)
from collaudit.reports.sections.section import Section
from collaudit.reports.values.comparison import Comparison
from collaudit.reports.values.words import verdict_word


def comparison_html(found: Comparison) -> str:
    """The page of a comparison; the same comparison gives the same bytes."""
    return _page("Two audits compared", compared_sides(found), compared_notes(found), compared_sections(found))


def body_regions_html(results: Sequence[AuditResult], limits: BodyLimits) -> str:
    """The page of estimated forces beside limits by body region, with what cannot be concluded."""
    sides = [("", r.verdict, verdict_word(r.verdict, r.exclusions), r.log.name, "") for r in results]
    notes = [f"Limits by body region, as stated by: {limits.source}", CANNOT_BE_CONCLUDED]
    found = [body_region_section(result, limits) for result in results]
    return _page("Estimated forces beside limits", sides, notes, found)


def _page(heading: str, sides: Sequence[object], notes: Sequence[str], sections: Sequence[Section]) -> str:
    template = environment().get_template("comparison.html.j2")
    return template.render(heading=heading, sides=sides, notes=notes, sections=sections)
