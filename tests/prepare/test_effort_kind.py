"""An effort from which the controller took gravity: told from the data, judged alike, never guessed in silence."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from origins import NOBODY

from collaudit.core.api import load_robot, open_log
from collaudit.core.audit import audit_log
from collaudit.core.config import load_config
from collaudit.core.data.audit_result import AuditResult, FrictionFile
from collaudit.core.data.joint_log import JointLog
from collaudit.core.numeric.arrays import frozen
from collaudit.core.prepare.calibration import Calibration
from collaudit.core.prepare.preparation import prepare

KINDS = ("motor-torque", "gravity-compensated")


@pytest.fixture(scope="module")
def log(hits: Path) -> JointLog:
    """At half of its rate."""
    return open_log((hits,), load_config(hits.with_suffix(".toml"))).samples(slice(None, None, 2))


@pytest.fixture(scope="module")
def gravity(hits: Path, log: JointLog) -> np.ndarray:
    robot = load_robot(load_config(hits.with_suffix(".toml")), log.joint_names)
    assert log.joint_names == robot.joint_names
    return robot.gravity_torque(log.position_rad)


def settled(hits: Path, log: JointLog, effort: np.ndarray, **stated: str) -> object:
    loaded = load_config(hits.with_suffix(".toml"), {f"log.{key}": value for key, value in stated.items()})
    return prepare(replace(log, effort=frozen(effort)), load_robot(loaded, log.joint_names), loaded.config)


def test_it_is_told_from_gravity_and_inertia_together(hits: Path, log: JointLog, gravity: np.ndarray) -> None:
    effort = log.effort
    constants = np.linspace(14.0, 6.0, effort.shape[1])
    for other, seen in (
        (effort - gravity, "seen"),
        (effort - 0.9 * gravity, "seen"),
        (effort, "no"),
        (-effort, "no"),
        (effort / constants, "no"),
        (effort - 0.5 * gravity, "no"),
        (np.random.default_rng(1).normal(size=effort.shape), "no"),
    ):
        prepared = settled(hits, log, other)
        assert prepared.start.effort_kind.compensated == seen
        forbidding = [f for f in prepared.findings if f.code == "effort-no-torque" and f.forbids_pass]
        assert any('effort_kind = "gravity-compensated"' in f.text for f in forbidding) == (seen == "seen")


def test_an_estimate_of_external_torque_is_never_judged(hits: Path, log: JointLog) -> None:
    prepared = settled(hits, log, log.effort, effort_kind="external")
    assert any(f.effect == "not-judged-log" for f in prepared.findings)


def test_the_same_contacts_are_found(hits: Path, log: JointLog, gravity: np.ndarray, friction: FrictionFile) -> None:
    def judged(kind: str, effort: np.ndarray) -> AuditResult:
        loaded = load_config(hits.with_suffix(".toml"), {"log.effort_kind": kind})
        known = Calibration.of(friction, loaded.config)
        robot = load_robot(loaded, log.joint_names)
        prepared = prepare(replace(log, effort=frozen(effort)), robot, loaded.config, known)
        return audit_log(prepared, loaded.config, friction, NOBODY, siblings=None).result

    plain, compensated = (judged(k, e) for k, e in zip(KINDS, (log.effort, log.effort - gravity), strict=True))
    assert len(plain.contacts) > 5
    assert plain.verdict == compensated.verdict
    assert [c.joints for c in compensated.contacts] == [c.joints for c in plain.contacts]
    np.testing.assert_allclose(
        [c.onset_s for c in compensated.contacts], [c.onset_s for c in plain.contacts], atol=0.02
    )
    assert not [f for f in compensated.findings if f.code in ("effort-kind", "effort-no-torque", "effort-gain")]


@pytest.mark.parametrize("siblings", [1.0, -1.0, 40.0])
def test_magnitudes_are_not_judged_and_no_sign_is_advised(hits: Path, log: JointLog, siblings: float) -> None:
    """Positive, negative, and in another unit: what a servo says of its current."""
    found = settled(hits, log, siblings * np.abs(log.effort)).findings
    (said,) = [f for f in found if f.effect == "not-judged-log"]
    assert "its sign is lost" in said.text
    assert not [f for f in found if f.code.startswith("effort-sign")]


def test_a_torque_that_gravity_keeps_on_one_side_is_no_magnitude(hits: Path, log: JointLog) -> None:
    for effort in (log.effort, -log.effort, log.effort + 2.0 * np.abs(log.effort).max(axis=0)):
        assert not [f for f in settled(hits, log, effort).findings if "its sign is lost" in f.text]
