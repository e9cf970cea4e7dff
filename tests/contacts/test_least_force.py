"""The least force of a contact: no force at a point of the arm may give more torque than its lever arm allows."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np

from collaudit.core.contacts.contact_scene import ArmAtSamples
from collaudit.core.contacts.external_force import SURFACE_M, longest_levers, with_least
from collaudit.core.data.detection_result import ContactForce, LeastForce, LinkForce
from collaudit.fixtures.arms import robot_named
from collaudit.reports.values.first_words import force_text


def test_no_force_on_the_arm_turns_a_joint_by_more_than_its_longest_lever() -> None:
    """Unit forces in all directions, at the outer frames and within the surface's distance of them."""
    robot = robot_named("paper6").model()
    assert robot.bodies is not None
    rng = np.random.default_rng(3)
    for _ in range(5):
        q = rng.uniform(-2.0, 2.0, 6)
        log = SimpleNamespace(
            robot=robot, judged=(), phases=np.zeros(1), series=SimpleNamespace(position_rad=q[None, :])
        )
        levers = longest_levers(ArmAtSamples(log, [0]), 0)  # type: ignore[arg-type]
        most = np.zeros(6)
        for frame in robot.bodies.frame_names:
            if robot.bodies.frame_joint(frame) is None:
                continue
            force, offset = (x / np.linalg.norm(x, axis=1)[:, None] for x in rng.normal(size=(2, 400, 3)))
            wrench = np.hstack([force, np.cross(SURFACE_M * offset, force)])
            torque = robot.wrench_torque(np.repeat(q[None, :], 400, axis=0), wrench, frame)
            most = np.maximum(most, np.abs(torque).max(axis=0))
        assert (most <= levers + 1e-9).all()
        assert (most > 0.85 * levers).all(), "a bound that no force comes near is no use"


def test_where_no_interval_is_known_the_least_force_is_said() -> None:
    least = LeastForce(23.9, "joint1", 0.5)
    one = ContactForce("link", None, (2.0, None, None), None, (0.0, None), ((0.0, 1.0, 0.0),), 0.0)
    assert force_text(None, least) == "at least 23 N"
    assert force_text(one, least) == "at least 23 N", "what is blind has no upper end"
    assert force_text(None, LeastForce(0.4, "joint1", 0.5)) == "unknown"


def test_a_force_has_one_lower_bound() -> None:
    """25 N whose 12 N·m need 18 N at least: 5 to 14 N is no interval of it, and 5 to 40 N is 18 to 40 N."""
    least = LeastForce(18.0, "joint1", 0.64)
    force = ContactForce("link", (9.0, 0.0, 0.0), (2.0, 2.0, 2.0), 9.0, (5.0, 40.0), (), 0.1)
    assert with_least(force, None) is force and with_least(None, least) is None
    wide = with_least(force, least)
    assert wide is not None and wide.size_ci95_n == (18.0, 40.0)
    assert with_least(replace(force, size_ci95_n=(5.0, 14.0)), least) is None
    high = replace(force, size_ci95_n=(20.0, 40.0))
    assert with_least(high, least) == high
    links = (
        LinkForce("a", "joint1", 5.0, None),
        LinkForce("b", "joint2", 5.0, 14.0),
        LinkForce("c", "joint3", 20.0, 40.0),
    )
    bound = with_least(replace(high, links=links), least)
    assert bound is not None and bound.links == (LinkForce("a", "joint1", 18.0, None), links[2])
