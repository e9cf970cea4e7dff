"""A key that is stated and does nothing is found, and what it needs gives it its effect."""

from __future__ import annotations

from typing import Any

import pytest

from collaudit.core.config.describe import NEEDS, without_effect
from collaudit.core.config.schema import Config

CONSTANTS = {"joint1": 11.2}
ROW = {"a": 0.3, "mass_kg": 1.0}
#: By key: a configuration in which it does nothing, and what gives it its effect.
CASES: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "log.units.torque_constant_nm_per_a": (
        {"log": {"units": {"effort": "raw", "torque_constant_nm_per_a": CONSTANTS}}},
        {"log": {"units": {"effort": "mA", "torque_constant_nm_per_a": CONSTANTS}}},
    ),
    "log.units.rated_torque_nm": (
        {"log": {"units": {"rated_torque_nm": CONSTANTS}}},
        {"log": {"units": {"effort": "permille", "rated_torque_nm": CONSTANTS}}},
    ),
    "robot.dh_convention": (
        {"robot": {"urdf": "arm.urdf", "dh_convention": "standard"}},
        {"robot": {"dh": [ROW], "dh_convention": "standard"}},
    ),
    "robot.motor_side": (
        {"robot": {"motor_side": ["position"]}},
        {"robot": {"motor_side": ["position"], "reduction": [100.0]}},
    ),
    "robot.tool.com_m": (
        {"robot": {"tool": {"com_m": [0.0, 0.0, 0.1]}}},
        {"robot": {"tool": {"com_m": [0.0, 0.0, 0.1], "mass_kg": 1.0}}},
    ),
    "detect.observer_gain_per_s": (
        {"detect": {"observer_gain_per_s": 30.0}},
        {"detect": {"observer_gain_per_s": 30.0, "detector": "momentum"}},
    ),
}


@pytest.mark.parametrize("key", [need.key for need in NEEDS])
def test_each_key_is_found_without_what_it_needs_and_not_with_it(key: str) -> None:
    idle, with_effect = CASES[key]
    assert [need.key for need in without_effect(Config.of(idle))] == [key]
    assert without_effect(Config.of(with_effect)) == ()


def test_what_is_not_stated_is_no_mistake() -> None:
    assert without_effect(Config()) == () == without_effect(Config.of({"detect": {"n": 5}}))
