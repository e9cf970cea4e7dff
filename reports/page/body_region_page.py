"""Forces beside the user's limits, as a page that works offline."""

from __future__ import annotations

from collections.abc import Sequence

from collaudit.core.data.audit_result import AuditResult
from collaudit.reports.page.environment import environment
from collaudit.reports.sections.body_region_sections import CANNOT_BE_CONCLUDED, BodyLimits, body_region_section
from collaudit.reports.values.words import verdict_word


def body_regions_html(results: Sequence[AuditResult], limits: BodyLimits) -> str:
    """The page of estimated forces beside limits by body region, with what cannot be concluded."""
    return (
        environment()
        .get_template("body_regions.html.j2")
        .render(
            logs=[(r.verdict, verdict_word(r.verdict, r.exclusions), r.log.name) for r in results],
            notes=(f"Limits by body region, as stated by: {limits.source}", CANNOT_BE_CONCLUDED),
            sections=[body_region_section(result, limits) for result in results],
        )
    )
