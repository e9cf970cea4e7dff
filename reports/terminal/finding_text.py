"""Findings for a terminal: a line each, what several joints or several logs share said once."""

from __future__ import annotations

from collections.abc import Sequence

from collaudit.core.findings import Finding
from collaudit.reports.values.joint_lines import joint_lines
from collaudit.reports.values.visible_text import visible

_MOST_PLACES = 4


def finding_lines(findings: Sequence[Finding], brief: bool = False) -> list[tuple[str, str]]:
    """Severity and line of each finding, in the order of the first of its kind.

    Args:
        findings: of one log or of several; ``where`` then names the log.
        brief: as :func:`joint_lines` has it.
    """
    places: dict[tuple[str, str, str, str], list[str]] = {}
    for finding in findings:
        key = (finding.severity, finding.code, finding.text, finding.joint or "")
        places.setdefault(key, []).append(finding.where or "")
    kinds: dict[tuple[str, str, str], list[tuple[str, str]]] = {}
    for (severity, code, text, joint), found in places.items():
        kinds.setdefault((severity, code, _places(found)), []).append((joint, text))
    return [
        (severity, f"{code}: {visible(line)}{visible(place)}")
        for (severity, code, place), said in kinds.items()
        for line in _lines(said, brief)
    ]


def _lines(said: Sequence[tuple[str, str]], brief: bool) -> list[str]:
    """As they are where nothing can be joined: a finding's text names its joint itself."""
    joined = joint_lines(said, brief=brief)
    names_itself = {f"{joint}: {text}": text for joint, text in said if joint and joint in text}
    return [names_itself.get(line, line) for line in joined] if len(joined) < len(said) else [text for _, text in said]


def _places(found: Sequence[str]) -> str:
    named = list(dict.fromkeys(place for place in found if place))
    more = f" and {len(named) - _MOST_PLACES} more" if len(named) > _MOST_PLACES else ""
    return f" [{'; '.join(named[:_MOST_PLACES])}{more}]" if named else ""
