"""What a baseline excuses: what it shows itself, within its noise, and nothing else."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from collaudit.core.data.friction_result import FrictionFit
from collaudit.core.policy.baseline import Baseline, BaselineLog, friction_change, known_level, known_rate, new_contacts

LOG = BaselineLog(None, "abc", None, True, 3600.0, 0)


def _levels(*rms: float) -> list[BaselineLog]:
    return [replace(LOG, sha256=str(k), rms_nm={"j": value}) for k, value in enumerate(rms)]


def test_a_log_that_was_not_judged_is_no_baseline() -> None:
    logs = (LOG, replace(LOG, judged=False), replace(LOG, robot="other"))
    assert Baseline("b", logs).before(None, None) == (LOG,)


def test_contacts_are_the_same_by_log_time_and_joint() -> None:
    before = [replace(LOG, contacts=((1.0, 1.5, ("a",)),))]
    assert new_contacts([(1.2, 1.6, ("a", "b"))], "abc", before) == 0
    assert new_contacts([(1.2, 1.6, ("b",)), (3.0, 3.1, ("a",))], "abc", before) == 2
    assert new_contacts([(1.2, 1.6, ("a",))], "another", before) is None


def test_near_misses_are_excused_by_as_high_a_rate_only() -> None:
    before = [replace(LOG, near_misses=40, recorded_s=4 * 3600.0)]
    assert known_rate(12, 1.0, 5.0, before), "12 in an hour after 10 an hour is noise"
    assert known_rate(40, 1.0, 5.0, before) is None
    assert known_rate(12, 1.0, 11.0, before) is None, "the baseline kept the limit"
    assert known_rate(12, 1.0, 5.0, [replace(LOG, recorded_s=1.0)]) is None, "an empty baseline excuses nothing"


def test_the_rate_test_keeps_its_level() -> None:
    """Of nights with the baseline's own rate 5 % at most are taken for worse."""
    rng = np.random.default_rng(3)
    worse = 0
    for _ in range(2000):
        before, tonight = rng.poisson(60), rng.poisson(20)
        worse += known_rate(tonight, 1.0, 0.5, [replace(LOG, near_misses=int(before), recorded_s=3 * 3600.0)]) is None
    assert worse / 2000 < 0.06


def test_a_level_needs_several_logs_to_be_noise() -> None:
    assert known_level(2.2, 1.0, "j", "new", _levels(2.0, 2.1, 1.9, 2.3))
    assert known_level(9.0, 1.0, "j", "new", _levels(2.0, 2.1, 1.9, 2.3)) is None
    assert known_level(2.0, 1.0, "j", "new", _levels(2.0, 2.1)) is None, "two logs tell no scatter"
    assert known_level(2.0, 1.0, "j", "new", _levels(0.5, 0.1, 3.0)) is None, "the baseline kept the limit"
    assert known_level(2.0, 1.0, "j", "0", _levels(2.0)), "the very same log is as high"


def _fit(coulomb: float, sd: float, viscous: float = 1.0) -> FrictionFit:
    return FrictionFit(
        model="coulomb-viscous",
        parameters={"A_nm": coulomb, "D_nm_s_per_rad": viscous},
        ci95={},
        covariance=((sd**2, 0.0), (0.0, 1e-12)),
        identifiable=True,
        not_identifiable=(),
        known=(),
        n_points=10,
        n_pairs=5,
        speed_range_rad_s=(0.1, 0.5),
        rmse_nm=0.0,
        effort_unit="N·m",
        points=(),
    )


def test_change_of_friction_has_the_interval_of_both_fits() -> None:
    change = friction_change(_fit(2.0, 0.03), _fit(2.2, 0.04))
    assert not isinstance(change, str)
    mean = 2.0 + 0.3  # Coulomb, and viscous friction at the mean of 0.1 and 0.5 rad/s
    assert change.share == pytest.approx(0.2 / mean)
    assert (change.high - change.low) / 2 == pytest.approx(1.96 * math.hypot(0.03, 0.04) / mean, rel=1e-3)


def test_change_of_friction_covers_the_truth() -> None:
    rng = np.random.default_rng(5)
    inside = 0
    for _ in range(500):
        change = friction_change(_fit(rng.normal(2.0, 0.05), 0.05), _fit(rng.normal(2.1, 0.02), 0.02))
        assert not isinstance(change, str)
        inside += change.low <= 0.1 / 2.3 <= change.high
    assert 0.92 <= inside / 500 <= 0.98


def test_what_cannot_be_compared_says_why() -> None:
    fit = _fit(2.0, 0.1)
    assert friction_change(fit, fit) is not None
    assert "uncertainty" in str(friction_change(fit, replace(_fit(2.1, 0.1), covariance=None)))
    assert "share no speed" in str(friction_change(fit, replace(_fit(2.1, 0.1), speed_range_rad_s=(0.6, 0.7))))
    assert "not fitted" in str(friction_change(fit, replace(fit, model=None)))
    assert "cannot be compared" in str(friction_change(fit, replace(_fit(2.1, 0.1), effort_unit="raw")))
