"""Units and signs switched, and weights picked up, in the middle of a log: told with their time, and only then."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from collaudit.core import api
from collaudit.core.arm_states.payload_step import _joints_agree
from collaudit.core.arm_states.switched_effort import _moment
from collaudit.core.config import load_config
from collaudit.core.config.schema import Config
from collaudit.core.findings import Finding
from collaudit.core.prepare.preparation import modelled
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.torque_table.block_sums import products_of
from collaudit.fixtures.compare import read_truth
from collaudit.fixtures.simulation import SimulatedFiles

Maker = Callable[..., SimulatedFiles]
CODES = ("effort-switched", "payload-changed")


def found(files: SimulatedFiles) -> list[Finding]:
    prepared = api.prepare(files.log, load_config(files.config))
    return [finding for finding in prepared.findings if finding.code in CODES]


def test_a_switched_unit_is_told_of_the_whole_arm(made: Maker, robot: str) -> None:
    files = made("faulty-unit-switch", robot, duration_s=20.0)
    (finding,) = found(files)
    assert finding.joint is None
    assert finding.effect == "not-judged-joint"
    assert finding.start_s == pytest.approx(read_truth(files.truth)["fault"]["from_s"], abs=0.1)


def test_a_switched_sign_is_told_of_its_joint(made: Maker, robot: str) -> None:
    files = made("faulty-sign-switch", robot, duration_s=20.0)
    fault = read_truth(files.truth)["fault"]
    (finding,) = found(files)
    assert finding.joint == fault["joint"]
    assert finding.start_s == pytest.approx(fault["from_s"], abs=0.1)


def test_a_payload_is_told_with_its_mass(made: Maker, robot: str) -> None:
    files = made("faulty-payload", robot, duration_s=20.0)
    fault = read_truth(files.truth)["fault"]
    (finding,) = found(files)
    assert finding.code == "payload-changed"
    assert finding.forbids_pass
    assert finding.start_s == pytest.approx(fault["from_s"], abs=1.1)
    told = float(finding.text.split("gains ")[1].split(" kg")[0])
    assert told == pytest.approx(fault["mass_kg"], rel=0.1)
    assert told == pytest.approx(fault["mass_kg"], abs=float(finding.text.split("(± ")[1].split(" kg")[0]))


@pytest.mark.parametrize(("mass_kg", "lasting_s", "times"), [(1.5, 4.0, 9), (0.1, 4.0, 0), (12.0, 0.25, 0)])
def test_a_load_that_comes_and_goes_is_told_with_its_mass(
    made: Maker, robot: str, mass_kg: float, lasting_s: float, times: int
) -> None:
    """Carried for four of every eight seconds; neither what is too light to tell is told, nor pushes of 120 N."""
    files = made("free-clean", robot, duration_s=40.0)
    settings = load_config(files.config)
    prepared = api.prepare(files.log, settings)
    series, arm = prepared.series, prepared.robot
    assert series.effort is not None
    frame = arm.frame_names[-1]
    weight = np.zeros((series.time_s.size, 6))
    weight[:, :3] = -mass_kg * arm.gravity_in(series.position_rad, frame)
    carried = ((series.time_s + lasting_s) % 8.0 < lasting_s)[:, None]
    effort = series.effort + np.where(carried, arm.wrench_torque(series.position_rad, weight, frame), 0.0)
    told = [f for f in with_effort(prepared, effort, settings.config).findings if f.code.startswith("payload")]
    assert [(f.code, f.severity) for f in told] == [("payload-changed", "warning")] * bool(times)
    for finding in told:
        assert f"changes {times} times" in finding.text and not finding.forbids_pass
        said, half = (float(finding.text.split(mark)[1].split(" kg")[0]) for mark in (", by ", "(± "))
        assert said == pytest.approx(mass_kg, abs=max(half, 0.1 * mass_kg))


@pytest.mark.parametrize(("scenario", "more"), [("stop-go", {"duration_s": 30.0}), ("polish-sine", {"seed": 2})])
def test_ordinary_runs_change_nothing(made: Maker, robot: str, scenario: str, more: dict[str, object]) -> None:
    assert found(made(scenario, robot, **more)) == []


def test_an_effort_inverted_from_the_start_is_no_payload(made: Maker, robot: str) -> None:
    files = made("free-clean", robot, duration_s=30.0)
    settings = load_config(files.config)
    prepared = api.prepare(files.log, settings)
    series, told = prepared.series, prepared.series.joint_names[1]
    assert series.effort is not None
    turned = series.effort * np.where(np.array(series.joint_names) == told, -1.0, 1.0)
    again = with_effort(prepared, turned, settings.config)
    assert "effort-sign-inverted" in {finding.code for finding in again.findings}
    assert [finding for finding in again.findings if finding.code in CODES] == []


def test_a_dead_effort_is_no_payload_and_hides_none(made: Maker, robot: str) -> None:
    for scenario, codes in (("free-clean", []), ("faulty-payload", ["payload-changed"])):
        files = made(scenario, robot, duration_s=20.0)
        settings = load_config(files.config)
        prepared = api.prepare(files.log, settings)
        assert prepared.series.effort is not None
        dead = prepared.series.effort.copy()
        dead[:, 2] = 0.0
        again = with_effort(prepared, dead, settings.config)
        assert [finding.code for finding in again.findings if finding.code in CODES] == codes
        assert not [finding for finding in again.findings if finding.code.startswith("arm-")]


def test_an_effort_unknown_at_the_end_of_a_short_log_leaves_no_room_for_a_payload(made: Maker, robot: str) -> None:
    files = made("free-clean", robot, duration_s=10.0)
    settings = load_config(files.config)
    prepared = api.prepare(files.log, settings)
    assert prepared.series.effort is not None
    lost = prepared.series.effort.copy()
    lost[prepared.series.time_s > 6.5] = np.nan
    again = with_effort(prepared, lost, settings.config)
    assert [finding.code for finding in again.findings if finding.code in CODES] == []


def with_effort(prepared: Prepared, effort: np.ndarray, config: Config) -> Prepared:
    """The log with another effort, (n, j) in model order."""
    start = replace(prepared.start, series=replace(prepared.start.series, effort=effort))
    return modelled(start, config, prepared.calibration)


def test_a_wrong_model_is_no_payload(made: Maker, robot: str) -> None:
    assert found(made("free-clean", robot, duration_s=20.0, mismatch_percent=10.0)) == []


def _turning(kind: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Stamps, effort and velocity about a moment, at 3 s, from which on two gains of opposite signs fit best."""
    t = 0.002 * np.arange(3000)
    noise = np.random.default_rng(0).normal(0, 0.1, t.size)
    velocity = 0.3 * np.cos(0.4 * t)
    if kind == "turned":
        return t, 4.0 * np.sign(3.0 - t + 1e-9) + noise, velocity
    if kind == "turned at rest":
        return t, 4.0 * np.sign(3.0 - t + 1e-9) + noise, np.zeros_like(t)
    if kind == "lost":
        gap = np.delete(np.arange(t.size), np.arange(1450, 1550))
        return t[gap], 0.4 * (3.0 - t[gap]) + noise[gap], velocity[gap]
    if kind == "passes through zero":
        return t, 4.0 * (3.0 - t) + noise, velocity
    if kind == "reverses":
        velocity = 0.5 * (3.0 - t)
        return t, 2.0 * np.tanh(velocity / 0.002) + noise, velocity
    velocity = -np.clip(t - 3.0, 0.0, 0.5)  # starts, against the friction that held it
    return t, 2.0 * np.where(velocity < -0.005, -1.0, 1.0) + noise, velocity


