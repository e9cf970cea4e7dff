"""A log with one thing wrong: the cause is named first, with its size, and stating it takes the residual away."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from origins import NOBODY
from three_joints import COULOMB, VISCOUS, arm, log_of, settings, sines

from collaudit.core.audit import audit_log
from collaudit.core.causes.causes import told_load
from collaudit.core.config.schema import Config
from collaudit.core.data.audit_result import AuditResult, Cause, FrictionFile
from collaudit.core.data.joint_log import JointLog
from collaudit.core.fitting import fit_logs
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.prepare.calibration import Calibration
from collaudit.core.prepare.preparation import prepare
from collaudit.core.robot.pinocchio_model import rotation_rpy
from collaudit.core.robot.robot_model import RobotModel

PLAIN = settings(detect={"gamma_nm": "auto"})
TOOL: dict[str, Any] = {"mass_kg": 1.0, "com_m": [0.03, -0.02, 0.06]}


@cache
def friction() -> FrictionFile:
    return fit_logs([prepare(log_of(arm(PLAIN), np.ones(3), seed=3, seconds=120.0), arm(PLAIN), PLAIN)], PLAIN, NOBODY)


def logged(truth: RobotModel, seed: int = 8) -> JointLog:
    return log_of(truth, np.ones(3), seed=seed, seconds=90.0)


def with_effort(change: Callable[[FloatArray, JointLog], FloatArray]) -> JointLog:
    log = logged(arm(PLAIN))
    assert log.effort is not None
    return replace(log, effort=change(log.effort.copy(), log))


def rubbed(joint: int, factor: float) -> Callable[[FloatArray, JointLog], FloatArray]:
    def change(effort: FloatArray, log: JointLog) -> FloatArray:
        assert log.velocity_rad_s is not None
        v = log.velocity_rad_s[:, joint]
        effort[:, joint] += (factor - 1.0) * (COULOMB[joint] * np.sign(v) + VISCOUS[joint] * v)
        return effort

    return change


def tilted(rpy_deg: tuple[float, float, float]) -> RobotModel:
    whole = arm(PLAIN)
    bodies = whole.inertial_bodies().under_gravity(rotation_rpy(rpy_deg).T @ np.array([0.0, 0.0, -9.81]))
    return replace(whole, bodies=bodies)


def pushed(effort: FloatArray, log: JointLog) -> FloatArray:
    """Pushes of 30 N·m on joint2 for half a second, every twelve seconds."""
    effort[(log.time_s % 12.0) < 0.5, 1] += 30.0
    return effort


def result_of(log: JointLog, config: Config = PLAIN) -> AuditResult:
    return audit_log(prepare(log, arm(config), config), config, friction(), NOBODY).result


def first(log: JointLog) -> Cause:
    result = result_of(log)
    assert result.verdict != "pass"
    assert result.causes and result.causes[0].speaks
    return result.causes[0]


def test_a_load_is_named_with_its_mass_and_stating_it_passes() -> None:
    log = logged(arm(settings(tool=TOOL)))
    cause = first(log)
    assert cause.code == "tool"
    assert cause.value[0] == pytest.approx(1.0, abs=0.08)
    mass = cause.value[0]
    for value, (low, high), at in zip(cause.value[1:], cause.ci95[1:], TOOL["com_m"], strict=True):
        assert abs(value - at) < high - low + 0.01, "within twice its interval"
    tool = {"mass_kg": mass, "com_m": (np.array(cause.value[1:]) / mass).tolist()}
    assert not result_of(log, settings(tool=tool, detect={"gamma_nm": "auto"})).contacts


def test_a_tilt_is_named_before_signs_and_scales() -> None:
    """One of more than ten degrees is found before anything is judged (``tests/prepare/test_mounting.py``)."""
    log = logged(tilted((7.0, -5.0, 0.0)))
    cause = first(log)
    assert cause.code == "mounting" and "base_rpy_deg" in cause.line
    rpy = [float(x) for x in cause.line.split("[")[-1].rstrip("]").split(",")]
    assert rpy[:2] == pytest.approx([7.0, -5.0], abs=1.5)


@pytest.mark.parametrize(
    ("code", "joints", "change", "value"),
    [
        ("friction", ("joint2",), rubbed(1, 1.9), None),
        ("scale", ("joint2",), lambda x, log: x * [1.0, 1.5, 1.0], 0.5),
        ("zero", ("joint3",), lambda x, log: x + np.array([0.0, 0.0, 6.0]), 6.0),
        ("delay", (), lambda x, log: np.vstack([x[:6], x[:-6]]), 0.048),
        ("swapped", ("joint2", "joint3"), lambda x, log: x[:, [0, 2, 1]], 1.0),
    ],
)
def test_one_wrong_thing_is_named_first(
    code: str, joints: tuple[str, ...], change: Callable[[FloatArray, JointLog], FloatArray], value: float | None
) -> None:
    cause = first(with_effort(change))
    assert (cause.code, cause.joints) == (code, joints)
    assert 0.5 < cause.share <= 1.0
    if value is not None:
        assert cause.value[0] == pytest.approx(value, rel=0.12)


@pytest.mark.parametrize(
    ("frame", "force_n"), [("tool0", (0.0, 0.0, -25.0)), ("tool0", (15.0, -10.0, 0.0)), ("link2", (0.0, 0.0, -40.0))]
)
def test_a_hand_that_leans_on_the_arm_is_no_load_and_nothing_is_to_be_stated(
    frame: str, force_n: tuple[float, float, float]
) -> None:
    """For the whole log, in base axes: stating a mass or a scale would make a pass of it."""

    def leaned(effort: FloatArray, log: JointLog) -> FloatArray:
        return effort - arm(PLAIN).base_torque_per_newton(log.position_rad, frame) @ np.array(force_n)

    cause = first(with_effort(leaned))
    assert cause.code == "force" or "does not tell which" in cause.text
    assert cause.line == ""


def test_what_cannot_be_told_from_a_hand_is_not_stated() -> None:
    """A load on an arm that moves so slowly that its inertia does not show."""
    plain, carried = arm(PLAIN), arm(settings(tool={"mass_kg": 1.5, "com_m": [0.0, 0.0, 0.0]}))
    log = logged(plain)
    assert log.effort is not None
    weight = carried.gravity_torque(log.position_rad) - plain.gravity_torque(log.position_rad)
    cause = first(replace(log, effort=log.effort + weight))
    assert cause.line == ""


def test_of_slow_motion_a_load_may_be_a_hand_and_is_not_estimated() -> None:
    """Seven times as slow as the fitted motion: what inertia a load has does not show, and somebody may hang on it."""
    rng, slower = np.random.default_rng(8), 7.0
    t = np.arange(0, 240.0, 0.008)
    q, v, a = sines(rng, t / slower, 3)
    v, a = v / slower, a / slower**2
    truth = arm(settings(tool={"mass_kg": 2.5, "com_m": [0.0, 0.0, 0.0]}))
    effort = truth.inverse_dynamics(q, v, a) + COULOMB * np.sign(v) + VISCOUS * v + np.array([0.5, -0.3, 0.2])
    effort += 0.3 * rng.standard_normal(q.shape)
    fast = logged(arm(PLAIN))
    of_day = replace(fast.source, digest="of another day")
    log = replace(fast, time_s=t, position_rad=q, velocity_rad_s=v, effort=effort, source=of_day)
    cause = first(log)
    assert "does not tell which" in cause.text and cause.line == ""
    result = audit_log(prepare(log, arm(ESTIMATE), ESTIMATE), ESTIMATE, friction(), NOBODY).result
    assert result.verdict != "pass"
    assert all(finding.code != "load-estimated" for finding in result.findings)


def test_a_load_is_estimated_only_where_it_is_to_be_stated() -> None:
    cause = first(logged(arm(settings(tool=TOOL))))
    assert told_load([cause]) is not None
    assert told_load([replace(cause, line="")]) is None, "somebody may hold it"
    assert told_load([replace(cause, speaks=False)]) is None
    assert told_load([replace(cause, code="force")]) is None


def leaned(effort: FloatArray, log: JointLog) -> FloatArray:
    """Somebody leans on the second link."""
    return effort - arm(PLAIN).base_torque_per_newton(log.position_rad, "link2") @ np.array([0.0, 0.0, -40.0])


@pytest.mark.parametrize("change", [leaned, lambda x, log: x + np.array([0.0, 6.0, 0.0])])
def test_of_an_arm_with_a_joint_that_cannot_be_judged_no_hand_and_no_zero_is_claimed(
    change: Callable[[FloatArray, JointLog], FloatArray],
) -> None:
    """Efforts in each other's place: one joint shows that its are impossible, and the other what a hand might do."""
    log = with_effort(change)
    assert log.effort is not None
    assert result_of(log).causes[0].speaks
    broken = log.effort.copy()
    broken[:, 2] *= 0.003
    result = result_of(replace(log, effort=broken))
    assert result.verdict != "pass"
    assert "not-judged-joint" in {finding.effect for finding in result.findings}
    assert not any(cause.speaks for cause in result.causes if cause.code in ("force", "pull", "zero"))


