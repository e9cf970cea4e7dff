"""How each joint's residual level moves from log to log."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from collaudit.reports.plots.svg import Panel, drawing
from collaudit.reports.values.entries import IndexEntry
from collaudit.reports.values.numbers import significant
from collaudit.reports.values.visible_text import visible

_WIDTH, _HEIGHT = 220, 40
_MOST_JOINTS = 40
_LEAST_LOGS = 2


@dataclass(frozen=True, slots=True)
class JointTrend:
    """One joint: its level in logs by recording date, first and last level and their range as text."""

    joint: str
    svg: Markup
    first: str
    last: str
    span: str
    logs: int


def joint_trends(entries: Sequence[IndexEntry]) -> tuple[JointTrend, ...]:
    """RMS of the judged residual over the logs that tell when they were recorded, by joint.

    Joints with fewer than two such logs have no trend; the first forty are shown.
    """
    dated = sorted((e for e in entries if e.start is not None), key=lambda e: (e.start or "", e.name))
    joints = list(dict.fromkeys(joint for entry in dated for joint in entry.level_nm))
    made = (_trend(joint, k, dated) for k, joint in enumerate(joints))
    return tuple(trend for trend in made if trend is not None)[:_MOST_JOINTS]


def _trend(joint: str, number: int, dated: Sequence[IndexEntry]) -> JointTrend | None:
    found = [level for entry in dated if (level := entry.level_nm.get(joint)) is not None]
    unit = next((entry.units[joint] for entry in dated if joint in entry.units), "N·m")
    if len(found) < _LEAST_LOGS:
        return None
    levels = np.array(found)
    panel = Panel(
        (2, 3, _WIDTH - 4, _HEIGHT - 6), (0.0, float(len(levels) - 1)), (0.0, 1.1 * float(levels.max()) or 1.0)
    )
    panel.line(np.arange(float(len(levels))), levels, "curve")
    label = visible(f"RMS of the residual of {joint} in {len(levels)} logs by recording date")
    return JointTrend(
        joint,
        drawing(_WIDTH, _HEIGHT, label, [panel], f"trend-{number}"),
        f"{significant(found[0])} {unit}",
        f"{significant(found[-1])} {unit}",
        f"{significant(min(found))} to {significant(max(found))} {unit}",
        len(found),
    )
