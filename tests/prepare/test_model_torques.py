"""Rigid-body torque and the wrench at the joints in one go, against the two computed by themselves."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from collaudit.core.api import prepare
from collaudit.core.config import load_config
from collaudit.core.prepare.commanded_force import contact_torque, model_torques
from collaudit.core.robot.robot_model import RobotModel

OVERRIDES: list[dict[str, object]] = [
    {},
    {"log.wrench_bias": [0.3, -0.2, 0.1, 0.01, 0.02, -0.03]},
    {"log.wrench_bias": [0.0] * 6, "phases.approach": [], "phases.contact": [], "phases.retreat": []},
    {"phases.force_limit_n": 10.0},
    {"robot.tool.mass_kg": 0.0},
    {"robot.tool.com_m": [0.03, -0.02, 0.05]},
]


@pytest.fixture
def together(monkeypatch: pytest.MonkeyPatch) -> list[bool]:
    """Filled when both are computed in one go."""
    done: list[bool] = []
    in_one = RobotModel.torques
    monkeypatch.setattr(RobotModel, "torques", lambda *its: done.append(True) or in_one(*its))
    return done


@pytest.mark.parametrize("overrides", OVERRIDES)
def test_one_go_is_both(polishing: Path, overrides: dict[str, object], together: list[bool]) -> None:
    loaded = load_config(polishing.with_suffix(".toml"), overrides)
    prepared = prepare((polishing,), loaded)
    assert together
    series, robot, phases = prepared.series, prepared.robot, prepared.phases
    motion = (series.position_rad, series.velocity_rad_s, series.acceleration_rad_s2)
    apart = contact_torque(series, robot, phases, loaded.config)
    contact = apart.torque_nm
    assert contact is not None
    rigid, together_nm = model_torques(series, robot, phases, loaded.config)
    assert together_nm.torque_nm is not None
    np.testing.assert_allclose(rigid, robot.inverse_dynamics(*motion), atol=1e-10)
    np.testing.assert_allclose(together_nm.torque_nm, contact, atol=1e-10)
    assert together_nm.findings == apart.findings
    assert together_nm.excess == apart.excess
    assert np.nanmax(np.abs(contact)) > 1.0


def test_a_wrench_missing_in_part_takes_nothing_from_the_rigid_body_torque(
    polishing: Path, together: list[bool]
) -> None:
    loaded = load_config(polishing.with_suffix(".toml"))
    prepared = prepare((polishing,), loaded)
    assert prepared.series.wrench is not None
    together.clear()
    wrench = prepared.series.wrench.copy()
    wrench[1000:1010, 2] = np.nan
    series = replace(prepared.series, wrench=wrench)
    rigid, commanded = model_torques(series, prepared.robot, prepared.phases, loaded.config)
    contact = commanded.torque_nm
    assert not together
    np.testing.assert_array_equal(np.isnan(rigid), np.isnan(prepared.rigid_nm))
    assert contact is not None
    assert np.isnan(contact[1000:1010]).all() or (contact[1000:1010] == 0.0).all()


def test_an_unknown_velocity_takes_nothing_from_the_wrench_at_the_joints(polishing: Path, together: list[bool]) -> None:
    """Without a tool, J^T F needs the position only, and engines that need no acceleration go on."""
    loaded = load_config(polishing.with_suffix(".toml"), {"robot.tool.mass_kg": 0.0})
    prepared = prepare((polishing,), loaded)
    together.clear()
    velocity = prepared.series.velocity_rad_s.copy()
    velocity[12000:12010, 2] = np.nan
    series = replace(prepared.series, velocity_rad_s=velocity)
    contact = model_torques(series, prepared.robot, prepared.phases, loaded.config)[1].torque_nm
    assert contact is not None
    assert prepared.contact_nm is not None
    assert not together
    np.testing.assert_allclose(contact, prepared.contact_nm, atol=1e-10)
