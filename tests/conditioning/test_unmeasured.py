"""Stretches that are no measurement count as missing; coarse, slow and computed signals are left as they are."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from synthetic import PERIOD, make_log

from collaudit.core.conditioning.conditioning import condition
from collaudit.core.conditioning.unmeasured import _period, without_unmeasured
from collaudit.core.config.schema import ConditioningConfig, DetectConfig
from collaudit.core.data.joint_log import JointLog

LOST = slice(3000, 3200)
RULE = DetectConfig()


def swinging(noise: float = 0.1, joints: int = 2) -> JointLog:
    t = PERIOD * np.arange(5000)
    phase = np.arange(joints)
    q = 0.8 * np.sin(0.9 * t[:, None] + phase)
    v = 0.72 * np.cos(0.9 * t[:, None] + phase)
    effort = 10 * np.cos(q) + np.random.default_rng(0).normal(0, noise, q.shape)
    return make_log(t, q, v, effort, [f"joint{k + 1}" for k in range(joints)])


def efforts(log: JointLog) -> np.ndarray:
    assert log.effort is not None
    return log.effort.copy()


def codes(log: JointLog) -> list[str]:
    return [finding.code for finding in log.findings]


def hold(x: np.ndarray, part: slice) -> None:
    x[part] = x[part.start - 1]


def fill(x: np.ndarray, part: slice) -> None:
    x[part] = np.interp(
        np.arange(part.start, part.stop), [part.start - 1, part.stop], [x[part.start - 1], x[part.stop]]
    )


def hold_with_noise(x: np.ndarray, part: slice) -> None:
    x[part] = x[part.start - 1] + np.random.default_rng(1).normal(0, 0.015, part.stop - part.start)


def replay(x: np.ndarray, part: slice) -> None:
    x[part] = x[part.start - 500 : part.stop - 500]


SPOILT = {
    "constant": hold,
    "a straight line": fill,
    "without the usual noise": hold_with_noise,
    "the exact copy of another stretch": replay,
}


def test_a_healthy_log_is_left_alone() -> None:
    log = swinging()
    assert without_unmeasured(log, RULE) is log


@pytest.mark.parametrize("what", SPOILT)
@pytest.mark.parametrize("digits", [None, 3])
def test_what_is_no_measurement_is_missing_for_its_span_only(what: str, digits: int | None) -> None:
    effort = efforts(swinging())
    SPOILT[what](effort[:, 1], LOST)
    effort = effort if digits is None else np.round(effort, digits)  # as a table is written
    found = without_unmeasured(replace(swinging(), effort=effort), RULE)
    (finding,) = found.findings
    assert (finding.code, finding.joint, finding.forbids_pass) == ("not-measured", "joint2", True)
    assert what in finding.text
    assert found.effort is not None and np.isfinite(found.effort[:, 0]).all()
    lost = np.flatnonzero(np.isnan(found.effort[:, 1]))
    inside = lost[(lost >= LOST.start) & (lost < LOST.stop)]
    assert inside.size > 0.9 * (LOST.stop - LOST.start)
    beside = 200 if what.startswith("the exact") else 0  # nothing tells which of two copies was measured
    assert lost.size - inside.size <= beside + 20


@pytest.mark.parametrize("spoil", [hold, fill])
@pytest.mark.parametrize("rule", [RULE, DetectConfig(n=25), DetectConfig(persistence_ms=10)])
def test_the_shortest_stretch_is_that_of_an_alarm(spoil: Callable[..., None], rule: DetectConfig) -> None:
    least = rule.n or round((rule.persistence_ms or 25.0) / 2 + 0.49)
    for length, said in ((least, ["not-measured"]), (least // 2, [])):
        effort = efforts(swinging())
        spoil(effort[:, 1], slice(3000, 3000 + length))
        assert codes(without_unmeasured(replace(swinging(), effort=effort), rule)) == said


def test_all_efforts_that_are_held_are_missing_of_joints_at_rest_too() -> None:
    log = swinging()
    assert log.velocity_rad_s is not None
    q, v, effort = log.position_rad.copy(), log.velocity_rad_s.copy(), efforts(log)
    q[:, 1], v[:, 1] = 0.3, 0.0
    hold(effort, LOST)
    found = without_unmeasured(replace(log, position_rad=q, velocity_rad_s=v, effort=effort), RULE)
    assert {finding.joint for finding in found.findings} == {"joint1", "joint2"}


def test_less_noise_on_all_channels_at_once_shows_in_fewer_samples() -> None:
    """A cubic through three samples on either side, in 16 ms of six joints: in one channel it may be chance."""
    part = slice(2000, 2008)
    nodes = np.r_[part.start - 3 : part.start, part.stop : part.stop + 3]
    effort = efforts(swinging(joints=6))
    for j in range(6):
        curve = np.polynomial.Polynomial.fit(nodes, effort[nodes, j], 3)
        effort[part, j] = curve(np.arange(part.start, part.stop))
    rule = DetectConfig(n=6)
    found = without_unmeasured(replace(swinging(joints=6), effort=effort), rule)
    assert {finding.joint for finding in found.findings} == {f"joint{k + 1}" for k in range(6)}


@pytest.mark.parametrize("hold", [2, 5, 20])
def test_a_drive_that_updates_slowly_is_left_alone(hold: int) -> None:
    effort = efforts(swinging())
    effort = np.repeat(effort[::hold], hold, axis=0)[: effort.shape[0]]
    log = replace(swinging(), effort=effort)
    assert without_unmeasured(log, RULE) is log


@pytest.mark.parametrize("step", [0.1, 0.5, 2.0])
def test_coarse_steps_are_left_alone(step: float) -> None:
    log = swinging(noise=0.05)
    log = replace(log, effort=step * np.round(efforts(log) / step))
    assert without_unmeasured(log, RULE) is log


def test_an_effort_that_was_computed_is_left_alone() -> None:
    """Constant speed and no noise: constant efforts, straight lines, and every stroke as the one before."""
    v = np.tile(np.repeat([0.5, -0.5], 500), 5)
    q, t = np.cumsum(v) * PERIOD, PERIOD * np.arange(5000)
    for effort in (3.0 * np.sign(v) + 2.0 * v, 3.0 * np.sign(v) + 20.0 * np.cos(q), 10.0 * q):
        log = make_log(t, q[:, None], v[:, None], effort[:, None])
        assert without_unmeasured(log, RULE) is log


def test_drives_that_are_off_are_another_matter() -> None:
    effort = efforts(swinging())
    effort[LOST] = 0.0
    log = replace(swinging(), effort=effort)
    assert without_unmeasured(log, RULE) is log


@pytest.mark.parametrize("logged", [True, False])
def test_a_frozen_position_of_a_moving_joint_is_missing(logged: bool) -> None:
    log = swinging()
    q = log.position_rad.copy()
    span = slice(100, 300)  # joint 1 passes its middle at speed
    hold(q[:, 0], span)
    spoilt = replace(log, position_rad=q, velocity_rad_s=log.velocity_rad_s if logged else None)
    found = without_unmeasured(spoilt, RULE)
    assert codes(found) == ["not-measured"]
    assert np.isnan(found.position_rad[span, 0]).all()
    series = condition(replace(log, position_rad=q), ConditioningConfig())
    assert "not-measured" in {f.code for f in series.findings}
    assert np.isnan(series.position_rad[span, 0]).any() or not series.segments[0].stop > span.stop


def test_several_frozen_stretches_are_said_once() -> None:
    log = swinging()
    q = log.position_rad.copy()
    for start in (100, 1200, 3400, 4600):
        hold(q[:, 0], slice(start, start + 60))
    (finding,) = without_unmeasured(replace(log, position_rad=q), RULE).findings
    assert "3 more" not in finding.text and "and 1 more times" in finding.text


@pytest.mark.parametrize("step", [1e-3, 5e-3])
def test_the_steps_of_an_encoder_are_not_frozen(step: float) -> None:
    """A joint so slow that its encoder makes a step every tenth of a second."""
    log = swinging()
    slow = 0.03 * log.time_s + 1e-5 * np.sin(log.time_s)
    q = log.position_rad.copy()
    q[:, 0] = step * np.round(slow / step)
    v = np.full_like(q, 0.03)
    assert "not-measured" not in codes(without_unmeasured(replace(log, position_rad=q, velocity_rad_s=v), RULE))


def test_a_joint_that_stops_is_not_frozen() -> None:
    t = PERIOD * np.arange(4000)
    v = np.clip(2.0 - t, 0.0, 1.0) * (t < 5)
    q = np.cumsum(v) * PERIOD
    v = np.concatenate([np.zeros(30), v])[: v.size]  # a velocity that the drive filters comes late
    effort = np.random.default_rng(0).normal(0, 0.1, t.size)
    log = make_log(t, q[:, None], v[:, None], effort[:, None])
    assert without_unmeasured(log, RULE) is log


def test_the_usual_step_is_told_beside_unknown_stamps() -> None:
    t = 0.002 * np.arange(1000.0)
    t[1:] += 0.001 * (np.arange(999) % 5 < 2).cumsum()  # two in five of the steps are longer
    t[100::7] = np.nan
    assert _period(t) == np.nanmedian(np.diff(t)) == pytest.approx(0.002)
    assert _period(np.full(1000, np.nan)) is None
