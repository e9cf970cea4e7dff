"""How close a near miss came is said in what its kind is told by; an alarm by peak, times gamma in force, and delay."""

from __future__ import annotations

from dataclasses import replace
from typing import get_args

import pytest
import samples

from collaudit.core.data.audit_result import NearMissKind
from collaudit.reports.sections.event_sections import contact_section, near_miss_section

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


def test_an_alarm_says_its_peak_how_many_times_gamma_in_force_that_is_and_its_delay() -> None:
    result = samples.failed().result
    first = result.collisions[0]
    one = replace(first, peak_nm=12.0, gamma_nm=4.0, onset_s=first.onset_s, detected_s=first.onset_s + 0.034)
    (row, *_) = contact_section(replace(result, collisions=(one,)), {1: result.contacts[0]}).records
    assert f"{one.joint} 12" in row["alarms"]
    assert "(× 3.00 γ), alarm after 34 ms" in row["alarms"]
