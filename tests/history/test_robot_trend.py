"""Changes over nights: those planted are found with night, size and cause, and nothing else is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from histories import history, joint_record, log_record, night

from collaudit.core.history.robot_trend import Event, rate_of, robot_trends


def wear(number: int, joint: str) -> float:
    """Half a per cent a night from night 20 on, of joint 2."""
    return 0.005 * max(0, number - 20) if joint == "j2" else 0.0


def events(records, robot: str) -> tuple[Event, ...]:
    return next(trend.events for trend in robot_trends(records) if trend.robot == robot)


def test_a_wearing_joint_is_found_in_a_fleet_that_does_not_wear() -> None:
    records = history("worn", 60, friction=wear)
    for k in range(7):
        records += history(f"steady-{k}", 60, seed=k + 1)
    trends = robot_trends(records)
    assert [trend.robot for trend in trends if trend.events] == ["worn"]
    (event,) = events(records, "worn")
    change = event.changes[0]
    assert event.cause == "wear-like growth" and (change.joint, change.quantity, change.shape) == (
        "j2",
        "friction",
        "drift",
    )
    assert change.night_ci95[0] <= night(20) <= change.night_ci95[1]
    low, high = change.per_night_ci95 or (0, 0)
    assert low < 0.005 < high and low > 0.003
    assert night(20) < change.told_night < night(50)
    assert "no temperature" in event.text and "cannot be told from wear" in event.text


def test_growth_beside_a_temperature_that_does_not_explain_it() -> None:
    warmth = np.random.default_rng(3).normal(30.0, 3.0, 60)
    (event,) = events(history("worn", 60, friction=wear, warmth_c=lambda k: warmth[k]), "worn")
    assert event.cause == "wear-like growth" and "Temperature does not explain it" in event.text


def test_friction_of_a_cold_arm_is_not_wear() -> None:
    warmth = 30.0 - 0.3 * np.maximum(np.arange(60) - 20.0, 0.0) + np.random.default_rng(3).normal(0.0, 1.0, 60)
    cold = history(
        "cold",
        60,
        friction=lambda k, j: -0.015 * (warmth[k] - 30.0) if j == "j2" else 0.0,
        warmth_c=lambda k: warmth[k],
    )
    (event,) = events(cold, "cold")
    assert event.cause == "temperature" and "not counted as wear" in event.text


def test_a_swapped_tool_is_load_and_not_wear() -> None:
    def heavier(number: int, joint: str) -> float:
        return 0.25 if number >= 33 and joint in ("j2", "j3") else 0.0

    swapped = history("swapped", 60, load=heavier, friction=lambda k, j: 0.2 * heavier(k, j))
    (event,) = events(swapped, "swapped")
    assert event.cause == "payload or tool" and {c.joint for c in event.changes} == {"j2", "j3"}
    assert all(c.night_ci95[0] <= night(33) <= c.night_ci95[1] for c in event.changes)
    assert "wear cannot be told" in event.text


def test_friction_of_all_joints_at_once_is_no_wear_of_one() -> None:
    (event,) = events(history("hall", 40, friction=lambda k, _: 0.08 if k >= 25 else 0.0), "hall")
    assert event.cause == "common cause" and len({c.joint for c in event.changes}) == 3


def test_wear_then_a_repair_are_two_events() -> None:
    worn = history("mended", 60, friction=lambda k, j: (0.01 * max(0, k - 10) if k < 40 else 0.0) if j == "j1" else 0.0)
    found = events(worn, "mended")
    assert [event.cause for event in found] == ["wear-like growth", "friction fell"]
    assert found[1].changes[0].night_ci95[0] <= night(40) <= found[1].changes[0].night_ci95[1]


def test_few_nights_tell_nothing_and_say_so() -> None:
    trend = robot_trends(history("young", 7, friction=lambda k, _: 0.1 * k))[0]
    assert not trend.events and any("7 nights" in words for words in trend.undetermined)


def test_a_new_friction_file_within_its_error_is_no_change() -> None:
    before, after = history("refit", 20), history("refit", 40, seed=5)[20:]
    law = {"law_nm": 8.25, "law_nm_low": 7.9, "law_nm_high": 8.6}
    shifted = [replace(r, friction_sha256="g", joints=tuple(replace(j, **law) for j in r.joints)) for r in after]
    assert not events([*before, *shifted], "refit")
    unchanged = [replace(r, friction_sha256="f") for r in shifted]
    assert events([*before, *unchanged], "refit")


def test_fits_of_each_night_are_followed_too() -> None:
    rng = np.random.default_rng(2)
    records = []
    for k in range(40):
        law = 8.0 * (1.0 + wear(k, "j2") * 2) + rng.normal(0.0, 0.05)
        own = joint_record(
            "j2",
            0.0,
            0.0,
            rng,
            friction_excess=None,
            load_excess=None,
            offset_nm=None,
            clean_mean_abs_nm=0.2,
            law_nm=law,
            law_nm_low=law - 0.1,
            law_nm_high=law + 0.1,
        )
        records.append(log_record("own", k, (own,), friction_sha256=None))
    (event,) = events(records, "own")
    assert event.cause == "wear-like growth"
    assert any("fitted on themselves" in words for words in robot_trends(records)[0].undetermined)


def test_a_night_that_was_not_judged_is_no_quiet_night() -> None:
    dark = [replace(r, verdict="not_judged", judged_h=0.0, joints=()) for r in history("dark", 10)]
    trend = robot_trends(dark)[0]
    assert trend.not_judged == 10 and trend.near_misses.per_hour is None and trend.contacts.per_hour is None


@pytest.mark.parametrize(("count", "high"), [(0, 3.689), (3, 8.767)])
def test_rates_have_exact_poisson_intervals(count: int, high: float) -> None:
    rate = rate_of(count, 1.0)
    assert rate.ci95 is not None and rate.ci95[1] == pytest.approx(high, abs=1e-3)
    assert rate_of(0, 0.0).per_hour is None
