"""Every kind of contact has a word that readers know."""

from __future__ import annotations

from typing import get_args

from collaudit.core.data.detection_result import ContactKind
from collaudit.reports.sections.event_sections import KIND_WORDS


def test_kinds_are_told_in_words() -> None:
    assert tuple(KIND_WORDS) == get_args(ContactKind)
    assert KIND_WORDS["meant"] == "intended"
