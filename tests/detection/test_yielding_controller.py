"""A controller that yields to a push looks like a filter in the effort: smoothing is measured beside contact."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
import pytest
from origins import log_source
from scipy.signal import bilinear, lfilter
from three_joints import COULOMB, NAMES, VISCOUS, arm, settings, sines

from collaudit.core.data.joint_log import JointLog
from collaudit.core.detection.judgement import _with_smoothing
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.prepare.hand_guiding import with_effort_smoothing
from collaudit.core.prepare.preparation import prepare

CONFIG = settings()
PERIOD_S = 0.008
TIME_S = np.arange(0.0, 60.0, PERIOD_S)
LAWS = {
    joint: partial(lambda c, d, v: c * np.tanh(v / 0.02) + d * v, *cd)
    for joint, *cd in zip(NAMES, COULOMB, VISCOUS, strict=True)
}


def derivative(values: FloatArray) -> FloatArray:
    return np.asarray(np.gradient(values, PERIOD_S, axis=0))


def log_with(push_nm: float, logged: Callable[[FloatArray], FloatArray] = lambda torque: torque) -> JointLog:
    """Pushes of 0.3 s on all joints, to which the arm yields by a slow controller (4 rad/s), and efforts as logged."""
    on = sum(((start < TIME_S) & (start + 0.3 > TIME_S) for start in (10.0, 25.0, 40.0, 50.0)), np.zeros(TIME_S.size))
    external = push_nm * on[:, None] * np.array([1.0, -0.8, 0.5])
    stiffness = np.array([2.0, 2.0, 1.0]) * 4.0**2
    top, bottom = bilinear([4.0**2], [1.0, 2 * 0.6 * 4.0, 4.0**2], 1 / PERIOD_S)
    q = sines(np.random.default_rng(0), TIME_S, 3)[0] + lfilter(top, bottom, external / stiffness, axis=0)
    v = derivative(q)
    friction = np.column_stack([law(v[:, j]) for j, law in enumerate(LAWS.values())])
    torque = arm(CONFIG).inverse_dynamics(q, v, derivative(v)) + friction - external
    noise = 0.3 * np.random.default_rng(1).standard_normal(torque.shape)
    return JointLog(TIME_S, NAMES, q, v, logged(torque) + noise, "Nm", None, log_source())


def lagged(torque: FloatArray) -> FloatArray:
    share = PERIOD_S / 0.3
    return np.asarray(lfilter([share], [1.0, share - 1.0], torque - torque[0], axis=0) + torque[0])


def test_a_push_to_which_the_controller_yields_is_no_filter() -> None:
    prepared = prepare(log_with(60.0), arm(CONFIG), CONFIG)
    whole = with_effort_smoothing(prepared, LAWS)
    assert any(one.shown for one in whole.effort_smoothing.values()), "what this is about"
    said = _with_smoothing(prepared, LAWS, CONFIG)
    assert said.effort_smoothing
    assert not any(one.shown for one in said.effort_smoothing.values())
    assert "effort-filtered" not in {f.code for f in said.findings}


@pytest.mark.parametrize("push_nm", [0.0, 60.0])
def test_a_filter_is_said_beside_such_pushes(push_nm: float) -> None:
    prepared = prepare(log_with(push_nm, lagged), arm(CONFIG), CONFIG)
    said = _with_smoothing(prepared, LAWS, CONFIG)
    assert [f.code for f in said.findings if f.code == "effort-filtered"]