def test_contact_alone_has_no_cause_and_a_clean_log_none_to_try() -> None:
    result = result_of(with_effort(pushed))
    assert result.verdict == "fail" and not any(cause.speaks for cause in result.causes)
    assert not result_of(logged(arm(PLAIN))).causes


def test_a_cause_is_found_beside_contact() -> None:
    log = with_effort(lambda x, log: pushed(rubbed(1, 1.9)(x, log), log))
    cause = first(log)
    assert (cause.code, cause.joints) == ("friction", ("joint2",))


def test_a_tool_that_only_the_fitted_log_carried_is_among_the_causes() -> None:
    """Its identified inertials hold the tool, so the judged log carries less than nothing that is stated."""
    laden = log_of(arm(settings(tool=TOOL)), np.ones(3), seed=3, seconds=120.0)
    fitted = fit_logs([prepare(laden, arm(PLAIN), PLAIN)], PLAIN, NOBODY)
    log = prepare(logged(arm(PLAIN)), arm(PLAIN), PLAIN, Calibration.of(fitted, PLAIN))
    causes = audit_log(log, PLAIN, fitted, NOBODY).result.causes
    tool = next(cause for cause in causes if cause.code == "tool")
    assert tool.value[0] == pytest.approx(-1.0, abs=0.08)
    assert "of the fitted logs" in tool.line and "less at the tool than in the fitted logs" in tool.text


