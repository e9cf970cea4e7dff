"""How long identification takes on an hour of 500 Hz, seven joints."""

from __future__ import annotations

import time

import numpy as np
import pytest

from collaudit.core.audit import fit_logs
from collaudit.core.config.schema import Config
from collaudit.core.prepare import prepare
from collaudit.core.result import Provenance
from collaudit.core.series import JointLog, LogSource
from collaudit.fixtures.robots import robot_named

pytestmark = pytest.mark.bench
LIMIT_S = 60.0


def test_one_hour_is_fitted_within_a_minute() -> None:
    arm = robot_named("seven")
    robot = arm.model()
    names = robot.joint_names
    t = np.arange(0, 3600, 0.002)
    rng = np.random.default_rng(0)
    q, v, a = (np.zeros((t.size, 7)) for _ in range(3))
    for j in range(7):
        for w in (0.4 + 0.07 * j, 1.1 + 0.11 * j):
            size, p = 0.5 / (1 + w), rng.uniform(0, 6)
            q[:, j] += size * np.sin(w * t + p)
            v[:, j] += size * w * np.cos(w * t + p)
            a[:, j] -= size * w * w * np.sin(w * t + p)
    effort = robot.inverse_dynamics(q, v, a) + 3 * np.sign(v) + 2 * v + 0.3 * rng.standard_normal(v.shape)
    log = JointLog(t, names, q, v, effort, "Nm", None, LogSource("hour", "0" * 64, "test", None, "column", "/t"))
    config = Config.model_validate({"fit": {"estimate": ["friction", "gain", "inertials", "tool"]}})
    start = time.perf_counter()
    prepared = prepare(log, robot, config)
    ready = time.perf_counter()
    found = fit_logs([prepared], config, Provenance("0", {}))
    done = time.perf_counter()
    print(f"conditioning and model torque {ready - start:.1f} s, everything fitted {done - ready:.1f} s")
    assert found.identified is not None
    assert all(fit.model for fit in found.joints.values())
    assert done - ready < LIMIT_S
