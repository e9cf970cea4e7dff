"""Which efforts are inverted: two lines to choose from where some joints do not show their sign, else one."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from collaudit.cli.drafts import draft_evidence
from collaudit.cli.drafts.config_text import Section
from collaudit.core.findings import Finding
from collaudit.core.prepare.effort_gain import EffortGain

JOINTS = ("pan", "lift", "elbow")


def offered(gains: dict[str, float], found: tuple[str, ...], upright: tuple[str, ...] = ()) -> list[Any]:
    """Lines of effort_sign behind #, for joints with these gains, of which some were found inverted."""
    prepared = SimpleNamespace(
        judged=JOINTS,
        gains=tuple(EffortGain(joint, gain, (gain - 0.1, gain + 0.1), 0.9) for joint, gain in gains.items()),
        findings=tuple(Finding("effort-sign-inverted", "error", "", joint=joint) for joint in found),
        sign_delay=None,
        upright=frozenset(upright),
    )
    section = Section("log.units")
    draft_evidence._add_sign_choice(section, prepared)  # type: ignore[arg-type]
    assert bool(section.remarks) == bool(section.lines)
    return [(line.value, line.active) for line in section.lines]


def test_all_joints_alike_are_offered_where_one_is_silent() -> None:
    every = dict.fromkeys(JOINTS, -1)
    assert offered({"lift": -1.5, "elbow": -1.7}, ("lift", "elbow")) == [(every, False)]


def test_no_sign_is_offered_where_the_mounting_is_asked_for() -> None:
    assert offered({"lift": -1.5, "elbow": -1.7}, ("lift", "elbow"), upright=("lift", "elbow")) == []


@pytest.mark.parametrize(
    ("gains", "found"),
    [
        ({"lift": -1.5, "elbow": 1.2}, ("lift",)),
        ({"lift": -1.5}, ("lift",)),
        ({"lift": -1.5, "elbow": -1.7}, JOINTS),
        ({"lift": 1.5, "elbow": 1.7}, ()),
    ],
)
def test_nothing_more_is_offered_where_joints_differ_or_all_are_shown(gains: Any, found: Any) -> None:
    assert offered(gains, found) == []
