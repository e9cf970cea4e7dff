"""Two audits side by side as tables of text, for terminal and page alike."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from collaudit.core.friction.law_candidates import parameter_symbol
from collaudit.reports.values.comparison import Bounds, Change, Comparison
from collaudit.reports.values.numbers import duration, interval, significant
from collaudit.reports.values.rows import NONE
from collaudit.reports.values.visible_text import visible
from collaudit.reports.values.words import parameter_unit, verdict_word, with_force_unit

_SAME = "nothing differs"


@dataclass(frozen=True, slots=True)
class ComparedTable:
    """One table of a comparison.

    Attributes:
        title: what it compares.
        head, rows: its cells; no rows where nothing differs.
        numeric: numbers of the columns that hold numbers.
        note: what to know of it; in place of rows where there are none.
    """

    title: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    numeric: tuple[int, ...] = ()
    note: str = ""


def compared_sides(found: Comparison) -> list[tuple[str, str, str, str]]:
    """Before and after: side, verdict, log, and the force that would have been noticed."""
    sides = zip(("before", "after"), found.logs, found.verdicts, found.exclusions, found.noticed, strict=True)
    return [
        (
            side,
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


def compared_tables(found: Comparison) -> list[ComparedTable]:
    """Contacts, settings, friction, residual level, findings."""
    return [
        _contacts(found),
        _changes("Settings, inputs and versions", found.settings),
        _friction(found),
        _residual(found),
        _changes("Findings that only one has", found.findings),
    ]


def _contacts(found: Comparison) -> ComparedTable:
    lines = tuple(
        (c.change, f"{c.onset_s:.3f} s", duration(c.end_s - c.onset_s), ", ".join(c.joints), c.why)
        for c in found.contacts
    )
    count = {word: sum(c.change == word for c in found.contacts) for word in ("gained", "lost", "before", "after")}
    if found.kept is None:
        title = f"Contacts: {count['before']} before, {count['after']} after"
    else:
        title = f"Contacts: {found.kept} in both, {count['gained']} gained, {count['lost']} lost"
    return ComparedTable(title, ("", "onset", "lasted", "joints", "note"), lines, (1, 2))


def _changes(title: str, changes: Sequence[Change]) -> ComparedTable:
    lines = tuple((change.what, change.before or NONE, change.after or NONE) for change in changes)
    return ComparedTable(title, ("", "before", "after"), lines, note="" if lines else _SAME)


def _friction(found: Comparison) -> ComparedTable:
    differ = {True: "differs", False: "no difference shown", None: "no interval: not known"}
    lines = tuple(
        (
            change.joint,
            f"{parameter_symbol(change.parameter)}, {parameter_unit(change.parameter)}",
            _value(change.before, change.before_ci95),
            _value(change.after, change.after_ci95),
            differ[change.differs],
        )
        for change in found.friction
        if (change.before, change.before_ci95) != (change.after, change.after_ci95)
    )
    note = "differs: the 95 % intervals do not overlap. Intervals that overlap do not prove that friction is the same."
    head = ("joint", "parameter", "before [95 %]", "after [95 %]", "intervals")
    return ComparedTable("Friction", head, lines, note=note if lines else _SAME)


def _value(value: float | None, bounds: Bounds | None) -> str:
    if value is None:
        return NONE
    return significant(value) if bounds is None else f"{significant(value)} [{interval(*bounds)}]"


def _residual(found: Comparison) -> ComparedTable:
    lines = []
    for level in found.residual:
        before, after = level.before_nm, level.after_nm
        ratio = NONE if before is None or after is None or not before else f"× {significant(after / before)}"
        clean = (duration(level.before_s), duration(level.after_s))
        units = {level.joint: level.unit}
        cells = (NONE if v is None else with_force_unit(significant(v), level.joint, units) for v in (before, after))
        lines.append((level.joint, *cells, ratio, *clean))
    head = ("joint", "before, N·m", "after, N·m", "ratio", "time before", "time after")
    note = "Mean of the residual's size, half a second and more away from alarms; a mean without an interval."
    return ComparedTable("Residual level", head, tuple(lines), (1, 2, 3, 4, 5), note)
