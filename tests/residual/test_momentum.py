"""Momentum form against textbook dynamics of a pendulum and of a two-link arm, and the detectors against each other."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from arms import LEVEL, dh_robot, dh_row
from origins import log_source

from collaudit.core.config.schema import Config
from collaudit.core.data.joint_log import JointLog
from collaudit.core.numeric.filters import butterworth, double_pole, first_order
from collaudit.core.prepare.preparation import prepare
from collaudit.core.residual.balance import Balance
from collaudit.core.residual.detector import DETECTORS, detector_named
from collaudit.core.residual.residual import ResidualInputs
from collaudit.core.robot.robot_building import build_robot
from collaudit.core.robot.robot_model import RobotModel

T = 0.002
KERNELS = {"momentum": first_order, "filtered": butterworth, "eso": double_pole}
NO_FRICTION = ResidualInputs({}, frozenset())
M1, M2, L1, L2 = 4.0, 2.5, 0.4, 0.3
G = 9.80665


def config(links: int, **detect: object) -> Config:
    rows = [
        dh_row(M1, (0, 0, 0), (0, 0, 0.02), a=L1),
        dh_row(M2, (0, 0, 0), (0, 0, 0.01), a=L2),
    ]
    robot = dh_robot(rows[:links], armature_kg_m2=[0.3] * links, **LEVEL)
    return Config.of({"robot": robot, "detect": detect})


def arm(cfg: Config) -> RobotModel:
    return build_robot(cfg.robot, Path(), tuple(f"joint{i + 1}" for i in range(len(cfg.robot.dh))))


def mass_matrix(q2: float) -> np.ndarray:
    """Two point masses at the links' ends with inertias 0.02 and 0.01 and rotors of 0.3, by hand."""
    c2 = np.cos(q2)
    m11 = M1 * L1**2 + M2 * (L1**2 + L2**2 + 2 * L1 * L2 * c2) + 0.03 + 0.3
    m12 = M2 * (L2**2 + L1 * L2 * c2) + 0.01
    return np.array([[m11, m12], [m12, M2 * L2**2 + 0.01 + 0.3]])


def test_momentum_terms_of_a_two_link_arm_by_hand() -> None:
    robot = arm(config(2))
    rng = np.random.default_rng(3)
    q, v = rng.uniform(-2, 2, (50, 2)), rng.uniform(-2, 2, (50, 2))
    momentum, rest = robot.momentum(q, v)
    for k in range(50):
        (q1, q2), (v1, v2) = q[k], v[k]
        assert momentum[k] == pytest.approx(mass_matrix(q2) @ v[k], abs=1e-9)
        h = -M2 * L1 * L2 * np.sin(q2)
        coriolis = np.array([[h * v2, h * (v1 + v2)], [-h * v1, 0.0]])  # Christoffel form
        gravity = G * np.array([(M1 + M2) * L1 * np.cos(q1) + M2 * L2 * np.cos(q1 + q2), M2 * L2 * np.cos(q1 + q2)])
        assert rest[k] == pytest.approx(coriolis.T @ v[k] - gravity, abs=1e-9)


def pendulum_log(seconds: float = 12.0, noise: float = 0.0) -> tuple[JointLog, np.ndarray]:
    """A swinging pendulum with an external torque pulse; returns the log and the pulse."""
    t = T * np.arange(round(seconds / T))
    q, v, a = 0.8 * np.sin(1.3 * t), 1.04 * np.cos(1.3 * t), -1.352 * np.sin(1.3 * t)
    pulse = 6.0 / (1.0 + np.exp(-(t - 5.0) / 0.01)) / (1.0 + np.exp((t - 5.6) / 0.01))
    inertia = M1 * L1**2 + 0.02 + 0.3
    effort = inertia * a + M1 * G * L1 * np.cos(q) + pulse
    effort = effort + np.random.default_rng(0).normal(0, noise, t.size) if noise else effort
    source = log_source("pendulum")
    return JointLog(t, ("joint1",), q[:, None], v[:, None], effort[:, None], "Nm", None, source), pulse


