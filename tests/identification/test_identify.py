"""Identification from any motion against arms of known inertials, drives and tools."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from identified import identify
from three_joints import ARMATURE, NAMES, arm, log_of, settings

from collaudit.core.config.schema import Config
from collaudit.core.errors import ConfigError
from collaudit.core.friction.motion_points import motion_points
from collaudit.core.identification import estimate_choice, solved_problem, torque_terms
from collaudit.core.identification.identification import identified_findings
from collaudit.core.identification.torque_terms import base_map
from collaudit.core.prepare.calibration import Calibration
from collaudit.core.prepare.preparation import calibrated, prepare
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.robot.robot_model import RobotModel


def prepared_log(config: Config, truth: RobotModel, gain: float | np.ndarray = 1.0, **kwargs: object) -> Prepared:
    return prepare(log_of(truth, np.ones(3) * gain, **kwargs), arm(config), config)  # type: ignore[arg-type]


def test_nothing_is_identified_unless_asked_for() -> None:
    config = settings()
    assert identify([prepared_log(config, arm(config))], config) is None


def test_wrong_inertials_are_corrected_and_shown_on_time_left_out() -> None:
    config = settings(1.35, fit={"estimate": ["friction", "inertials"]})
    truth = arm(settings())
    log = prepared_log(config, truth)
    found = identify([log], config)
    assert found is not None
    for name in ("joint2", "joint3"):
        joint = found.joints[name]
        assert joint.held_out_rms_nm is not None
        assert joint.held_out_rms_file_nm is not None
        assert joint.held_out_rms_nm < 0.7 * joint.held_out_rms_file_nm
        assert joint.held_out_rms_nm < 0.6  # the noise is 0.42 N·m before it is filtered
        assert joint.offset_ci95[0] is not None
    assert found.consistent
    assert all(body.consistent for body in found.bodies.values())
    assert found.prior_sd == 0.2
    seen = calibrated(log, Calibration(found), config)
    rng = np.random.default_rng(5)
    q, v, a = rng.uniform(-1, 1, (3, 200, 3))
    true = truth.inverse_dynamics(q, v, a)
    before = np.sqrt(np.mean((log.robot.inverse_dynamics(q, v, a) - true) ** 2))
    after = np.sqrt(np.mean((seen.robot.inverse_dynamics(q, v, a) - true) ** 2))
    assert after < 0.35 * before


def test_base_parameters_lie_in_their_intervals() -> None:
    """Cluster-robust intervals of the well-observed combinations, over seeds."""
    config = settings(1.05, fit={"estimate": ["inertials"], "blocks": 2})
    truth = arm(settings())
    base = base_map(truth, NAMES)
    exact = dict(zip(base.names, base.matrix @ truth.inertial_parameters, strict=True))
    hits = total = 0
    for seed in range(5):
        found = identify([prepared_log(config, truth, seed=seed)], config)
        assert found is not None
        for parameter in found.base_parameters:
            if parameter.from_data > 0.9:
                low, high = parameter.ci95
                assert low is not None
                assert high is not None
                total += 1
                hits += low <= exact[parameter.name] <= high
    assert total > 20
    assert hits / total > 0.85


@pytest.mark.parametrize("gain", [(1.0, 1.0, 1.0), (-1.0, 2.0, 0.08), (0.5, -0.05, 7.0)])
def test_drive_gains_and_signs_are_found_with_their_intervals(gain: tuple[float, ...]) -> None:
    config = settings(fit={"estimate": ["gain"]}, log={"units": {"effort": "raw"}})
    log = prepared_log(config, arm(settings()), np.array(gain), unit="raw")
    found = identify([log], config)
    assert found is not None
    for name, true in list(zip(NAMES, gain, strict=True))[1:]:
        joint = found.joints[name]
        assert joint.gain == pytest.approx(true, rel=0.03)
        assert joint.gain_ci95 is not None
        low, high = sorted(joint.gain_ci95, key=lambda x: x or 0.0)
        assert (low or 0) - 0.02 * abs(true) <= true <= (high or 0) + 0.02 * abs(true)
    seen = calibrated(log, Calibration(found), config)
    assert seen.series.effort_unit == "Nm"
    assert not any(f.code == "effort-sign-inverted" for f in seen.findings)
    assert any(f.is_fact and f.where == "friction file" for f in seen.findings)


def bare(config: Config) -> RobotModel:
    """The arm as a description that states no rotor inertia has it."""
    described = arm(config)
    return described.with_inertials(described.inertial_parameters, np.zeros_like(described.armature))


@pytest.mark.parametrize("seed", range(6))
def test_gains_hold_without_a_stated_rotor_inertia(seed: int) -> None:
    config = settings(fit={"estimate": ["gain"]}, log={"units": {"effort": "raw"}})
    true = np.array([3.0, 0.5, -2.0])
    found = identify([prepare(log_of(arm(settings()), true, seed, unit="raw"), bare(config), config)], config)
    assert found is not None
    shown = 0
    for name, gain, rotor in zip(NAMES, true, ARMATURE, strict=True):
        joint = found.joints[name]
        if joint.gain is not None and joint.gain_ci95 is not None:
            shown += 1
            low, high = sorted(x or 0.0 for x in joint.gain_ci95)
            assert low <= gain <= high
            assert joint.armature_kg_m2 == pytest.approx(rotor, rel=0.3)
    assert shown >= 2


def test_a_joint_whose_gain_cannot_be_told_keeps_the_stated_one() -> None:
    """The first joint turns about the vertical: its inertia and its rotor's are nearly one."""
    units = {"effort": "Nm"}
    config = settings(fit={"estimate": ["gain"]}, log={"units": units})
    log = log_of(arm(settings()), np.array([1.1, 1.1, 1.1]))
    assert log.effort is not None
    still = replace(log, position_rad=log.position_rad.copy(), velocity_rad_s=log.velocity_rad_s.copy())  # type: ignore[union-attr]
    still.position_rad[:, 0] = 0.0
    still.velocity_rad_s[:, 0] = 0.0  # type: ignore[index]
    found = identify([prepare(still, bare(config), config)], config)
    assert found is not None
    kept = found.joints["joint1"]
    assert kept.gain_kept
    assert kept.gain == 1.0
    assert kept.gain_ci95 == pytest.approx((1.0 - 1.96 * 0.2, 1.0 + 1.96 * 0.2))
    assert {f.joint for f in identified_findings(found) if "stated gain is kept" in f.text} >= {"joint1"}
    assert not any(f.code == "effort-kind" for f in identified_findings(found))
    assert not found.joints["joint2"].gain_kept


