"""A torque added to a log shows as the detector itself shows it, and as the arm's geometry has it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from arms import LEVEL, dh_robot, dh_row
from origins import NOBODY
from synthetic import PERIOD, lugre, make_log, strokes

from collaudit.core.config.schema import Config
from collaudit.core.data.audit_result import FrictionFile
from collaudit.core.data.joint_log import JointLog
from collaudit.core.data.signals import State
from collaudit.core.detection.detector_run import DetectionInputs, DetectorRun, run_detector
from collaudit.core.detection.rule_settings import make_rule
from collaudit.core.fitting import fit_logs
from collaudit.core.friction.applied_friction import applied_friction
from collaudit.core.prepare.preparation import prepare
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.robot.robot_building import build_robot
from collaudit.core.rule_study.injected_contacts import (
    SHAPES,
    ContactShape,
    InjectedContact,
    open_moments,
    unit_torques,
)
from collaudit.core.rule_study.shown_torque import (
    LARGEST_N,
    Windows,
    alarmed,
    margin_samples,
    noticed_forces,
    shown,
    through_filters,
    windows,
)

NAMES = ("joint1", "joint2")
ROBOT = dh_robot(
    [dh_row(4.0, (0, 0, 0), (0, 0, 0.05), a=0.4), dh_row(2.0, (0, 0, 0), (0, 0, 0.02), a=0.3)],
    armature_kg_m2=[0.3, 0.3],
    **LEVEL,
)
FRICTION = ((2.0, 0.8, 10.0, 1.5), (3.0, 1.0, 10.0, 2.0))


def config(**sections: Any) -> Config:
    detect = {"gamma_nm": 2.0, "n": 5, "friction_level": "fixed", **sections}
    return Config.of({"robot": ROBOT, "detect": detect})


def log_of(q: np.ndarray, external: np.ndarray | float = 0.0) -> JointLog:
    v = np.gradient(q, PERIOD, axis=0)
    a = np.gradient(v, PERIOD, axis=0)
    robot = build_robot(config().robot, Path(), NAMES)
    friction = np.column_stack([lugre(v[:, j], *FRICTION[j]) for j in range(2)])
    noise = np.random.default_rng(1).normal(0, 0.05, q.shape)
    effort = robot.inverse_dynamics(q, v, a) + friction + noise + external
    return make_log(PERIOD * np.arange(len(q)), q, v, effort, NAMES)


def way() -> np.ndarray:
    stroke, _ = strokes((0.06, 0.1, 0.2, 0.4, 0.8))
    rest = np.full_like(stroke, -0.5)
    return np.concatenate([np.column_stack([stroke, rest]), np.column_stack([rest, stroke])])


@pytest.fixture(scope="module")
def friction() -> FrictionFile:
    robot = build_robot(config().robot, Path(), NAMES)
    return fit_logs([prepare(log_of(way()), robot, config())], config(), NOBODY)


def judged(friction: FrictionFile, external: np.ndarray | float = 0.0, **sections: Any) -> tuple[Any, ...]:
    settings = config(**sections)
    prepared = prepare(log_of(way(), external), build_robot(settings.robot, Path(), NAMES), settings)
    rule, watch = make_rule(prepared.judged_series, prepared.phases, settings)
    inputs = DetectionInputs(applied_friction(prepared, friction, settings).laws, frozenset(), rule, watch)
    return prepared, run_detector(prepared, inputs, settings), inputs


def whole(prepared: Prepared, run: DetectorRun, inputs: DetectionInputs) -> Windows:
    """The whole log as one window."""
    samples = np.arange(prepared.judged_series.time_s.size)[None, :]
    return windows(prepared.judged_series, run, inputs.laws, [0, 1], samples)


@pytest.mark.parametrize(("detector", "causal"), [("direct", False), ("direct", True), ("momentum", True)])
def test_added_torque_shows_as_the_detector_shows_it(friction: FrictionFile, detector: str, causal: bool) -> None:
    """Bit by bit as a log that was recorded with the torque, wherever the joints slide."""
    prepared, run, inputs = judged(friction, detector=detector, causal=causal)
    time = prepared.judged_series.time_s
    pushes = np.zeros((time.size, 2))
    for k, onset in enumerate(np.arange(3.0, time[-1] - 3.0, 1.7)):
        pushes[:, k % 2] += (-1.0) ** k * 9.0 * SHAPES[3 + k % 2].values(time - onset, PERIOD)
    _, other, _ = judged(friction, pushes, detector=detector, causal=causal)
    around = whole(prepared, run, inputs)
    kernel, period = run.residual.balance.kernel, prepared.judged_series.period_s
    added = kernel.apply(pushes, prepared.judged_series.segments, period).T[:, None, :]
    expected = np.abs(other.residual.torque_nm) - other.residual.uncertainty_nm
    for j in range(2):
        usable = around.evidence[j, 0] & ~around.standing[j, 0]
        interval = usable & (run.detected.state[:, j] == State.FRICTION_INTERVAL)
        assert np.count_nonzero(usable) > 5000 and np.count_nonzero(interval) > 100
        found = shown(around, added)[j, 0]
        assert np.allclose(found[usable], expected[usable, j], atol=1e-9)
        # at rest friction takes up what it can first: no more than the torque in the effort alone, but for the doubt
        rest = around.evidence[j, 0] & around.standing[j, 0]
        assert np.count_nonzero(rest) > 1000
        doubt = around.width_nm[j, 0] - around.taken_nm[j, 0]
        assert np.all(found[rest] <= expected[rest, j] + doubt[rest] + 1e-9)


def test_a_standing_joint_shows_what_its_friction_cannot_take(friction: FrictionFile) -> None:
    """Friction anywhere within ± its calibrated breakaway gives way to the other end of it, and no further."""
    prepared, run, inputs = judged(friction)
    around = whole(prepared, run, inputs)
    state = np.flatnonzero(around.standing[1, 0] & around.evidence[1, 0])
    taken, width = around.taken_nm[1, 0][state], around.width_nm[1, 0][state]
    hold = inputs.laws["joint2"].hold
    assert np.allclose(np.median(taken), 2.0 * hold * (1.0 + 0.5 * 0.2), rtol=0.02)
    assert np.all((taken < width) & (taken > 0.85 * width))
    for sign in (1.0, -1.0):
        for torque in (0.9 * np.median(taken), np.median(taken) + 3.0):
            added = np.zeros((2, 1, around.above_nm.shape[2]))
            added[1] = sign * torque
            found = np.maximum(shown(around, added)[1, 0][state], 0.0)
            assert np.median(found) == pytest.approx(max(0.0, torque - np.median(taken)), abs=0.05)


def test_torque_is_lever_arm_times_force(friction: FrictionFile) -> None:
    """A force across the stretched second link, 0.3 m from joint 2; what lies beyond the place feels nothing."""
    prepared, _, _ = judged(friction)
    frame = prepared.robot.link_of("joint2")
    assert frame is not None
    series = prepared.series
    sample = 2000
    turn = prepared.robot.frame_rotation(series.position_rad[sample], frame)
    samples = sample + np.arange(-50, 200)[None, :]
    across = turn @ np.array([0.0, 1.0, 0.0])
    along = turn @ np.array([1.0, 0.0, 0.0])
    lever = prepared.robot.distance_in_joint(frame)
    shape = ContactShape("push", 0.2, 0.05)
    torque = []
    for direction, felt in ((across, None), (along, None), (across, (0,))):
        contact = InjectedContact(sample, "", frame, (direction[0], direction[1], direction[2]), felt=felt)
        torque.append(unit_torques(prepared, [contact], samples, shape)[1, 0])
    level = shape.values((samples[0] - sample) * series.period_s, series.period_s)
    assert level.max() == pytest.approx(1.0) and lever == pytest.approx(0.3, abs=0.01)
    assert np.allclose(np.abs(torque[0]), lever * level, atol=1e-9)
    assert np.all(np.abs(torque[1]) < 1e-9) and np.all(torque[2] == 0.0)


def test_a_knock_between_two_samples_is_not_lost() -> None:
    """Its impulse is what a slow sampler keeps of it, wherever it falls."""
    shape = ContactShape("knock", 0.005, 0.0025)
    for phase in np.linspace(0.0, 1.0, 7):
        times = (np.arange(-20, 20) + phase) * 0.03
        assert shape.values(times, 0.03).sum() * 0.03 == pytest.approx(0.0025, rel=0.35)


def test_the_noticed_force_is_the_smallest(friction: FrictionFile) -> None:
    prepared, run, inputs = judged(friction)
    series, kernel = prepared.judged_series, run.residual.balance.kernel
    margin = margin_samples(kernel, series.bandwidth_hz, series.period_s)
    moments = open_moments(series, np.ones(series.time_s.size, dtype=bool), margin, 100 + margin)[::400]
    samples = moments[:, None] + np.arange(-margin, 100 + margin)
    around = windows(series, run, inputs.laws, [0, 1], samples)
    raw = SHAPES[3].values((samples - moments[:, None]) * series.period_s, series.period_s)
    unit = through_filters(np.stack([0.4 * raw, -0.3 * raw]), kernel, series.bandwidth_hz, series.period_s)
    gamma = np.array([2.0, 2.0])
    needed = noticed_forces(around, unit, gamma, 5)
    known = np.isfinite(needed)
    assert known.sum() > 20 and np.nanmax(needed[known]) < LARGEST_N
    above, below = (np.where(known, f * needed, 1.0)[None, :, None] * unit for f in (1.03, 0.97))
    assert alarmed(around, above, gamma, 5)[known].all()
    assert not alarmed(around, below, gamma, 5)[known].any()
    assert np.all(noticed_forces(around, unit, 2.0 * gamma, 5)[known] > needed[known])
