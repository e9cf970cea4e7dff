"""With a torque before and one behind the gear, friction is their difference: no error of the model is in it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from arms import dh_robot, dh_row
from given_values import given_values
from origins import log_source
from three_joints import sines

from collaudit.core.api import fit, load_config
from collaudit.core.config.schema import Config
from collaudit.core.data.friction_result import FrictionFit
from collaudit.core.data.joint_log import JointLog
from collaudit.core.friction.joint_fits import fit_joints, friction_findings
from collaudit.core.prepare.preparation import prepare
from collaudit.core.robot.robot_building import build_robot

NAMES = ("joint1", "joint2")
COULOMB, VISCOUS, ROTOR = np.array([4.0, 2.0]), np.array([6.0, 3.0]), np.array([0.6, 0.3])


def config_of(scale: float) -> Config:
    """A two-joint arm; the description has ``scale`` times the mass."""
    rows = [
        dh_row(6.0 * scale, (-0.15, 0.02, 0), (0.05, 0.05, 0.05), a=0.3, alpha=-np.pi / 2),
        dh_row(5.0 * scale, (-0.15, 0, 0.02), (0.02, 0.06, 0.06), a=0.35),
    ]
    robot = dh_robot(rows, armature_kg_m2=ROTOR.tolist(), base_rpy_deg=(90, 0, 0))
    return Config.of({"robot": robot, "friction": {"model": "coulomb-viscous"}, "fit": {"motion": "any"}})


def motion(seed: int, seconds: float = 60.0) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(seed)
    t = np.arange(0, seconds, 0.004)
    q, v, a = sines(rng, t, 2)
    config = config_of(1.0)
    whole = build_robot(config.robot, Path(), NAMES).inverse_dynamics(q, v, a)
    link = whole - ROTOR * a + 0.4  # the sensor has an offset
    effort = whole + COULOMB * np.sign(v) + VISCOUS * v
    noise = rng.standard_normal((2, *q.shape))
    return {"t": t, "q": q, "v": v, "effort": effort + 0.3 * noise[0], "link": link + 0.3 * noise[1]}


def fitted(scale: float, seed: int = 0, sensors: bool = True) -> dict[str, FrictionFit]:
    config, m = config_of(scale), motion(seed)
    log = JointLog(
        m["t"],
        NAMES,
        m["q"],
        m["v"],
        m["effort"],
        "Nm",
        None,
        log_source(),
        joint_torque_nm=m["link"] if sensors else None,
    )
    return fit_joints([prepare(log, build_robot(config.robot, Path(), NAMES), config)], config)


def held(fits: dict[str, FrictionFit]) -> int:
    """How many of the four parameters lie in their intervals."""
    total = 0
    for j, name in enumerate(NAMES):
        for key, truth in (("A_nm", COULOMB[j]), ("D_nm_s_per_rad", VISCOUS[j])):
            low, high = fits[name].ci95[key] or (None, None)
            assert low is not None
            assert high is not None
            total += low <= truth <= high
    return total


def test_a_wrong_model_does_not_touch_friction_that_is_measured() -> None:
    wrong = fitted(1.5)
    assert all(fit.motion == "sensors" for fit in wrong.values())
    for j, name in enumerate(NAMES):
        assert abs(wrong[name].parameters["A_nm"] - COULOMB[j]) < 0.15
        assert abs(wrong[name].parameters["D_nm_s_per_rad"] - VISCOUS[j]) < 0.25
        assert (wrong[name].rmse_nm or 9.0) < 0.5  # the offset of 0.4, up one way and down the other
    blind = fitted(1.5, sensors=False)
    assert max(blind[name].rmse_nm or 0.0 for name in NAMES) > 1.0
    assert {fit.motion for fit in blind.values()} == {"any"}
    assert friction_findings(wrong) == []


def test_the_truth_lies_in_the_intervals() -> None:
    assert sum(held(fitted(1.5, seed)) for seed in range(8)) >= 28  # of 32


def test_a_table_states_its_second_torque(tmp_path: Path) -> None:
    m = motion(0, 40.0)
    columns = np.column_stack([m["t"], m["q"], m["v"], m["effort"], m["link"]])
    heads = ["t", *(f"{k}{i}" for k in ("q", "dq", "i_nm", "tau_sensor") for i in (1, 2))]
    np.savetxt(tmp_path / "log.csv", columns, delimiter=",", header=",".join(heads), comments="", fmt="%.7g")
    robot = given_values(config_of(1.5).robot)
    rows = "".join(
        "[[robot.dh]]\n" + "".join(f"{k} = {list(v) if isinstance(v, tuple) else v}\n" for k, v in row.items())
        for row in robot["dh"]
    )
    (tmp_path / "c.toml").write_text(
        f'[robot]\ndh_convention = "standard"\narmature_kg_m2 = {ROTOR.tolist()}\nbase_rpy_deg = [90, 0, 0]\n{rows}'
        '[log.csv]\ntime = "t"\nposition = "q{i}"\nvelocity = "dq{i}"\neffort = "i_nm{i}"\n'
        'joint_torque = "tau_sensor{i}"\n[log.units]\neffort = "Nm"\n'
    )
    friction = fit([tmp_path / "log.csv"], load_config(tmp_path / "c.toml"))
    assert friction.joints["joint1"].motion == "sensors"
