"""Shares, intervals, and the choice of a persistence, on contacts whose needs are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from collaudit.core.data.rule_study_result import STUDY_SCHEMA, RuleStudy
from collaudit.core.rule_study.arm_contacts import AddedContacts, noticed_share, wilson_interval
from collaudit.core.rule_study.injected_contacts import ContactShape, InjectedContact, random_direction
from collaudit.core.rule_study.persistence_choice import compared_persistences
from collaudit.core.rule_study.shown_torque import Windows
from collaudit.reports.sections.study_sections import chosen_flags
from collaudit.reports.terminal.study_text import study_text


def test_wilson_interval() -> None:
    assert wilson_interval(0, 20) == pytest.approx((0.0, 0.16113), abs=1e-4)
    assert wilson_interval(10, 20) == pytest.approx((0.29930, 0.70070), abs=1e-4)


@pytest.mark.parametrize("share", [0.5, 0.9])
def test_intervals_of_noticed_forces_hold_as_often_as_they_say(share: float) -> None:
    rng = np.random.default_rng(4)
    truth = float(np.exp(np.quantile(np.random.default_rng(5).normal(size=400_000), share)))
    held = 0
    for _ in range(400):
        found = noticed_share(np.sort(np.exp(rng.normal(size=120))), share)
        low, high = found.ci95_n
        held += (low is None or low <= truth) and (high is None or truth <= high)
    assert 0.94 <= held / 400 <= 1.0


def test_contacts_that_no_force_makes_alarm_leave_a_share_unnoticed() -> None:
    needed = np.array([5.0, 8.0, 20.0, np.inf])
    assert noticed_share(needed, 0.5).force_n == 8.0
    assert noticed_share(needed, 0.95).force_n is None


def test_directions_are_even() -> None:
    rng = np.random.default_rng(1)
    found = np.array([random_direction(rng) for _ in range(4000)])
    assert np.allclose(np.linalg.norm(found, axis=1), 1.0)
    assert np.all(np.abs(found.mean(axis=0)) < 0.03)
    assert np.allclose((found**2).mean(axis=0), 1.0 / 3.0, atol=0.02)


def contacts(name: str, samples: int) -> AddedContacts:
    """Thirty contacts of one joint that last so many samples, without noise, a newton metre a newton."""
    shape = (1, 30, 400)
    zero = [np.zeros(shape) for _ in range(4)]
    unit = np.zeros(shape)
    unit[..., 100 : 100 + samples] = 1.0
    around = Windows(*zero, np.ones(shape, dtype=bool), np.zeros(shape, dtype=bool))
    contact = InjectedContact(0, "tool", "tool", (0.0, 0.0, 1.0))
    named = ContactShape(name, samples * 0.002, 0.001)
    return AddedContacts(named, (contact,) * 30, np.zeros(30, dtype=bool), around, unit, 100, 0.002)


def test_a_persistence_is_chosen_for_all_shapes_together() -> None:
    """Longer than the knock, and the knock is missed at any force; shorter, and the threshold rises."""
    added = [contacts("knock", 12), contacts("push", 60)]
    found = compared_persistences(added, ["j"], 13, lambda n: {"j": 8.0 / np.sqrt(n)}, None)
    chosen = next(choice for choice in found if choice.chosen)
    assert chosen.n == 10 and chosen.gamma_nm["j"] == pytest.approx(8.0 / np.sqrt(10))
    assert chosen.force_n == {"knock": pytest.approx(2.53, rel=0.02), "push": pytest.approx(2.53, rel=0.02)}
    assert chosen.delay_s["push"] == pytest.approx(9 * 0.002)
    by_n = {choice.n: choice for choice in found}
    assert by_n[13].force_n["knock"] is None and by_n[13].cost is None


def test_a_persistence_that_is_too_late_is_not_chosen() -> None:
    added = [contacts("push", 60)]
    falling = {"gammas_at": lambda n: {"j": 8.0 / np.sqrt(n)}}
    free = compared_persistences(added, ["j"], 13, falling["gammas_at"], None)
    bound = compared_persistences(added, ["j"], 13, falling["gammas_at"], 0.02)
    chosen = [next(c for c in found if c.chosen).n for found in (free, bound)]
    assert chosen[0] == 50 and chosen[1] == 10


def test_what_is_set_stays_where_nothing_is_gained() -> None:
    found = compared_persistences([contacts("push", 60)], ["j"], 13, lambda n: {"j": 2.0 - 1e-4 * n}, None)
    assert next(c for c in found if c.chosen).n == 13


def test_no_threshold_no_choice() -> None:
    assert compared_persistences([contacts("push", 60)], ["j"], 13, lambda n: {"j": None}, None) == ()


def test_the_chosen_rule_is_given_as_flags() -> None:
    choices = compared_persistences([contacts("push", 60)], ["j"], 13, lambda n: {"j": 8.0 / n}, None)
    study = RuleStudy(STUDY_SCHEMA, "log", "0", 0.002, choices=choices)
    assert chosen_flags(study) == "--n 50 --gamma j=0.16"
    assert "--n 50 --gamma j=0.16" in study_text(study, 80)
    assert chosen_flags(replace(study, choices=())) is None
