"""Two audits side by side; and estimated contact forces beside limits that the user states: never a verdict."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

from msgspec import Meta

from collaudit.core.config.config_table import ConfigTable, Positive
from collaudit.core.data.audit_result import AuditResult, Verdict
from collaudit.core.data.detection_result import ContactForce
from collaudit.core.friction.law_candidates import parameter_symbol
from collaudit.reports.sections.event_sections import contact_section
from collaudit.reports.sections.section import Section
from collaudit.reports.values.comparison import Change, Comparison
from collaudit.reports.values.numbers import duration, significant, with_interval
from collaudit.reports.values.visible_text import visible
from collaudit.reports.values.words import NONE, nothing_judged, parameter_unit, verdict_word

_SAME = "nothing differs"
#: What stands beside every table of forces and limits.
CANNOT_BE_CONCLUDED = (
    "This is information and no assessment. A joint residual cannot tell which part of a body was touched, over what "
    "area and with what pressure, whether it was clamped, or how high the force was in the first milliseconds, which "
    "filter and persistence smooth away. Directions that the joints do not feel are not in the estimate. A force that "
    "reads below a limit is no evidence that the limit was kept: that takes a measurement of force and pressure."
)


def compared_sides(found: Comparison) -> list[tuple[str, Verdict, str, str, str]]:
    """Before and after: side, verdict and its words, log, and the force that would have been noticed."""
    sides = zip(("before", "after"), found.logs, found.verdicts, found.exclusions, found.noticed, strict=True)
    return [
        (
            side,
            verdict,
            verdict_word(verdict, excluded),
            visible(name),
            f"would have noticed {force}" if force else "",
        )
        for side, name, verdict, excluded, force in sides
    ]


def compared_notes(found: Comparison) -> list[str]:
    """What the two have in common, and what a run that was not judged means for the comparison."""
    notes = ["The same log, audited twice." if found.same_log else "Two different logs."]
    if "not_judged" in found.verdicts:
        notes.append("A run that was not judged may lack contacts that happened.")
    return notes


def compared_sections(found: Comparison) -> list[Section]:
    """Contacts, settings, friction, residual level, findings."""
    return [
        _contacts(found),
        _changes("Settings, inputs and versions", found.settings),
        _friction(found),
        _residual(found),
        _changes("Findings that only one has", found.findings),
    ]


def _contacts(found: Comparison) -> Section:
    lines = tuple(
        (c.change, f"{c.onset_s:.3f} s", duration(c.end_s - c.onset_s), ", ".join(c.joints), c.why)
        for c in found.contacts
    )
    count = {word: sum(c.change == word for c in found.contacts) for word in ("gained", "lost", "before", "after")}
    if found.kept is None:
        title = f"Contacts: {count['before']} before, {count['after']} after"
    else:
        title = f"Contacts: {found.kept} in both, {count['gained']} gained, {count['lost']} lost"
    return Section(title, ("change", "onset", "lasted", "joints", "note"), lines, () if lines else (_SAME,))


def _changes(title: str, changes: Sequence[Change]) -> Section:
    lines = tuple((change.what, change.before or NONE, change.after or NONE) for change in changes)
    return Section(title, ("what", "before", "after"), lines, () if lines else (_SAME,))


def _friction(found: Comparison) -> Section:
    differ = {True: "differs", False: "no difference shown", None: "no interval: not known"}
    lines = tuple(
        (
            change.joint,
            f"{parameter_symbol(change.parameter)}, {parameter_unit(change.parameter)}",
            NONE if change.before is None else with_interval(change.before, change.before_ci95),
            NONE if change.after is None else with_interval(change.after, change.after_ci95),
            differ[change.differs],
        )
        for change in found.friction
        if (change.before, change.before_ci95) != (change.after, change.after_ci95)
    )
    note = "differs: the 95 % intervals do not overlap. Intervals that overlap do not prove that friction is the same."
    head = ("joint", "parameter", "before [95 %]", "after [95 %]", "intervals")
    return Section("Friction", head, lines, (note if lines else _SAME,))


def _residual(found: Comparison) -> Section:
    lines = []
    for level in found.residual:
        before, after = level.before_nm, level.after_nm
        ratio = NONE if before is None or after is None or not before else f"× {significant(after / before)}"
        levels = (NONE if value is None else f"{significant(value)} {level.unit}" for value in (before, after))
        lines.append((level.joint, *levels, ratio, duration(level.before_s), duration(level.after_s)))
    head = ("joint", "before", "after", "ratio", "time before", "time after")
    note = "Mean of the residual's size, half a second and more away from alarms; a mean without an interval."
    return Section("Residual level", head, tuple(lines), (note,))


class BodyRegion(ConfigTable, frozen=True, kw_only=True):
    """A region of the body with the forces somebody allows there, N; None where the file states none."""

    name: str
    quasi_static_n: Positive | None = None
    transient_n: Positive | None = None

    def __post_init__(self) -> None:
        """A limit, at least."""
        if self.quasi_static_n is None and self.transient_n is None:
            raise ValueError("states no limit")


class BodyLimits(ConfigTable, frozen=True, kw_only=True):
    """Limits as the user's file states them, and where they are from."""

    source: Annotated[str, Meta(pattern=r"\S")]
    region: Annotated[tuple[BodyRegion, ...], Meta(min_length=1)]


def body_region_section(result: AuditResult, limits: BodyLimits) -> Section:
    """Every contact of a log beside every limit of the file: onset, joints, force, region, limit, and how they lie."""
    rows = []
    for contact, record in zip(result.contacts, contact_section(result).records, strict=True):
        shown = (record["onset"], record["joints"], record["force (95 %)"])
        for region in limits.region:
            for kind, limit in (("quasi-static", region.quasi_static_n), ("transient", region.transient_n)):
                if limit is not None:
                    rows.append((*shown, region.name, f"{limit:g} N {kind}", _against_limit(contact.force, limit)))
    head = ("onset", "joints", "estimated force (95 %)", "region", "limit", "force beside limit")
    none = "not judged" if nothing_judged(result) else "no contact was found in the time that was judged"
    return Section(result.log.name, head, tuple(rows), () if rows else (none,))


def _against_limit(force: ContactForce | None, limit_n: float) -> str:
    """How the interval of a force lies to a limit; without an interval nothing is said."""
    if force is None:
        return "force not determinable"
    low, high = force.size_ci95_n
    if low > limit_n:
        return "the whole interval is above"
    if force.blind:
        return "not determinable: some directions are not felt"
    return "the interval reaches above" if high > limit_n else "the interval is below"
