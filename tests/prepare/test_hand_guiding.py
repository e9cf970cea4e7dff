"""An arm guided by hand without a flag is a state that is said and not judged; a push or a clamp never becomes one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from origins import NOBODY
from scipy.signal import lfilter
from scipy.special import erf

from collaudit.core import api
from collaudit.core.audit import audit_log
from collaudit.core.config import load_config
from collaudit.core.data.audit_result import Audit, FrictionFile
from collaudit.core.data.signals import State
from collaudit.core.findings import Finding
from collaudit.core.friction.applied_friction import applied_friction
from collaudit.core.prepare.hand_guiding import fitted_without_guiding, with_effort_smoothing, without_guiding
from collaudit.core.prepare.prepared import Prepared
from collaudit.fixtures.compare import audit_simulated, read_truth
from collaudit.fixtures.simulation import SimulatedFiles

Maker = Callable[..., SimulatedFiles]
Fitted = Callable[[str], FrictionFile]


def guided(findings: tuple[Finding, ...]) -> list[tuple[float, float]]:
    return [(f.start_s or 0.0, f.end_s or 0.0) for f in findings if f.code == "arm-guided"]


def looked_at(prepared: Prepared, files: SimulatedFiles, friction: FrictionFile) -> list[tuple[float, float]]:
    settings = load_config(files.config)
    laws = applied_friction(prepared, friction, settings.config).laws
    by_joint = {joint: law.torque for joint, law in laws.items()}
    return guided(without_guiding(prepared, by_joint, settings.config).findings)


def pushed(prepared: Prepared, start_s: float, length_s: float, torque_nm: np.ndarray) -> Prepared:
    """The log with these torques on its joints for a while, with ramps of 40 ms."""
    effort = prepared.series.effort
    assert effort is not None
    time_s = prepared.series.time_s
    inside = np.minimum(time_s - start_s, start_s + length_s - time_s)
    shape = np.clip(inside / 0.04, 0.0, 1.0)
    return replace(prepared, series=replace(prepared.series, effort=effort + shape[:, None] * torque_nm))


def test_a_guided_stretch_is_said_and_not_judged(made: Maker, friction_of: Fitted, robot: str) -> None:
    files = made("hand-guided", robot)
    ((start, end),) = read_truth(files.truth)["fault"]["spans_s"]
    audit = audit_simulated(files, friction_of(robot))
    ((first, last),) = guided(audit.result.findings)
    assert start - 0.2 < first < start + 1.0
    assert end - 4.0 < last < end + 0.2  # it ends where the arm comes to rest, under the hand
    assert audit.result.collisions == ()
    assert audit.result.verdict == "not_judged"
    inside = (audit.signals.time_s > first) & (audit.signals.time_s < last)
    assert (audit.signals.state[inside] >= State.NOT_DRIVEN).all()


def test_stated_not_to_be_one_it_is_judged(made: Maker, friction_of: Fitted, robot: str) -> None:
    files = made("hand-guided", robot)
    settings = load_config(files.config, {"detect.hand_guiding": "off"})
    audit = api.audit(files.log, settings, friction_of(robot))
    assert guided(audit.result.findings) == []
    assert audit.result.verdict == "fail"


def test_pushes_beside_a_guided_stretch_stay_found(made: Maker, friction_of: Fitted, robot: str) -> None:
    files = made("hand-guided", robot)
    settings, friction = load_config(files.config), friction_of(robot)
    prepared = api.prepare(files.log, settings, friction)
    push = np.zeros(len(prepared.series.joint_names))
    push[:3] = (35.0, -35.0, 30.0)
    for start in (8.0, 25.0):
        prepared = pushed(prepared, start, 0.3, push)
    audit: Audit = audit_log(prepared, settings.config, friction, NOBODY, siblings=None)
    assert len(guided(audit.result.findings)) == 1
    assert sorted({round(contact.onset_s) for contact in audit.result.contacts}) == [8, 25]
    assert audit.result.verdict == "fail"


@pytest.mark.parametrize("scenario", ["free-hits", "polish-sine"])
def test_pushes_are_no_hand_guiding(made: Maker, friction_of: Fitted, robot: str, scenario: str) -> None:
    files = made(scenario, robot)
    friction = friction_of(robot)
    assert looked_at(api.prepare(files.log, load_config(files.config), friction), files, friction) == []


def test_clamps_and_long_pushes_of_any_size_are_no_hand_guiding(made: Maker, friction_of: Fitted, robot: str) -> None:
    files = made("hand-guided", robot)
    friction, rng = friction_of(robot), np.random.default_rng(4)
    clean = api.prepare(files.log, load_config(files.config), friction)
    (own,) = looked_at(clean, files, friction)
    torque = np.array([law.torque(np.array([0.3]))[0] for law in laws_of(clean, files, friction)])
    for _ in range(40):
        size = rng.uniform(0.3, 6.0) * torque * rng.choice([-1.0, 1.0], torque.size)
        size[rng.integers(1, torque.size + 1) :] = 0.0
        start, length = rng.uniform(1.5, 8.0), rng.uniform(0.5, 3.0)
        assert looked_at(pushed(clean, start, length, size), files, friction) == [own], (size, start, length)


@pytest.mark.parametrize("lag_s", [0.3, 1.0])
def test_drives_that_are_logged_late_are_no_hand_guiding_and_said(
    made: Maker, friction_of: Fitted, robot: str, lag_s: float
) -> None:
    files = made("free-clean", robot, duration_s=30.0)
    friction = friction_of(robot)
    clean = api.prepare(files.log, load_config(files.config), friction)
    series = clean.series
    assert series.effort is not None
    known = np.isfinite(series.effort).all(axis=1)
    share = series.period_s / lag_s
    slow = np.full_like(series.effort, np.nan)
    slow[known] = lfilter([share], [1.0, share - 1.0], series.effort[known] - series.effort[known][0], axis=0)
    slow[known] += series.effort[known][0]
    late = replace(clean, series=replace(series, effort=slow))
    assert looked_at(late, files, friction) == []
    config = load_config(files.config).config
    laws = {joint: law.torque for joint, law in applied_friction(clean, friction, config).laws.items()}
    assert not any(one.shown for one in with_effort_smoothing(clean, laws).effort_smoothing.values())
    said = with_effort_smoothing(late, laws)
    for one in said.effort_smoothing.values():
        assert one.low_s < lag_s
        assert erf(0.1 / (np.sqrt(2.0) * one.high_s)) < 1.1 * (1.0 - np.exp(-0.2 / lag_s))  # of a push of 0.2 s
    (one,) = (f for f in said.findings if f.code == "effort-filtered")
    assert one.effect == "excludes"


def test_a_fit_leaves_it_out(made: Maker, robot: str) -> None:
    files = made("hand-guided", robot)
    ((start, end),) = read_truth(files.truth)["fault"]["spans_s"]
    settings = load_config(files.config)
    prepared = api.prepare(files.log, settings)
    left, (said,) = fitted_without_guiding(prepared, settings.config)
    assert said.code == "fit-left-out"
    assert start - 0.2 < (said.start_s or 0.0) < start + 1.0
    assert end - 4.0 < (said.end_s or 0.0) < end + 0.2
    assert left.series.effort is not None
    unknown = np.isnan(left.series.effort).all(axis=1)
    assert unknown[(prepared.series.time_s > start + 1.0) & (prepared.series.time_s < end - 4.0)].all()
    assert not unknown[(prepared.series.time_s > 2.0) & (prepared.series.time_s < start - 0.2)].any()


def test_clean_motion_is_fitted_whole(made: Maker, robot: str) -> None:
    for scenario in ("free-clean", "stop-go"):
        files = made(scenario, robot, duration_s=30.0)
        settings = load_config(files.config)
        assert fitted_without_guiding(api.prepare(files.log, settings), settings.config)[1] == ()


def laws_of(prepared: Prepared, files: SimulatedFiles, friction: FrictionFile) -> list:  # type: ignore[type-arg]
    laws = applied_friction(prepared, friction, load_config(files.config).config).laws
    return [laws[joint] for joint in prepared.series.joint_names]
