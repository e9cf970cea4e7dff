"""The nights of every joint as a table."""

from __future__ import annotations

from collections.abc import Sequence

from collaudit.core.history.night_row import Change, JointNights
from collaudit.reports.sections.section import Section, section_of
from collaudit.reports.values.numbers import duration, significant, with_interval
from collaudit.reports.values.words import NONE


def nights_section(joints: Sequence[JointNights]) -> Section:
    """A row a joint: its nights, how many were tested, contacts, and whether level and friction changed.

    Args:
        joints: of the robots.
    """
    if not joints:
        return Section("Joints over nights", (), (), ("The store holds no joint.",))
    records = (
        {
            "robot": one.robot,
            "joint": one.joint,
            "nights tested": f"{sum(night.tested > 0 for night in one.nights)} of {len(one.nights)}",
            "judged": duration(sum(night.judged_s for night in one.nights)),
            "contacts": str(sum(night.contacts for night in one.nights)),
            "level, N·m": change_text(one.level, [night.level_nm for night in one.nights]),
            "friction, N·m": change_text(one.friction, [night.friction_nm for night in one.nights]),
            "γ, N·m": first_and_last([night.gamma_nm for night in one.nights]),
        }
        for one in joints
    )
    note = (
        "Level (mean residual away from events) and friction: before and since the night that divides them best, each "
        "with its 95 % interval; the logs of a night are replicates. γ: first and last night."
    )
    return section_of("Joints over nights", records, note)


def change_text(change: Change, values: Sequence[float | None]) -> str:
    """What became of a value: before and now with their intervals, or why that is not known.

    Args:
        change: over the nights.
        values: of the nights.
    """
    if change.before is None or change.now is None:
        words = {"not tested": "not tested in the last night", "too few": "too few nights to tell"}
        return f"{first_and_last(values)} ({words[change.state]})"
    before, now = (
        with_interval(value, (low, high) if low < high else None) for value, low, high in (change.before, change.now)
    )
    share = change.now[0] / change.before[0] - 1.0 if change.before[0] > 0.0 else None
    by = "" if share is None else f", {100.0 * share:+.0f} %"
    if change.state == "changed":
        return f"{before} → {now}{by}, since {change.since}"
    return f"no change shown: {before} → {now}{by}"


def first_and_last(values: Sequence[float | None]) -> str:
    """The first and the last known value; one where they are alike in words."""
    known = [significant(value) for value in values if value is not None]
    if not known:
        return NONE
    return known[0] if known[0] == known[-1] else f"{known[0]} → {known[-1]}"