def rows_of(log: JointLog, rows: slice) -> JointLog:
    assert log.velocity_rad_s is not None and log.effort is not None
    time_s = log.time_s[rows] - log.time_s[rows][0]
    motion = {"position_rad": log.position_rad[rows], "velocity_rad_s": log.velocity_rad_s[rows]}
    return replace(log, time_s=time_s, effort=log.effort[rows], **motion)


ESTIMATE = settings(tool={"mass_kg": "estimate"}, detect={"gamma_nm": "auto"})


@pytest.mark.parametrize("of_fit", [PLAIN, settings(tool=TOOL)])
def test_a_load_that_is_to_be_estimated_is_told_by_the_judged_log(of_fit: Config) -> None:
    """Heavier or lighter than in the fitted log: contacts are found as with what is stated, and a pass says so."""
    carried = {"mass_kg": 1.4 if of_fit is PLAIN else 0.2, "com_m": [0.0, 0.03, 0.05]}
    fitted_log = prepare(log_of(arm(of_fit), np.ones(3), seed=3, seconds=120.0), arm(ESTIMATE), ESTIMATE)
    fitted = fit_logs([fitted_log], ESTIMATE, NOBODY)
    log = logged(arm(settings(tool=carried)), seed=9)
    log = rows_of(log, slice(125, -125))  # its noise is not slow at the ends
    for pushes in (False, True):
        assert log.effort is not None
        effort = pushed(log.effort.copy(), log) if pushes else log.effort
        one = replace(log, effort=effort, source=replace(log.source, digest="of another day"))
        ready = prepare(one, arm(ESTIMATE), ESTIMATE, Calibration.of(fitted, ESTIMATE))
        result = audit_log(ready, ESTIMATE, fitted, NOBODY).result
        assert len(result.contacts) == (8 if pushes else 0)
        assert result.verdict == ("fail" if pushes else "pass")
        said = next(f.text for f in result.findings if f.code == "load-estimated")
        assert said in result.exclusions


@pytest.mark.parametrize("force_n", [(0.0, 0.0, -25.0), (15.0, -10.0, 0.0), (0.0, 0.0, -60.0)])
def test_a_hand_that_leans_on_the_arm_is_not_estimated_away(force_n: tuple[float, float, float]) -> None:
    log = logged(arm(PLAIN))
    assert log.effort is not None
    effort = log.effort - arm(PLAIN).base_torque_per_newton(log.position_rad, "tool0") @ np.array(force_n)
    leaned = replace(log, effort=effort, source=replace(log.source, digest="of another day"))
    result = audit_log(prepare(leaned, arm(ESTIMATE), ESTIMATE), ESTIMATE, friction(), NOBODY).result
    assert result.verdict != "pass"
    assert all(finding.code != "load-estimated" for finding in result.findings)
