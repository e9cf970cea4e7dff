"""A rule study for a terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from collaudit.core.data.recommendation_result import SetRule
from collaudit.core.data.rule_study_result import JointPlane, PersistenceChoice, RuleStudy
from collaudit.reports.terminal.text_table import table, wrapped
from collaudit.reports.values.set_rule_rows import SET_RULE_HEAD, set_rule_rows
from collaudit.reports.values.study_rows import (
    blind_rows,
    choice_rows,
    chosen_flags,
    dynamic_rows,
    labelled_rows,
    noticed_rows,
    part_rows,
    plane_rows,
)
from collaudit.reports.values.visible_text import visible


def study_text(study: RuleStudy, width: int | None = None, detail: bool = False, answer: bool = True) -> str:
    """What the rule notices, which persistence would notice more, and what thresholds are made of.

    Args:
        study: of one log.
        width: columns of the terminal that tables fit; None: any.
        detail: by place and motion as well, and the planes' points.
        answer: with the persistence that this log alone recommends, and its opinion on the rule that is set; False
            where a recommendation gives both.
    """
    parts: list[str] = []
    head: tuple[str, ...]
    rows = noticed_rows(study, places=detail, motions=detail)
    if rows:
        head = ("rule", "contact", "where", "number", "half noticed at N", "90 % at N", "never", "delay ms")
        lines = [(r.rule, r.shape, r.where, r.contacts, r.half, r.most, r.blind, r.delay) for r in rows]
        parts.append(_titled("Contacts added to this log: force that is noticed (95 %)", head, lines, width, 3))
    if answer:
        parts += _answer(study, width)
    known = list(labelled_rows(study))
    if study.labelled is not None and known:
        head = ("thresholds times", "known", *(f"push {force} N" for force in study.labelled.injected))
        title = f"Missed of {study.labelled.contacts} known contacts (95 %), and of pushes added to the same log"
        parts.append(_titled(title, head, known, width, 0))
    made_of = list(part_rows(study))
    if made_of:
        levels = (
            (joint, level if level.endswith(" N") else f"{level} N·m", causes) for joint, level, causes in made_of
        )
        lines_of = [wrapped(f"{joint} {level}: {causes}", width, "    ") for joint, level, causes in levels]
        title = "What thresholds are made of: by how much the level falls without each cause (causes overlap), N·m"
        parts.append("\n".join([wrapped(title, width, "  "), *(f"  {line}" for line in lines_of)]) + "\n")
    if detail:
        parts.append(_points("Each joint alone", study.joints, study.units, width))
        parts.append(_titled("A dynamic threshold would be", ("joint", ""), list(dynamic_rows(study)), width, 2))
    sentences = [f"{place}: {text}." for place, text in blind_rows(study)]
    for group in (sentences, study.assumptions):
        if group:
            parts.append("".join(wrapped(text, width, "  ") + "\n" for text in group))
    return "\n".join(parts)


def planes_text(planes: Mapping[str, JointPlane], units: Mapping[str, str], width: int | None = None) -> str:
    """The configured rule of each joint over several logs; empty where they have none in common."""
    if not any(plane.configured for plane in planes.values()):
        return ""
    return "\n" + _points("Configured rule of each joint, over all logs", planes, units, width)


def _points(title: str, planes: Mapping[str, JointPlane], units: Mapping[str, str], width: int | None) -> str:
    head = ("joint", "rule", "gamma N·m", "n", "alarms", "push noticed N·m", "delay ms")
    points = [(p.joint, p.rule, p.gamma, p.n, p.alarms, p.torque, p.delay) for p in plane_rows(planes, units)]
    return _titled(title, head, points, width, 2)


def persistence_text(choices: Sequence[PersistenceChoice], width: int | None = None) -> str:
    """The persistences that were compared, as a table with its title; empty without any."""
    if not choices:
        return ""
    head = ("n", "ms", *choices[0].force_n, "relative", "")
    title = "Persistence: force of which half is noticed, N, at the threshold that the evidence supports"
    return _titled(title, head, list(choice_rows(choices)), width, 0, words=1)


def set_rule_text(set_rules: Mapping[str, SetRule], units: Mapping[str, str], width: int | None = None) -> str:
    """The verdict on the thresholds that are set, as a table with its title; empty without any."""
    if not set_rules:
        return ""
    if all(rule.opinion == "not judged" for rule in set_rules.values()):
        return wrapped("Verdict on what is set: not judged, as the evidence supports no threshold.", width, "  ") + "\n"
    title = "Verdict on what is set (false alarms as they follow from the largest peaks, rarer than the hours show)"
    return _titled(title, SET_RULE_HEAD, list(set_rule_rows(set_rules, units)), width, 1, words=2)


def _answer(study: RuleStudy, width: int | None) -> list[str]:
    """What this log alone recommends, and its opinion on the rule that is set."""
    opinions = set_rule_text(study.set_rules, study.units, width)
    out = [text for text in (persistence_text(study.choices, width), opinions) if text]
    flags = chosen_flags(study)
    if flags is not None:
        # Flags are to be copied: they stay on one line.
        out.append(f"Recommended persistence with its thresholds, from this log alone:\n  {visible(flags)}\n")
    return out


def _titled(
    title: str,
    head: tuple[str, ...],
    lines: Sequence[tuple[str, ...]],
    width: int | None,
    first_number: int,
    words: int = 0,
) -> str:
    """A table with its title; columns from ``first_number`` on are numbers, but for the last ``words``."""
    numbers = range(first_number, len(head) - words)
    return f"{wrapped(title, width, '  ')}\n{table(head, lines, numbers, width, fold=True)}"
