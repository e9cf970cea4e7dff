"""What is drawn of the study of a rule, beside its sections: planes over γ and n, and forces over space."""

from __future__ import annotations

from dataclasses import dataclass

from markupsafe import Markup

from collaudit.core.data.rule_study_result import RuleStudy
from collaudit.reports.plots.force_map_plot import force_map_plot
from collaudit.reports.plots.plane_map import plane_map
from collaudit.reports.sections.section import Section
from collaudit.reports.sections.study_sections import study_sections
from collaudit.reports.values.visible_text import visible

_LABEL = "Alarms and sensitivity of {} over γ and n"


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
    planes = tuple(
        (joint, plane_map(plane, study.period_s, visible(_LABEL.format(joint)), study.units.get(joint, "N·m")))
        for joint, plane in study.joints.items()
    )
    return StudyView(study_sections(study), planes, forces)
