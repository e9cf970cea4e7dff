"""The force at a contact: joints without a torque at that moment do not count, and nothing fails for want of them."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from collaudit.core.contacts.contact_scene import ArmAtSamples
from collaudit.core.contacts.external_force import Unsmoothed, estimate_force
from collaudit.core.data.signals import State
from collaudit.fixtures.arms import robot_named


@pytest.mark.parametrize("lost", [(), (1,), (1, 2, 4), (0, 1, 2, 3, 4, 5)])
def test_an_alarm_that_reaches_into_missing_effort(lost: tuple[int, ...]) -> None:
    """Efforts that are held count as missing while an alarm of the same joint goes on."""
    robot = robot_named("paper6").model()
    q, force = np.array([0.3, -1.0, 0.6, 0.4, 0.9, 0.2]), np.array([0.0, 20.0, 30.0])
    series = SimpleNamespace(position_rad=q[None, :])
    log = SimpleNamespace(robot=robot, judged=robot.joint_names, phases=np.zeros(1), series=series)
    at = ArmAtSamples(log, [0])  # type: ignore[arg-type]
    frame = at.links[-1]
    assert frame is not None
    torque = -(at.lever_arms(frame, 0).T @ force)
    torque[list(lost)] = np.nan
    run = SimpleNamespace(detected=SimpleNamespace(state=np.full((1, 6), State.JUDGED, dtype=np.int8)))
    known = Unsmoothed(np.full(6, 0.05), {0: np.repeat(torque[None, :], 3, axis=0)})
    found = estimate_force(at, run, known, robot.joint_names, 0)  # type: ignore[arg-type]
    if len(lost) == 6:
        assert found is None
    else:
        assert found is not None and np.isfinite(found.force_n).all()
        low, high = found.size_ci95_n
        assert low <= np.linalg.norm(force) and (high is None or np.linalg.norm(force) <= high)
        assert found.links[-1].frame == at.links[-1], "a push on the last link turns all joints"
        if not lost:
            assert [link.frame for link in found.links] == [at.links[-1]] and high is not None


def test_a_link_is_no_place_of_a_contact_that_turned_joints_beyond_it() -> None:
    """A push on the last link of which the inner joints alone alarmed: the outer ones' torque says where it was."""
    robot = robot_named("paper6").model()
    q = np.array([0.3, -1.0, 0.6, 0.4, 0.9, 0.2])
    series = SimpleNamespace(position_rad=q[None, :])
    log = SimpleNamespace(robot=robot, judged=robot.joint_names, phases=np.zeros(1), series=series)
    at = ArmAtSamples(log, [0])  # type: ignore[arg-type]
    torque = -(at.lever_arms(at.stick[-1], 0).T @ np.array([0.0, 20.0, 30.0]))
    run = SimpleNamespace(detected=SimpleNamespace(state=np.full((1, 6), State.JUDGED, dtype=np.int8)))
    known = Unsmoothed(np.full(6, 0.05), {0: np.repeat(torque[None, :], 3, axis=0)})
    found = estimate_force(at, run, known, robot.joint_names[:3], 0)  # type: ignore[arg-type]
    assert found is not None
    places = [link.joint for link in found.links]
    assert robot.joint_names[2] not in places and robot.joint_names[5] in places
