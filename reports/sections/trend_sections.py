"""The nights of every joint as a table."""

from __future__ import annotations

from collections.abc import Sequence

from collaudit.core.history.joint_nights import JointNights
from collaudit.reports.sections.section import Section
from collaudit.reports.values.numbers import duration, significant
from collaudit.reports.values.words import NONE


def nights_section(joints: Sequence[JointNights]) -> Section:
    """A row a joint: its nights, how many were tested, contacts, and first and last level, friction and threshold.

    Args:
        joints: of the robots.
    """
    rows = tuple(
        (
            one.robot,
            one.joint,
            f"{sum(night.tested > 0 for night in one.nights)} of {len(one.nights)}",
            duration(sum(night.judged_s for night in one.nights)),
            str(sum(night.contacts for night in one.nights)),
            first_and_last([night.level_nm for night in one.nights]),
            first_and_last([night.friction_nm for night in one.nights]),
            first_and_last([night.gamma_nm for night in one.nights]),
        )
        for one in joints
    )
    head = ("robot", "joint", "nights tested", "judged", "contacts", "level, N·m", "friction, N·m", "γ, N·m")
    note = "Level, friction and γ: first and last night that has one; level is the mean residual away from events."
    return Section("Joints over nights", head, rows, (note,) if rows else ("The store holds no joint.",))


def first_and_last(values: Sequence[float | None]) -> str:
    """The first and the last known value; one where they are alike in words."""
    known = [significant(value) for value in values if value is not None]
    if not known:
        return NONE
    return known[0] if known[0] == known[-1] else f"{known[0]} → {known[-1]}"
