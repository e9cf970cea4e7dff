"""Shares, intervals, and what a rule notices, on contacts whose needs are known."""

from __future__ import annotations

import numpy as np
import pytest

from collaudit.core.rule_study.arm_contacts import AddedContacts, noticed_share, wilson_interval
from collaudit.core.rule_study.injected_contacts import ContactShape, InjectedContact, random_direction
from collaudit.core.rule_study.shown_torque import Windows


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


def test_what_a_rule_notices_of_each_shape() -> None:
    """Longer than the knock, and the knock is missed at any force; shorter, and the threshold has to rise."""
    gamma = np.array([8.0 / np.sqrt(10)])
    for shape in (contacts("knock", 12), contacts("push", 60)):
        needed, delay_s = shape.noticed(gamma, 10)
        assert np.median(needed) == pytest.approx(2.53, rel=0.02)
        assert delay_s == pytest.approx(9 * 0.002)
    assert np.isinf(contacts("knock", 12).noticed(gamma, 13)[0]).all()
