"""What an arm did after a contact, on simulated logs whose stops are planned and known."""

from __future__ import annotations

from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest

from collaudit.core.data.audit_result import AuditResult, FrictionFile
from collaudit.core.data.detection_result import Contact
from collaudit.fixtures import experiments
from collaudit.fixtures.arms import robot_named
from collaudit.fixtures.compare import audit_simulated
from collaudit.fixtures.pushes import Push
from collaudit.fixtures.simulation import simulate_to
from collaudit.reports.values.words import after_text

ONSETS = (4.0, 9.0, 14.0)
LASTING = (0.25, 0.8, 0.3)
SPEED, BRAKE = 0.7, 4.0


def _planned(robot: object, *_: object) -> experiments.Experiment:
    """Joint 1 sweeps at an even speed; it stops in the first push, goes on in the second, turns back in the third."""
    path = experiments.Path(robot.home)  # type: ignore[attr-defined]
    start = path.end[0]
    path.hold(1.5)
    path.move_joint(0, start - 1.2, SPEED, BRAKE)
    path.hold_until(ONSETS[0] - 0.9)
    path.move_joint(0, start - 1.2 + SPEED * (1.0 - SPEED / BRAKE / 2) + SPEED**2 / BRAKE / 2, SPEED, BRAKE)
    path.hold_until(6.0)
    path.move_joint(0, start - 1.2, SPEED, BRAKE)
    path.hold_until(ONSETS[1] - 0.9)
    path.move_joint(0, start + 1.2, SPEED, BRAKE)
    path.hold_until(ONSETS[2] - 0.9)
    path.move_joint(0, start + 1.2 - SPEED, SPEED, BRAKE)
    path.move_joint(0, start + 1.2, SPEED, BRAKE)
    path.hold_until(18.0)
    pushes = [Push(3, 90.0, "around", at, lasting) for at, lasting in zip(ONSETS, LASTING, strict=True)]
    return experiments.Experiment(*path.sampled(0.02), pushes=tuple(pushes))


@pytest.fixture(scope="module")
def judged(friction: FrictionFile, folder: Path) -> tuple[AuditResult, experiments.Experiment]:
    with patch.object(experiments, "free", _planned):
        files = simulate_to("free-clean", "paper6", 3, "csv", folder / "stops", duration_s=18.0)
    return audit_simulated(files, friction).result, _planned(robot_named("paper6"))


def _contact(result: AuditResult, push: int) -> Contact:
    [found] = [c for c in result.contacts if ONSETS[push] - 0.05 < c.onset_s < ONSETS[push] + LASTING[push]]
    return found


def test_a_stop_is_found_when_and_where_it_was(judged: tuple[AuditResult, experiments.Experiment]) -> None:
    result, planned = judged
    contact = _contact(result, 0)
    after = contact.after
    assert after is not None and after.motion == "stopped"
    speed = np.abs(planned.velocity[:, 0])
    period = experiments.SAMPLE_S
    onset = round(contact.onset_s / period)
    stop = onset + int(np.argmax(speed[onset:] < 0.05 * SPEED))
    slowing = onset + int(np.argmax(speed[onset:] < 0.9 * SPEED))
    assert after.speed_m_s is not None and stop > slowing > onset
    radius = after.speed_m_s / SPEED
    assert after.stopped_s is not None and after.stopping_m is not None
    assert after.stopped_s == pytest.approx((stop - onset) * period, abs=0.03)
    assert after.slowing_s == pytest.approx((slowing - onset) * period, abs=0.03)
    assert after.stopping_m == pytest.approx(radius * period * speed[onset:stop].sum(), rel=0.07)
    assert after.load == "transient" and after.force_s < 0.5
    stopped_ms, way_mm = f"{1e3 * after.stopped_s:.0f} ms", f"{1e3 * after.stopping_m:.0f} mm"
    said = after_text(after)
    assert f"stopped after {stopped_ms} and {way_mm}" in said and "transient" in said


def test_an_arm_that_goes_on_and_presses(judged: tuple[AuditResult, experiments.Experiment]) -> None:
    after = _contact(judged[0], 1).after
    assert after is not None and after.motion == "went on"
    assert after.stopped_s is None and after.stopping_m is None and after.slowing_s is None
    assert "; pressed on (quasi-static, " in after_text(after)
    assert after.load == "quasi-static" and after.force_s == pytest.approx(0.8, abs=0.15)


def test_an_arm_that_turns_back(judged: tuple[AuditResult, experiments.Experiment]) -> None:
    after = _contact(judged[0], 2).after
    assert after is not None and after.motion == "turned back" and after.stopped_s is None
