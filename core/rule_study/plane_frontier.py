"""The rules of a plane that are worth having: no other notices less torque at as few alarms."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from collaudit.core.data.rule_study_result import JointPlane, PlanePoint
from collaudit.core.rule_study.joint_plane import alarm_rates


def frontier(plane: JointPlane, longest_delay_s: float | None = None) -> tuple[PlanePoint, ...]:
    """Rules by rising number of alarms, each noticing less torque than those before it.

    Args:
        plane: of a joint whose sensitivity is known.
        longest_delay_s: rules that react later are left out.
    """
    best: float | None = None
    out: list[PlanePoint] = []
    for _, torque, g, c in sorted(_cells(plane, longest_delay_s)):
        if best is not None and torque >= best:
            continue
        best = torque
        out.append(point_of(plane, g, c))
    return tuple(out)


def point_of(plane: JointPlane, g: int, c: int) -> PlanePoint:
    """One cell of a plane."""

    alarms = plane.alarms[g][c]
    rate, upper = alarm_rates(np.array([alarms]), plane.clean_hours)
    known = plane.clean_hours > 0
    return PlanePoint(
        plane.gamma_nm[g],
        plane.n[c],
        alarms,
        float(rate[0]) if known else None,
        float(upper[0]) if known else None,
        plane.torque_nm[g][c],
        plane.delay_s[g][c],
    )


def _cells(plane: JointPlane, longest_delay_s: float | None) -> Iterator[tuple[int, float, int, int]]:
    """Alarms, torque and place of the cells whose sensitivity is known."""
    for g, row in enumerate(plane.torque_nm):
        for c, torque in enumerate(row):
            late = longest_delay_s is not None and (plane.delay_s[g][c] or float("inf")) > longest_delay_s
            if torque is not None and not late:
                yield plane.alarms[g][c], torque, g, c
