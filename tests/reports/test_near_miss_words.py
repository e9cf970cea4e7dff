"""How close a near miss came is said in what its kind is told by."""

from __future__ import annotations

from dataclasses import replace
from typing import get_args

import pytest
import samples

from collaudit.core.data.audit_result import NearMissKind
from collaudit.reports.sections.event_sections import near_miss_section

WORDS = {
    "amplitude": ("% of γ", 0.9),
    "persistence": ("samples above γ", 0.6),
}


@pytest.mark.parametrize("kind", get_args(NearMissKind))
def test_every_kind_has_words_of_its_own(kind: NearMissKind) -> None:
    result = samples.failed().result
    words, ratio = WORDS[kind]
    near = replace(result.near_misses[0], kind=kind, ratio=ratio)
    (row,) = near_miss_section(replace(result, near_misses=(near,))).records
    assert row["kind"] == kind
    assert words in row["how close"]
