"""Estimated contact forces beside limits that the user states: information, never a verdict."""

from __future__ import annotations

from dataclasses import dataclass

from collaudit.core.data.audit_result import AuditResult
from collaudit.core.data.detection_result import ContactForce
from collaudit.reports.values.contact_rows import contact_row, contacts_of

#: What stands beside every such table.
CANNOT_BE_CONCLUDED = (
    "This is information and no assessment. A joint residual cannot tell which part of a body was touched, over what "
    "area and with what pressure, whether it was clamped, or how high the force was in the first milliseconds, which "
    "filter and persistence smooth away. Directions that the joints do not feel are not in the estimate. A force that "
    "reads below a limit is no evidence that the limit was kept: that takes a measurement of force and pressure."
)


@dataclass(frozen=True, slots=True)
class BodyRegion:
    """A region of the body with the forces somebody allows there, N; None where the file states none."""

    name: str
    quasi_static_n: float | None
    transient_n: float | None


@dataclass(frozen=True, slots=True)
class BodyLimits:
    """Limits as the user's file states them, and where they are from."""

    source: str
    regions: tuple[BodyRegion, ...]


@dataclass(frozen=True, slots=True)
class BodyRegionRow:
    """One contact beside one limit, as text.

    Attributes:
        onset, joints, force: of the contact.
        region, limit: from the user's file.
        beside: how the force's interval lies to the limit.
    """

    onset: str
    joints: str
    force: str
    region: str
    limit: str
    beside: str


def body_region_rows(result: AuditResult, limits: BodyLimits) -> list[BodyRegionRow]:
    """Every contact beside every limit of the file."""
    made = []
    for contact in contacts_of(result):
        row = contact_row(contact, result)
        for region in limits.regions:
            for kind, limit in (("quasi-static", region.quasi_static_n), ("transient", region.transient_n)):
                if limit is not None:
                    beside = _beside(contact.force, limit)
                    made.append(
                        BodyRegionRow(row.onset, row.joints, row.force, region.name, f"{limit:g} N {kind}", beside)
                    )
    return made


def _beside(force: ContactForce | None, limit_n: float) -> str:
    """How the interval of a force lies to a limit; without an interval nothing is said."""
    if force is None:
        return "force not determinable"
    low, high = force.size_ci95_n
    if low > limit_n:
        return "the whole interval is above"
    if force.blind:
        return "not determinable: some directions are not felt"
    return "the interval reaches above" if high > limit_n else "the interval is below"
