"""The section on the rule of one log: its planes, what it notices, what its thresholds are made of."""

from __future__ import annotations

from dataclasses import dataclass

from markupsafe import Markup

from collaudit.core.data.rule_study_result import RuleStudy
from collaudit.reports.plots.force_map_plot import force_map_plot
from collaudit.reports.plots.plane_map import plane_map
from collaudit.reports.values.set_rule_rows import SET_RULE_HEAD, set_rule_rows
from collaudit.reports.values.study_rows import (
    NoticedRow,
    PlaceTable,
    PlaneRow,
    blind_rows,
    choice_rows,
    dynamic_rows,
    labelled_rows,
    noticed_rows,
    part_rows,
    place_tables,
    plane_rows,
)
from collaudit.reports.values.visible_text import visible


@dataclass(frozen=True, slots=True)
class StudySection:
    """What the template shows.

    Attributes:
        shapes: names of the contact shapes.
        planes: joint and drawing.
        points, noticed, choices, parts, dynamic, blind: rows of tables.
        places: what each rule notices by place and motion.
        forces: of the pushes beside known contacts, N; empty where none are known.
        known: number of known contacts.
        labelled: rows of their table.
        assumptions: what the numbers rest on.
        forces_drawn: the map of the smallest noticeable force; empty without one.
        set_rules: rows of the verdict on what is set, under ``set_head``.
    """

    shapes: tuple[str, ...]
    planes: tuple[tuple[str, Markup], ...]
    points: tuple[PlaneRow, ...]
    noticed: tuple[NoticedRow, ...]
    places: tuple[PlaceTable, ...]
    choices: tuple[tuple[str, ...], ...]
    parts: tuple[tuple[str, ...], ...]
    dynamic: tuple[tuple[str, str], ...]
    blind: tuple[tuple[str, str], ...]
    forces: tuple[str, ...]
    known: int
    labelled: tuple[tuple[str, ...], ...]
    assumptions: tuple[str, ...]
    forces_drawn: Markup
    set_rules: tuple[tuple[str, ...], ...]
    set_head: tuple[str, ...] = SET_RULE_HEAD


def study_section(study: RuleStudy | None) -> StudySection | None:
    """The section of a study; None where none was made."""
    if study is None:
        return None
    return StudySection(
        shapes=tuple(study.choices[0].force_n) if study.choices else (),
        planes=tuple(
            (
                joint,
                plane_map(
                    plane,
                    study.period_s,
                    visible(f"Alarms and sensitivity of {joint} over γ and n"),
                    study.units.get(joint, "N·m"),
                ),
            )
            for joint, plane in study.joints.items()
        ),
        points=tuple(plane_rows(study.joints, study.units)),
        noticed=tuple(noticed_rows(study)),
        places=tuple(place_tables(study)),
        choices=tuple(choice_rows(study.choices)),
        parts=tuple(part_rows(study)),
        dynamic=tuple(dynamic_rows(study)),
        blind=tuple(blind_rows(study)),
        forces=() if study.labelled is None else tuple(study.labelled.injected),
        known=0 if study.labelled is None else study.labelled.contacts,
        labelled=tuple(labelled_rows(study)),
        assumptions=study.assumptions,
        forces_drawn=Markup()
        if study.force_map is None
        else force_map_plot(study.force_map, "Smallest force noticed at the tool, over space"),
        set_rules=tuple(set_rule_rows(study.set_rules, study.units)),
    )
