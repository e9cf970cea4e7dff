"""What is drawn of the study of a rule, beside its sections: planes over γ and n, and forces over space."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from markupsafe import Markup

from collaudit.core.data.rule_study_result import JointPlane, RuleStudy
from collaudit.core.rule_study.joint_plane import pooled_planes
from collaudit.reports.plots.force_map_plot import force_map_plot
from collaudit.reports.plots.plane_map import plane_map
from collaudit.reports.sections.section import Section
from collaudit.reports.sections.study_sections import plane_section, study_sections
from collaudit.reports.values.visible_text import visible

#: Sample periods that differ by more than this share have other persistences at the same n.
_LIKE = 0.01


@dataclass(frozen=True, slots=True)
class StudyView:
    """Sections, drawings of planes by joint, and the map of the smallest noticeable force, empty without one."""

    sections: tuple[Section, ...]
    planes: tuple[tuple[str, Markup], ...]
    forces: Markup | None = None


def study_view(study: RuleStudy | None) -> StudyView | None:
    """What the page shows of a study; None where none was made."""
    if study is None:
        return None
    forces = None
    if study.force_map is not None:
        forces = force_map_plot(study.force_map, "Smallest force noticed at the tool, over space")
    return StudyView(study_sections(study), _drawn(study.joints, study.period_s, study.units, ""), forces)


def shared_planes(studies: Sequence[RuleStudy | None]) -> StudyView | None:
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
    title = f"Threshold and persistence of each joint, over {len(known)} logs together"
    return StudyView((plane_section(title, found, units),), _drawn(found, known[0].period_s, units, ", all logs"))


def _drawn(
    planes: Mapping[str, JointPlane], period_s: float, units: Mapping[str, str], of: str
) -> tuple[tuple[str, Markup], ...]:
    labels = {joint: visible(f"Alarms and sensitivity of {joint} over γ and n{of}") for joint in planes}
    return tuple(
        (joint, plane_map(plane, period_s, labels[joint], units.get(joint, "N·m"))) for joint, plane in planes.items()
    )