@pytest.mark.parametrize(("gain_sd", "expected"), [(0.2, 1.3), (0.002, 1.0)])
def test_a_stated_constant_is_believed_as_far_as_its_prior(
    gain_sd: float, expected: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(solved_problem, "GAIN_SD", gain_sd)
    config = settings(fit={"estimate": ["gain"]}, log={"units": {"effort": "Nm"}})
    found = identify([prepare(log_of(arm(settings()), np.ones(3) * 1.3), bare(config), config)], config)
    assert found is not None
    assert found.joints["joint2"].gain == pytest.approx(expected, rel=0.05)
    assert found.joints["joint2"].gain_kept == (gain_sd < 0.01)


def test_a_late_velocity_does_not_spoil_gains() -> None:
    config = settings(fit={"estimate": ["gain"]}, log={"units": {"effort": "raw"}})
    log = log_of(arm(settings()), np.ones(3), unit="raw")
    assert log.velocity_rad_s is not None
    late = replace(log, velocity_rad_s=np.roll(log.velocity_rad_s, 2, axis=0))
    found = identify([prepare(late, arm(config), config)], config)
    assert found is not None
    assert found.joints["joint1"].gain == pytest.approx(1.0, rel=0.03)  # 6 % off by the logged velocity


def test_gains_and_inertials_keep_the_scale_of_the_description() -> None:
    config = settings(1.08, fit={"estimate": ["gain", "inertials"]})
    found = identify([prepared_log(config, arm(settings()), np.array([-1.0, -2.0, -3.0]))], config)
    assert found is not None
    for name, true in (("joint2", -2.0), ("joint3", -3.0)):
        assert found.joints[name].gain == pytest.approx(true, rel=0.15)
        assert (found.joints[name].held_out_rms_nm or 9) <= 1.02 * (found.joints[name].held_out_rms_file_nm or 0)
    assert "set their scale" in found.prior


@pytest.mark.parametrize("known", [0.0, 0.5])
def test_a_tool_nobody_wrote_down_is_found(known: float) -> None:
    at = {"mass_kg": 1.8, "com_m": (0.02, -0.03, 0.08)}
    truth = arm(settings(tool=at))
    tool = {"mass_kg": known, "com_m": (0.0, 0.0, 0.05)} if known else {"mass_kg": "estimate"}
    config = settings(tool=tool, fit={"estimate": ["tool"]})
    found = identify([prepared_log(config, truth)], config)
    assert found is not None
    assert found.tool is not None
    assert found.tool.mass_kg == pytest.approx(1.8, abs=0.1)
    assert found.tool.mass_ci95[0] is not None
    assert found.tool.mass_ci95[0] - 0.05 < 1.8 < (found.tool.mass_ci95[1] or 0) + 0.05
    assert found.tool.com_m == pytest.approx((0.02, -0.03, 0.08), abs=0.03)


def test_efforts_of_unknown_unit_need_their_gain_estimated() -> None:
    config = settings(fit={"estimate": ["inertials"]}, log={"units": {"effort": "raw"}})
    with pytest.raises(ConfigError, match="gain"):
        identify([prepared_log(config, arm(settings()), unit="raw")], config)


def test_base_parameters_reproduce_every_torque() -> None:
    model = arm(settings())
    base = base_map(model, NAMES)
    rng = np.random.default_rng(0)
    q, v, a = rng.uniform(-2, 2, (3, 50, 3))
    regressor = model.torque_regressor(q, v, a)
    still = model.with_inertials(model.inertial_parameters, np.zeros(3))
    assert regressor @ model.inertial_parameters == pytest.approx(still.inverse_dynamics(q, v, a), abs=1e-9)
    # any change that leaves the base parameters alone leaves the torques alone
    free = rng.standard_normal(regressor.shape[2])
    change = free - np.linalg.pinv(base.matrix) @ (base.matrix @ free)
    assert regressor @ change == pytest.approx(np.zeros((50, 3)), abs=1e-8)
    assert base.matrix.shape[0] < regressor.shape[2]


def impossible() -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """A body, one that cannot exist, the precision of its parameters, and which are free."""
    body = np.array([2.0, 0.0, 0.0, 0.2, 0.05, 0.0, 0.05, 0.0, 0.0, 0.01])
    best = body.copy()
    best[9] = -0.05  # no body has a negative moment of inertia
    return body, best, np.diag(1.0 / np.maximum(np.abs(body), 0.01) ** 2), np.ones(10, dtype=bool)


def test_impossible_bodies_are_replaced_by_the_closest_possible() -> None:
    body, best, hessian, free = impossible()
    assert torque_terms.is_consistent(body)
    assert not torque_terms.is_consistent(best)
    near = torque_terms.make_consistent(best, hessian, free, 1)
    assert near.consistent
    assert torque_terms.is_consistent(near.free)

    def cost(x: np.ndarray) -> float:
        return float((x - best) @ hessian @ (x - best))

    # the set of possible bodies is convex: on every way from the answer to a possible body, the cost rises
    rng = np.random.default_rng(1)
    for _ in range(200):
        other = body * (1 + 0.5 * rng.standard_normal(10))
        if torque_terms.is_consistent(other):
            assert cost(near.free) <= cost(near.free + 0.01 * (other - near.free)) * (1 + 1e-6)


def test_friction_is_read_off_any_motion() -> None:
    config = settings()
    log = prepared_log(config, arm(config))
    points = motion_points([log], "joint2")
    assert {p.direction for p in points} == {1, -1}
    for p in points:
        offset = -0.3 * p.direction
        assert p.friction_nm == pytest.approx(5.0 + 6.0 * p.speed_rad_s + offset, abs=5 * p.se_nm + 0.1)


def test_an_arm_the_file_was_not_made_for_is_refused() -> None:
    config = settings(fit={"estimate": ["inertials"]})
    log = prepared_log(config, arm(settings()))
    found = identify([log], config)
    assert found is not None
    other = replace(found, joints={"elbow": found.joints["joint1"]})
    with pytest.raises(ConfigError, match="other joints"):
        calibrated(log, Calibration(other), config)


@pytest.mark.parametrize("estimate", ["rotor", "inertials"])
def test_a_tool_stated_for_another_log_counts_whatever_was_identified(estimate: str) -> None:
    config = settings(fit={"estimate": ["friction", estimate]})
    found = identify([prepared_log(config, arm(config))], config)
    assert found is not None
    assert {body.identified for body in found.bodies.values()} == {estimate == "inertials"}
    laden = settings(tool={"mass_kg": 2.0, "com_m": [0.0, 0.0, 0.1]})
    q = np.random.default_rng(5).uniform(-1, 1, (50, 3))
    still = np.zeros_like(q)
    before, after = (
        calibrated(prepared_log(each, arm(each)), Calibration(found), each).robot.inverse_dynamics(q, still, still)
        for each in (config, laden)
    )
    weight = (arm(each).inverse_dynamics(q, still, still) for each in (laden, config))
    np.testing.assert_allclose(after - before, np.subtract(*weight), atol=1e-9)


@pytest.mark.parametrize("estimate", ["rotor", "gain"])
def test_rotors_stated_for_another_log_count_unless_they_were_identified(estimate: str) -> None:
    config = settings(fit={"estimate": ["friction", estimate]})
    found = identify([prepared_log(config, arm(config))], config)
    assert found is not None
    stated = config.changed({"robot": config.robot.changed({"armature_kg_m2": [2.0, 2.0, 2.0]})})
    seen = calibrated(prepared_log(stated, arm(stated)), Calibration(found), stated)
    assert (seen.robot.armature == 2.0).all() == (estimate == "gain")


def test_a_tool_picked_up_on_the_way_is_no_one_tool() -> None:
    """Its mass is that of neither half, and that is said."""
    keys = {"frame": "tool0", "mass_kg": "estimate", "com_m": [0.0, 0.0, 0.05]}
    config = settings(fit={"estimate": ["tool"], "blocks": 2}, tool=keys)
    light, heavy = (arm(settings(tool={**keys, "mass_kg": mass})) for mass in (0.8, 2.4))
    gain = np.ones(3)
    both = [log_of(truth, gain) for truth in (light, heavy)]
    effort = np.where(both[0].time_s[:, None] < 30.0, both[0].effort, both[1].effort)
    changed = identify([prepare(replace(both[0], effort=effort), arm(config), config)], config)
    assert changed is not None
    assert changed.tool is not None
    assert changed.tool.mass_halves_kg == pytest.approx((0.8, 2.4), abs=0.3)
    assert [f.code for f in identified_findings(changed)].count("fit-doubtful") == 1
    same = identify([prepare(both[0], arm(config), config)], config)
    assert same is not None
    assert same.tool is not None
    assert same.tool.mass_halves_kg is None
    assert same.tool.mass_kg == pytest.approx(0.8, abs=0.2)


def test_a_joint_that_moves_one_way_has_no_offset_of_its_own() -> None:
    """Offset and Coulomb friction are one there: friction keeps it, and no interval is printed."""
    config = settings(fit={"estimate": ["inertials"], "blocks": 2})
    log = log_of(arm(settings()), np.ones(3))
    assert log.effort is not None
    assert log.velocity_rad_s is not None
    effort = log.effort.copy()
    effort[log.velocity_rad_s[:, 1] > 0, 1] = np.nan
    found = identify([prepare(replace(log, effort=effort), arm(config), config)], config)
    assert found is not None
    assert found.joints["joint2"].offset_nm == 0.0
    assert found.joints["joint2"].offset_ci95 == (None, None)
    assert found.joints["joint1"].offset_ci95[0] is not None


def test_a_rotor_inertia_that_no_file_states_lies_in_its_interval() -> None:
    truth, config = arm(settings()), settings(fit={"estimate": ["friction", "inertials"]})
    unstated = config.changed({"robot": config.robot.changed({"armature_kg_m2": None})})
    held = 0
    for seed in range(3):
        found = identify([prepared_log(unstated, truth, seed=seed)], unstated)
        assert found is not None
        for name, value in zip(NAMES, ARMATURE, strict=True):
            low, high = found.joints[name].armature_ci95 or (None, None)
            assert low is not None
            assert high is not None
            held += low <= value <= high
        assert found.joints["joint3"].armature_kg_m2 == pytest.approx(0.4, rel=0.3)
    assert held >= 8


def test_acceleration_that_is_noise_takes_no_inertia_away(monkeypatch: pytest.MonkeyPatch) -> None:
    """Stamps that scatter by 2 ms: what multiplies the noise of the second derivative is biased towards nothing."""
    monkeypatch.setattr(estimate_choice, "WIDTHS", (1.0,))
    config = settings(fit={"estimate": ["inertials"]})
    truth = arm(config)
    log = log_of(truth, np.ones(3))
    late = 0.002 * np.random.default_rng(1).standard_normal((log.time_s.size, 1))
    assert log.velocity_rad_s is not None
    scattered = replace(log, position_rad=log.position_rad + late * log.velocity_rad_s, velocity_rad_s=None)
    rng = np.random.default_rng(5)
    q, v, a = rng.uniform(-1, 1, (3, 200, 3))
    true = truth.inverse_dynamics(q, v, a)

    def error() -> float:
        prepared = prepare(scattered, truth, config)
        found = identify([prepared], config)
        assert found is not None
        seen = calibrated(prepared, Calibration(found), config)
        return float(np.sqrt(np.mean((seen.robot.inverse_dynamics(q, v, a) - true) ** 2)))

    slow = error()
    monkeypatch.setattr(Prepared, "bandwidth_hz", property(lambda self: self.series.bandwidth_hz))
    assert slow < 0.3 * error()
    assert slow < 0.05 * float(np.sqrt(np.mean(true**2)))


def tool_of(mass_kg: float) -> dict[str, object]:
    return {"mass_kg": mass_kg, "com_m": [0.02, 0.0, 0.05]}


@pytest.mark.parametrize(
    ("carried", "stated"),
    [((0.8, 0.8), (0.8, 0.8)), ((0.8, 0.0), (0.8, 0.0)), ((0.0, 0.8), (0.0, 0.8)), ((0.8, 0.8), (0.0, 0.0)),
     ((0.8, 2.0), (0.0, 1.2)), ((1.5, 0.3), (1.2, 0.0))],
)  # fmt: skip
def test_a_tool_stated_for_a_log_has_its_effect_beside_identified_masses(
    carried: tuple[float, float], stated: tuple[float, float]
) -> None:
    """Carried in fitted and judged log, stated in either: what is identified is a correction of the description."""
    fit = {"estimate": ["friction", "inertials"]}
    fitted, judged = (settings(1.2, tool=tool_of(mass), fit=dict(fit)) for mass in stated)
    there, here = (arm(settings(tool=tool_of(mass))) for mass in carried)
    found = identify([prepared_log(fitted, there)], fitted)
    assert found is not None and found.masses
    seen = prepare(log_of(here, np.ones(3), seed=1), arm(judged), judged, Calibration(found))
    assert seen.rigid_nm is not None
    q, v, a = np.random.default_rng(5).uniform(-1, 1, (3, 200, 3))
    true, known = here.inverse_dynamics(q, v, a), seen.robot.inverse_dynamics(q, v, a)
    described = arm(judged).inverse_dynamics(q, v, a)
    error, before = (np.sqrt(np.mean((torque - true) ** 2)) for torque in (known, described))
    assert error < 0.4 * before
    # as well as where the fitted log's own tool is carried
    own = prepare(log_of(there, np.ones(3), seed=1), arm(fitted), fitted, Calibration(found)).robot
    assert error < 1.2 * np.sqrt(np.mean((own.inverse_dynamics(q, v, a) - there.inverse_dynamics(q, v, a)) ** 2)) + 0.02


def test_rotors_are_found_without_bias_and_within_their_intervals() -> None:
    """Three standard errors of the mean of 18, each off by 3.5 %: a twentieth too much in all would show."""
    config = settings(fit={"estimate": ["rotor"]})
    ratios, held = [], 0
    for seed in range(6):
        found = identify([prepare(log_of(arm(settings()), np.ones(3), seed), bare(config), config)], config)
        assert found is not None
        for name, value in zip(NAMES, ARMATURE, strict=True):
            low, high = found.joints[name].armature_ci95 or (None, None)
            assert low is not None
            assert high is not None
            ratios.append((found.joints[name].armature_kg_m2 or 0.0) / value)
            held += low <= value <= high
    assert np.mean(ratios) == pytest.approx(1.0, abs=3.0 * 0.035 / np.sqrt(18.0))
    assert held >= 15
