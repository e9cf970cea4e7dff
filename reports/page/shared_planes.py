"""The (gamma, n) planes of several logs as one, on the page of these logs: heat maps, frontier, the configured rule."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from markupsafe import Markup

from collaudit.core.data.rule_study_result import RuleStudy
from collaudit.core.rule_study.joint_plane import pooled_planes
from collaudit.reports.plots.plane_map import plane_map
from collaudit.reports.values.study_rows import PlaneRow, plane_rows
from collaudit.reports.values.visible_text import visible

#: Sample periods that differ by more than this share have other persistences at the same n.
_LIKE = 0.01


@dataclass(frozen=True, slots=True)
class SharedPlanes:
    """What the template shows.

    Attributes:
        logs: number of logs that were studied.
        planes: joint and drawing.
        points: rows of the table of rules.
    """

    logs: int
    planes: tuple[tuple[str, Markup], ...]
    points: tuple[PlaneRow, ...]


def shared_planes(studies: Sequence[RuleStudy | None]) -> SharedPlanes | None:
    """The planes of logs of one arm together; None with less than two studies, or where no grids are shared.

    Args:
        studies: of the logs, None where none was made.
    """
    known = [study for study in studies if study is not None]
    if len(known) < 2 or max(s.period_s for s in known) > (1.0 + _LIKE) * min(s.period_s for s in known):
        return None
    found = pooled_planes(known)
    if not found:
        return None
    units = {joint: unit for study in known for joint, unit in study.units.items()}
    labels = {joint: visible(f"Alarms and sensitivity of {joint} over γ and n, all logs") for joint in found}
    drawn = tuple(
        (joint, plane_map(plane, known[0].period_s, labels[joint], units.get(joint, "N·m")))
        for joint, plane in found.items()
    )
    return SharedPlanes(len(known), drawn, tuple(plane_rows(found, units)))
