"""The effort's sign by friction: on wrists that gravity does not load it is all there is."""

from __future__ import annotations

import numpy as np
import pytest
from synthetic import PERIOD, make_log
from three_joints import arm, log_of, settings

from collaudit.core.conditioning.conditioning import condition
from collaudit.core.config.schema import ConditioningConfig
from collaudit.core.findings import Finding
from collaudit.core.prepare.effort_checks import sign_findings
from collaudit.core.prepare.effort_gain import EffortGain, friction_signs
from collaudit.core.prepare.preparation import prepare
from collaudit.core.torque_table.block_sums import Slope
from collaudit.core.torque_table.log_samples import TorqueTable


def run(sign: float, load: float = 0.0, friction: float = 3.0, late_s: float = 0.0, led: float = 0.0) -> Slope:
    """A joint with friction; ``led`` is the share of the time in which a hand leads it with 15 N·m."""
    rng = np.random.default_rng(0)
    t = PERIOD * np.arange(20000)

    def motion(at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return 0.8 * np.sin(0.9 * at) + 0.3 * np.sin(2.3 * at), 0.72 * np.cos(0.9 * at) + 0.69 * np.cos(2.3 * at)

    q, v = motion(t)
    then, before = motion(t - late_s)
    torque = load * np.cos(then + 0.5) + friction * (np.sign(before) + 0.4 * before)
    torque -= np.where(t > t[-1] * (1.0 - led), 15.0 * np.sign(v), 0.0)
    log = make_log(t, q[:, None], v[:, None], (sign * torque + rng.normal(0, 0.5, t.size))[:, None])
    series = condition(log, ConditioningConfig())
    return friction_signs(TorqueTable.of(series, (load * np.cos(q + 0.5))[:, None]))["joint1"]


@pytest.mark.parametrize("load", [0.0, 0.01, 20.0])
def test_an_inverted_wrist_is_noticed_without_gravity(load: float) -> None:
    assert run(-1.0, load).negative
    assert not run(1.0, load).negative
    assert run(1.0, load).value > 3.0


def test_no_friction_tells_no_sign() -> None:
    assert not run(-1.0, friction=0.0).negative
    assert not run(1.0, friction=0.0).negative


def test_a_late_effort_is_no_inverted_one() -> None:
    assert not run(1.0, load=30.0, late_s=0.03).negative


def test_a_hand_that_leads_the_arm_inverts_no_sign() -> None:
    assert not run(1.0, led=0.3).negative


def test_what_is_stated_wins_and_gravity_is_heard() -> None:
    joint, sign = "joint1", run(-1.0)

    def said(*gains: EffortGain, stated: tuple[str, ...] = ()) -> Finding:
        (finding,) = (f for f in sign_findings(gains, (joint,), stated, {joint: sign}) if not f.is_fact)
        return finding

    error = said()
    assert (error.code, error.severity, error.joint) == ("effort-sign-inverted", "error", joint)
    assert f'effort_sign = {{ "{joint}" = -1 }}' in error.text
    assert error.effect == "not-judged-joint"
    stated = said(stated=(joint,))
    assert (stated.code, stated.severity, stated.effect) == ("effort-sign-inverted", "warning", "none")
    other = said(EffortGain(joint, 1.0, (0.9, 1.1), 0.9))
    assert (other.code, other.severity) == ("friction-not-physical", "warning")
    once = said(EffortGain(joint, -1.0, (-1.1, -0.9), 0.9))
    assert "against the model's gravity" in once.text


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_tool_that_turns_the_torque_of_gravity_round_is_no_inverted_effort(sign: float) -> None:
    """By the description the last link hangs to one side of its joint, with its tool it hangs to the other.

    Friction takes power: the effort is upright. An effort that is inverted is noticed all the same.
    """
    behind, truth = ({"mass_kg": 2.0, "com_m": [x, 0.0, 0.0]} for x in (-0.6, 0.05))
    config = settings(tool=behind)
    log = log_of(arm(settings(tool=truth)), np.array([1.0, 1.0, sign]))
    prepared = prepare(log, arm(config), config)
    inverted = [f.joint for f in prepared.findings if f.code == "effort-sign-inverted"]
    assert inverted == ([] if sign > 0 else ["joint3"])


def test_gravity_keeps_its_word_where_friction_says_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """A tool could turn any wrist round: that alone clears no sign."""
    monkeypatch.setattr("three_joints.COULOMB", np.zeros(3))
    monkeypatch.setattr("three_joints.VISCOUS", np.zeros(3))
    config = settings()
    prepared = prepare(log_of(arm(config), np.array([1.0, 1.0, -1.0])), arm(config), config)
    assert [f.joint for f in prepared.findings if f.code == "effort-sign-inverted"] == ["joint3"]
