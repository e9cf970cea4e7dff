"""Two audits side by side, for a terminal."""

from __future__ import annotations

from collections.abc import Sequence

from collaudit.core.friction.parameter_units import parameter_symbol
from collaudit.reports.terminal.text_table import table, wrapped
from collaudit.reports.values.comparison import Bounds, Change, Comparison
from collaudit.reports.values.numbers import duration, interval, percent, significant
from collaudit.reports.values.rows import NONE
from collaudit.reports.values.visible_text import visible
from collaudit.reports.values.words import parameter_unit, verdict_word

_SAME = "nothing differs"


def comparison_text(found: Comparison, width: int | None = None) -> str:
    """Verdicts, contacts, settings, friction, residual level, findings.

    Args:
        found: the comparison.
        width: columns of the terminal that tables are cut to; None: any.
    """
    parts = [_head(found), _contacts(found, width), _changes("Settings, inputs and versions", found.settings, width)]
    parts += [_friction(found, width), _residual(found, width)]
    parts.append(_changes("Findings that only one has", found.findings, width))
    return "\n".join(parts)


def _head(found: Comparison) -> str:
    lines = []
    sides = zip(("before", "after"), found.logs, found.verdicts, found.exclusions, found.detectable, strict=True)
    for side, name, verdict, excluded, share in sides:
        lines.append(f"{side + ':':<8}{verdict_word(verdict, excluded)}  {visible(name)}\n")
        if share is not None:
            lines.append(
                f"{'':8}detectable in {percent(share)} of the joints' time: a contact of the size it asks for\n"
            )
    same = "The same log, audited twice.\n" if found.same_log else "Two different logs.\n"
    if "not_judged" in found.verdicts:
        same += "A run that was not judged may lack contacts that happened.\n"
    return "".join([*lines, same])


def _contacts(found: Comparison, width: int | None) -> str:
    lines = [
        (c.change, f"{c.onset_s:.3f} s", duration(c.end_s - c.onset_s), ", ".join(c.joints), c.why)
        for c in found.contacts
    ]
    count = {word: sum(c.change == word for c in found.contacts) for word in ("gained", "lost", "before", "after")}
    if found.kept is None:
        title = f"Contacts: {count['before']} before, {count['after']} after"
    else:
        title = f"Contacts: {found.kept} in both, {count['gained']} gained, {count['lost']} lost"
    return f"{title}\n" + (table(("", "onset", "lasted", "joints", "note"), lines, (1, 2), width) if lines else "")


def _changes(title: str, changes: Sequence[Change], width: int | None) -> str:
    if not changes:
        return f"{title}: {_SAME}\n"
    lines = [(change.what, change.before or NONE, change.after or NONE) for change in changes]
    return f"{title}\n{table(('', 'before', 'after'), lines, width=width)}"


def _friction(found: Comparison, width: int | None) -> str:
    differ = {True: "differs", False: "no difference shown", None: "no interval: not known"}
    lines = [
        (
            change.joint,
            f"{parameter_symbol(change.parameter)}, {parameter_unit(change.parameter)}",
            _value(change.before, change.before_ci95),
            _value(change.after, change.after_ci95),
            differ[change.differs],
        )
        for change in found.friction
        if (change.before, change.before_ci95) != (change.after, change.after_ci95)
    ]
    if not lines:
        return f"Friction: {_SAME}\n"
    head = ("joint", "parameter", "before [95 %]", "after [95 %]", "intervals")
    note = "differs: the 95 % intervals do not overlap. Intervals that overlap do not prove that friction is the same."
    return f"Friction\n{table(head, lines, width=width)}{wrapped(note, width)}\n"


def _value(value: float | None, bounds: Bounds | None) -> str:
    if value is None:
        return NONE
    return significant(value) if bounds is None else f"{significant(value)} [{interval(*bounds)}]"


def _residual(found: Comparison, width: int | None) -> str:
    lines = []
    for level in found.residual:
        before, after = level.before_nm, level.after_nm
        ratio = NONE if before is None or after is None or not before else f"× {significant(after / before)}"
        clean = (duration(level.before_s), duration(level.after_s))
        lines.append((level.joint, *(NONE if v is None else significant(v) for v in (before, after)), ratio, *clean))
    head = ("joint", "before, N·m", "after, N·m", "ratio", "time before", "time after")
    note = "Mean of the residual's size, half a second and more away from alarms; a mean without an interval."
    return f"Residual level\n{table(head, lines, range(1, 6), width)}{wrapped(note, width)}\n"