@pytest.mark.parametrize(
    ("kind", "turns"),
    [
        ("turned", True), ("turned at rest", True), ("lost", True),
        ("passes through zero", False), ("reverses", False), ("starts", False),
    ],
)  # fmt: skip
def test_a_sign_turns_at_once_and_not_with_the_motion(kind: str, turns: bool) -> None:
    found = _moment(*_turning(kind), 3.3)
    assert (found is not None) is turns
    assert found is None or found == pytest.approx(3.3 if kind == "lost" else 3.0, abs=0.01)


@pytest.mark.parametrize(("per_joint", "agree"), [((2.0, 2.2, 1.8), True), ((2.0, 0.1, -0.2), False), ((2.0,), True)])
def test_a_weight_is_the_same_on_all_joints_that_tell_it(per_joint: tuple[float, ...], agree: bool) -> None:
    rng, count = np.random.default_rng(1), 800
    block = np.arange(count) // 40
    velocity = np.sin(np.arange(count)[:, None] * (0.05 + 0.01 * np.arange(len(per_joint))))
    per_kg = 3.0 * np.cos(np.arange(count)[:, None] * (0.03 + 0.004 * np.arange(len(per_joint))))
    after = np.arange(count) >= 400
    beside = per_kg * after[:, None] * np.array(per_joint) + np.sign(velocity) + rng.normal(0, 0.2, per_kg.shape)
    columns = np.stack([np.sign(velocity), velocity, np.ones_like(velocity), per_kg, beside], axis=2)
    assert _joints_agree(products_of(columns, block), after[::40], 2.0) is agree
