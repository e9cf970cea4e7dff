"""Two audits side by side: contacts, settings, friction, residual level, findings."""

from __future__ import annotations

from collections.abc import Sequence

from collaudit.core.data.audit_result import Verdict
from collaudit.core.friction.law_candidates import parameter_symbol
from collaudit.reports.sections.section import Section
from collaudit.reports.values.comparison import Change, Comparison
from collaudit.reports.values.numbers import duration, significant, with_interval
from collaudit.reports.values.visible_text import visible
from collaudit.reports.values.words import NONE, parameter_unit, verdict_word

_SAME = "nothing differs"


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
