"""Where an automatic threshold stands: between what motion does and what must be noticed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from collaudit.core.config.schema import Config, PolicyConfig
from collaudit.core.data.audit_result import FrictionFile
from collaudit.core.data.recommendation_result import PlaceForce
from collaudit.core.detection.fitted_rule import level_at, times_motion

LEVEL = {"a": 2.0, "b": 0.5}


def policy(**stated: Any) -> PolicyConfig:
    return Config.of({"policy": stated}).policy


def times(level_n: float | None, exerted_n: float | None = None, place: str = "tool", **stated: Any) -> float:
    return times_motion(LEVEL, {place: PlaceForce(level_n, exerted_n)}, policy(**stated))


@pytest.mark.parametrize(
    ("level_n", "expected"),
    [(5.0, 2.0), (12.5, 2.0), (20.0, (100 / 2 / 20) ** 0.5), (40.0, (100 / 2 / 40) ** 0.5), (50.0, 1.0), (400.0, 1.0)],
)
def test_it_is_the_geometric_middle_at_most_twice_the_level_and_never_below_it(level_n: float, expected: float) -> None:
    assert times(level_n) == pytest.approx(expected)


def test_what_must_be_noticed_is_what_the_policy_or_the_arms_strength_says() -> None:
    assert times(20.0, observable_n={"tool": 60.0}) == pytest.approx((60 / 2 / 20) ** 0.5)
    assert times(20.0, exerted_n=120.0) == pytest.approx((60 / 2 / 20) ** 0.5), "half of what a small arm exerts"
    assert times(50.0, place="forearm") == pytest.approx((150 / 2 / 50) ** 0.5)
    assert times(1e-3, place="upper_arm") == times(None) == 2.0, "nothing is asked there, or nothing felt"


def test_torques_that_must_be_noticed_count_too() -> None:
    assert times(5.0, observable_nm={"a": 6.0}) == pytest.approx((6.0 / 2 / 2.0) ** 0.5)
    assert times(400.0, observable_nm=6.0) == pytest.approx((6.0 / 2 / 2.0) ** 0.5), "then no force is a default"
    assert times(400.0, observable_nm={"a": 6.0}) == 1.0, "but for the joints without"


def test_the_same_file_gives_the_same_thresholds_to_every_log(
    made: Callable[..., Any], friction_of: Callable[[str], FrictionFile]
) -> None:
    """Three digits or fewer; "sharpest" is what the fitted motion reaches, without margin."""
    from collaudit.core import api

    friction, rules = friction_of("paper6"), {}
    for scenario in ("free-hits", "stop-go"):
        for gamma in ("auto", "sharpest"):
            files = made(scenario, "paper6")
            settings = api.load_config(files.config, {"detect.gamma_nm": gamma})
            rules[scenario, gamma] = api.audit(files.log, settings, friction).result.rule
    for gamma in ("auto", "sharpest"):
        one, other = (rules[scenario, gamma] for scenario in ("free-hits", "stop-go"))
        assert one.gamma_nm == other.gamma_nm and one.motion_nm == other.motion_nm
        assert all(float(f"{x:.3g}") == x for x in (*one.gamma_nm.values(), *one.motion_nm.values()))
    auto, sharp = rules["free-hits", "auto"], rules["free-hits", "sharpest"]
    assert sharp.motion_nm == auto.motion_nm and sharp.near_miss_nm == sharp.gamma_nm
    assert friction.thresholds is not None
    for joint, gamma in sharp.gamma_nm.items():
        level = level_at(friction.thresholds.joints[joint], sharp.n, sharp.persistence_s)
        assert level is not None and level.margin > 1.2
        assert gamma == pytest.approx((level.gamma_nm - 0.08) / level.margin, rel=0.005)
    assert auto.near_miss_nm == {
        joint: max(0.8 * gamma, auto.motion_nm[joint]) for joint, gamma in auto.gamma_nm.items()
    }
    assert all(1.0 < auto.gamma_nm[joint] / level <= 2.005 for joint, level in auto.motion_nm.items())
