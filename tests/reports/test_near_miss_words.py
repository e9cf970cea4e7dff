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
    "impulse": ("% of the impulse of γ", 1.2),
}


@pytest.mark.parametrize("kind", get_args(NearMissKind))
def test_every_kind_has_words_of_its_own(kind: NearMissKind) -> None:
    result = samples.failed().result
    words, ratio = WORDS[kind]
    near = replace(result.near_misses[0], kind=kind, ratio=ratio)
    (row,) = near_miss_section(replace(result, near_misses=(near,))).records
    assert row["kind"] == kind
    assert words in row["how close"]


def test_a_knock_is_no_share_of_the_persistence() -> None:
    """A knock may have more than the impulse of an alarm in fewer samples: it is never "6 of 5 samples"."""
    result = samples.failed().result
    near = replace(result.near_misses[0], kind="impulse", ratio=1.2)
    n = result.rule.n
    (row,) = near_miss_section(replace(result, near_misses=(near,))).records
    assert row["how close"] == f"120 % of the impulse of γ for {n} samples"
