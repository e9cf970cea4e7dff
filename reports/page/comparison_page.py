"""Two audits side by side, and forces beside the user's limits, as pages that work offline."""

from __future__ import annotations

from collections.abc import Sequence

from collaudit.core.data.audit_result import AuditResult
from collaudit.reports.page.environment import environment
from collaudit.reports.values.body_regions import CANNOT_BE_CONCLUDED, BodyLimits, body_region_rows
from collaudit.reports.values.comparison import Comparison
from collaudit.reports.values.comparison_tables import ComparedTable, compared_notes, compared_sides, compared_tables
from collaudit.reports.values.words import nothing_judged, verdict_word


def comparison_html(found: Comparison) -> str:
    """The page of a comparison; the same comparison gives the same bytes."""
    sides = [(side, kind, *rest) for (side, *rest), kind in zip(compared_sides(found), found.verdicts, strict=True)]
    heading = "Two audits compared"
    return _page(heading, sides, compared_notes(found), compared_tables(found))


def body_regions_html(results: Sequence[AuditResult], limits: BodyLimits) -> str:
    """The page of estimated forces beside limits by body region, with what cannot be concluded."""
    head = ("onset", "joints", "estimated force (95 %)", "region", "limit", "force beside limit")
    tables = []
    for result in results:
        lines = tuple(
            (r.onset, r.joints, r.force, r.region, r.limit, r.beside) for r in body_region_rows(result, limits)
        )
        none = "not judged" if nothing_judged(result) else "no contact was found in the time that was judged"
        tables.append(ComparedTable(result.log.name, head, lines, (0,), "" if lines else none))
    sides = [("", r.verdict, verdict_word(r.verdict, r.exclusions), r.log.name, "") for r in results]
    notes = [f"Limits by body region, as stated by: {limits.source}", CANNOT_BE_CONCLUDED]
    return _page("Estimated forces beside limits", sides, notes, tables)


def _page(heading: str, sides: Sequence[object], notes: Sequence[str], tables: Sequence[ComparedTable]) -> str:
    template = environment().get_template("comparison.html.j2")
    return template.render(heading=heading, sides=sides, notes=notes, tables=tables)
