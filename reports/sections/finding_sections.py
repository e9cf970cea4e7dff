"""Findings: worst first, each kind once, what several joints or several logs share said once."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from collaudit.core.findings import Finding
from collaudit.reports.sections.section import Section, section_of
from collaudit.reports.values.visible_text import joint_lines, visible

_MOST_PLACES = 4
_MOST_NAMED = 3
_FIRST_WORDS = 14
_BRACKETS = re.compile(r" \([^()]*\)")
_CLAUSE = re.compile(r"([,:;]) ")
_ORDER = ("error", "warning", "info")
_MARKS = {"error": "✕ error", "warning": "△ warning", "info": "i info"}


def worst_first(findings: Iterable[Finding]) -> list[Finding]:
    """Findings by severity, then in the order they were made."""
    return sorted(findings, key=lambda finding: _ORDER.index(finding.severity))


def finding_section(title: str, findings: Sequence[Finding]) -> Section:
    """A row a kind: what is said, what to do about it, its code."""
    return section_of(
        title,
        (
            {
                "severity": _MARKS[found[0].severity],
                "finding": "\n".join(_lines(found, timed=True)),
                "what to do": found[0].kind.remedy,
                "code": found[0].code,
            }
            for found in _kinds(worst_first(findings)).values()
        ),
    )


def fact_lines(findings: Iterable[Finding]) -> tuple[str, ...]:
    """Facts, a line each; what is said alike of several joints once."""
    return tuple(_lines([finding for finding in findings if finding.is_fact], timed=True))


def finding_lines(findings: Iterable[Finding], brief: bool = False) -> list[tuple[str, str]]:
    """Severity and line of each finding, in the order of the first of its kind.

    Args:
        findings: of one log or of several; ``where`` then names the log.
        brief: as :func:`joint_lines` has it.
    """
    kinds = _kinds(findings).items()
    return [(severity, f"{code}: {line}") for (severity, code), found in kinds for line in _lines(found, brief)]


def short_finding_lines(findings: Iterable[Finding]) -> list[tuple[str, str]]:
    """Severity and one line a kind: an error as first said, a warning in its first words, and which joints it names."""
    lines = []
    for (severity, code), found in _kinds(worst_first(findings)).items():
        said = found[0].text if severity == "error" else _first_words(found[0].text)
        joints = dict.fromkeys(finding.joint for finding in found[1:] if finding.joint)
        others = [joint for joint in joints if joint not in said]
        named = ", ".join(others) if len(others) <= _MOST_NAMED else f"{len(others)} other joints"
        lines.append((severity, visible(f"{code}: {said}" + (f" Also {named}." if others else ""))))
    return lines


def _first_words(text: str) -> str:
    """The first sentence, without what stands in brackets; of a long one the clauses that fit."""
    while text != (text := _BRACKETS.sub("", text)):
        pass
    said, *clauses = _CLAUSE.split(text.partition(". ")[0].removesuffix("."))
    for end, clause in zip(clauses[::2], clauses[1::2], strict=True):
        if len(f"{said} {clause}".split()) > _FIRST_WORDS:
            return f"{said} …"
        said += f"{end} {clause}"
    return f"{said}."


def _kinds(findings: Iterable[Finding]) -> dict[tuple[str, str], list[Finding]]:
    kinds: dict[tuple[str, str], list[Finding]] = {}
    for finding in findings:
        kinds.setdefault((finding.severity, finding.code), []).append(finding)
    return kinds


def _lines(findings: Sequence[Finding], brief: bool = False, timed: bool = False) -> list[str]:
    """What is said by findings of one kind; with the time of each in the log where they are ``timed``."""
    places: dict[tuple[str, str, str], list[str]] = {}
    for finding in findings:
        when = _when(finding) if timed else ""
        places.setdefault((finding.text, finding.joint or "", when), []).append(finding.where or "")
    said: dict[str, list[tuple[str, str]]] = {}
    for (text, joint, when), found in places.items():
        said.setdefault(_places((*found, when)), []).append((joint, text))
    return [
        f"{visible(line)}{visible(place)}" for place, group in said.items() for line in joint_lines(group, brief=brief)
    ]


def _places(found: Sequence[str]) -> str:
    named = list(dict.fromkeys(place for place in found if place))
    more = f" and {len(named) - _MOST_PLACES} more" if len(named) > _MOST_PLACES else ""
    return f" [{'; '.join(named[:_MOST_PLACES])}{more}]" if named else ""


def _when(finding: Finding) -> str:
    if finding.start_s is None:
        return ""
    return f"at {finding.start_s:.3f} s" if finding.end_s is None else f"{finding.start_s:.3f} to {finding.end_s:.3f} s"