def balance_of(log: JointLog, cfg: Config) -> Balance:
    """The torque balance that the configured detector takes friction off."""
    return detector_named(cfg.detect.detector).residual(prepare(log, arm(cfg), cfg), NO_FRICTION, cfg.detect).balance


def balance(name: str, causal: bool, gain: float = 60.0, noise: float = 0.0) -> tuple[np.ndarray, np.ndarray, float]:
    cfg = config(1, detector=name, causal=causal, observer_gain_per_s=gain)
    log, pulse = pendulum_log(noise=noise)
    out = balance_of(log, cfg)
    assert out.total_nm is not None
    return out.total_nm[:, 0], pulse, out.kernel.delay_s


@pytest.mark.parametrize("name", [detector.name for detector in DETECTORS])
@pytest.mark.parametrize("causal", [True, False])
def test_every_detector_measures_the_pulse_on_the_pendulum(name: str, causal: bool) -> None:
    total, pulse, delay = balance(name, causal)
    inside = slice(round(5.3 / T), round(5.45 / T))
    assert np.allclose(total[inside], 6.0, atol=0.05)
    calm = np.r_[round(1 / T) : round(4.7 / T), round(6.2 / T) : round(11 / T)]
    assert np.max(np.abs(total[calm])) < 0.05
    half = T * int(np.argmax(total > 3.0))
    crossing = T * int(np.argmax(pulse > 3.0))
    assert half - crossing == pytest.approx(0.75 * delay, abs=0.35 * delay + T)


@pytest.mark.parametrize("name", KERNELS)
def test_the_momentum_form_is_the_smoothed_direct_residual(name: str) -> None:
    """Causal detectors never see an acceleration, and yet equal the kernel applied to eq. (5)."""
    total, _, _ = balance(name, True)
    cfg = config(1)
    log, _ = pendulum_log()
    made = prepare(log, arm(cfg), cfg)
    assert made.rigid_nm is not None
    assert made.series.effort is not None
    kernel = KERNELS[name](60.0, True)
    direct = kernel.apply(made.series.effort - made.rigid_nm, made.series.segments, T)[:, 0]
    inside = slice(500, -100)
    assert np.max(np.abs(total[inside] - direct[inside])) < 0.02


def test_the_observer_recursion_step_by_step() -> None:
    """lfilter against the textbook observer integrated with small steps: r = K (p - ∫(u + r) dt - p0)."""
    total, _, _ = balance("momentum", True)
    cfg = config(1)
    log, _ = pendulum_log()
    made = prepare(log, arm(cfg), cfg)
    momentum, rest = made.robot.momentum(log.position_rad, log.velocity_rad_s)
    assert log.effort is not None
    u = (log.effort + rest)[:, 0]
    p, r, integral, fine = momentum[:, 0], 0.0, 0.0, 20
    out = np.zeros(u.size)
    for k in range(1, u.size):
        for i in range(fine):
            share = (i + 0.5) / fine
            uu, pp = u[k - 1] + share * (u[k] - u[k - 1]), p[k - 1] + share * (p[k] - p[k - 1])
            integral += (uu + r) * T / fine
            r = 60.0 * (pp - integral - p[0])
        out[k] = r
    # the textbook's r counts what acts on the robot, eq. (5) what the drives bring up against it
    assert np.max(np.abs(-out[500:] - total[500:])) < 0.05


def test_causal_detectors_do_not_look_ahead() -> None:
    for detector in DETECTORS:
        cfg = config(1, detector=detector.name, causal=True)
        log, _ = pendulum_log()
        assert log.effort is not None
        later = log.effort.copy()
        later[4000:] += 30.0
        totals = []
        for effort in (log.effort, later):
            total = balance_of(replace(log, effort=effort), cfg).total_nm
            assert total is not None
            totals.append(total)
        assert np.array_equal(totals[0][:4000], totals[1][:4000])
        assert not np.array_equal(totals[0][4000:], totals[1][4000:])
