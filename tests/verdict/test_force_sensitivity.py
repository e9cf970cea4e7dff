"""The smallest force that would have alarmed, against levers whose answer is known by hand."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from arms import LEVEL, dh_robot, dh_row

from collaudit.core.config.schema import Config
from collaudit.core.data.sensitivity_result import NoticedForce
from collaudit.core.robot.arm_places import RequiredForce, arm_places, directions
from collaudit.core.robot.robot_building import build_robot
from collaudit.core.robot.robot_model import RobotModel
from collaudit.core.verdict.sensitivity import Moments, level_at, longest_unseen, noticed_forces

K = 100


def planar(*lengths: float) -> RobotModel:
    """An arm whose joints all turn about z: it feels nothing along z."""
    rows = [dh_row(4.0, (0, 0, 0), (0, 0, 0.05), a=length) for length in lengths]
    cfg = Config.of({"robot": dh_robot(rows, **LEVEL)})
    return build_robot(cfg.robot, Path(), tuple(f"joint{k + 1}" for k in range(len(lengths))))


def moments(
    q: tuple[float, ...], noticed: tuple[float, ...], watched: tuple[bool, ...] | None = None, lost_s: float = 0.0
) -> Moments:
    """One pose, held for ten seconds, with what each joint would have noticed."""
    tile = np.tile
    return Moments(
        0.1 * np.arange(K),
        tile(q, (K, 1)).astype(float),
        tile(noticed, (K, 1)).astype(float),
        tile(watched or (True,) * len(q), (K, 1)),
        10.0,
        lost_s,
    )


def force(robot: RobotModel, at: Moments, place: str = "tool", asked_n: float | None = None) -> NoticedForce:
    asked = {} if asked_n is None else {place: RequiredForce(asked_n, "stated")}
    (found,) = [
        f
        for f in noticed_forces(robot, arm_places(robot, robot.joint_names, None), at, at, asked, 0.9)
        if f.place == place
    ]
    return found


def by_hand(levers: list[np.ndarray], noticed: list[float], least: float) -> float:
    """Force that alarms from 80 % of the directions that load a joint, over a million random directions."""
    d = np.random.default_rng(3).normal(size=(1_000_000, 3))
    d /= np.linalg.norm(d, axis=1)[:, None]
    arms = np.abs(d @ np.array(levers).T)
    with np.errstate(divide="ignore"):
        needed = np.where(arms > least, np.array(noticed) / arms, np.inf).min(axis=1)
    return float(np.quantile(needed[(arms > least).any(axis=1)], 0.8))


def test_directions_are_spread_evenly() -> None:
    d = directions()
    assert np.allclose(np.linalg.norm(d, axis=0), 1.0)
    assert np.allclose(d @ d.T / d.shape[1], np.eye(3) / 3, atol=0.01)


def test_a_lever_feels_what_acts_across_it() -> None:
    """f·a·|y| of a force f in a direction whose share |y| across the lever is evenly spread over 0 to 1.

    A twentieth of the directions loads the joint too little to count; of the others 80 % have |y| >= 0.24.
    """
    tool = force(planar(0.4), moments((0.3,), (4.0,)))
    assert tool.joints == ("joint1",)
    assert tool.at(0.9) == pytest.approx(4.0 / (0.4 * 0.24), rel=0.07)
    assert tool.unfelt == pytest.approx(0.05, abs=0.02)
    assert force(planar(0.4), moments((0.3,), (8.0,))).at(0.5) == pytest.approx(2 * (tool.at(0.5) or 0.0))


@pytest.mark.parametrize(("noticed", "bend"), [((4.0, 2.0), np.pi / 2), ((4.0, 0.3), 0.5), ((1.0, 5.0), 2.5)])
def test_two_links_in_a_plane(noticed: tuple[float, float], bend: float) -> None:
    """J_v of the tool by hand: z x r from each joint's axis to the tool, in any turned frame."""
    first, second = 0.4 * np.array([1.0, 0, 0]), 0.3 * np.array([np.cos(bend), np.sin(bend), 0])
    z = np.array([0.0, 0, 1])
    levers = [np.cross(z, first + second), np.cross(z, second)]
    least = 0.05 * max(np.linalg.norm(lever) for lever in levers)
    found = force(planar(0.4, 0.3), moments((0.7, bend), noticed))
    assert found.at(0.9) == pytest.approx(by_hand(levers, list(noticed), least), rel=0.03)


@pytest.mark.parametrize("asked_n", [15.0, 40.0])
def test_the_share_of_directions_that_alarm(asked_n: float) -> None:
    """One lever of 0.5 m that alarms from 5 N·m on: at F·0.5·|y| >= 5, of |y| evenly spread over 0 to 1."""
    asked = force(planar(0.5), moments((0.3,), (5.0,)), asked_n=asked_n).asked
    assert asked is not None
    assert asked.directions == pytest.approx(1.0 - 10.0 / asked_n, abs=0.02)


def test_no_joint_beyond_a_place_counts() -> None:
    robot = planar(0.4, 0.3)
    blind_outer, both = (moments((0.2, 0.4), (4.0, s)) for s in (np.inf, 0.1))
    assert force(robot, blind_outer, "link1").levels == force(robot, both, "link1").levels
    assert force(robot, both, "link1").joints == ("joint1",)
    assert (force(robot, both).at(0.5) or 0.0) < 0.2 * (force(robot, blind_outer).at(0.5) or 0.0)


def test_time_in_which_nothing_can_be_told_is_not_noticed() -> None:
    robot, at = planar(0.4), moments((0.3,), (4.0,))
    at.noticed_nm[::5] = np.inf
    tool = force(robot, at, asked_n=100.0)
    assert tool.at(0.5) == pytest.approx(4.0 / (0.4 * 0.24), rel=0.07)
    assert tool.at(0.9) is None
    assert tool.asked is not None
    assert (tool.asked.share, tool.asked.limited_by) == (0.8, None)
    assert tool.asked.unnoticed_s == pytest.approx(2.0) and tool.asked.noticed_s == pytest.approx(8.0)
    gap = force(robot, moments((0.3,), (4.0,), lost_s=2.5), asked_n=100.0)
    assert gap.at(0.95) is None
    assert gap.asked is not None and gap.asked.share == pytest.approx(0.8)


def test_the_joint_that_limits_is_named() -> None:
    """Stretched out, both joints feel the same directions: joint 1 on the longer lever, at ten times the threshold."""
    found = force(planar(0.4, 0.3), moments((0.0, 0.0), (100.0, 10.0)), asked_n=50.0)
    assert found.asked is not None
    assert (found.asked.share, found.asked.limited_by) == (0.0, "joint2")
    assert found.asked.longest_unnoticed_s == pytest.approx(9.9)


def test_directions_that_no_watched_joint_feels_are_told_and_not_asked_for() -> None:
    """Only joint 2 is watched, and the arm is stretched out towards it: 80 % of what it feels is near its lever."""
    robot, both = planar(0.4, 0.1), moments((0.0, 0.0), (4.0, 1.0))
    inner = moments((0.0, 0.0), (4.0, 1.0), (False, True))
    assert force(robot, both).unfelt == pytest.approx(0.05, abs=0.02)
    found = force(robot, inner, asked_n=100.0)
    assert found.joints == ("joint2",)
    assert found.unfelt == pytest.approx(0.05 * 0.5 / 0.1, abs=0.02), "a lever of a tenth, less than 2.5 cm of it"
    assert found.asked is not None and found.asked.share == 1.0
    nobody = force(robot, moments((0.0, 0.0), (4.0, 1.0), (False, False)), asked_n=100.0)
    assert (nobody.joints, nobody.unfelt, nobody.asked, nobody.at(0.5)) == ((), 1.0, None, None)


def test_a_moment_without_a_watched_joint_is_not_counted() -> None:
    at = moments((0.3,), (4.0,))
    at.watched[::2] = False
    at.noticed_nm[::2] = np.inf
    found = force(planar(0.4), at, asked_n=100.0)
    assert found.asked is not None and found.asked.share == 1.0
    assert found.unfelt == pytest.approx(0.525, abs=0.01)


def test_unknown_values_exceed_every_level() -> None:
    known = np.array([3.0, 1.0, 2.0])
    assert level_at(known, 4, (0.25, 0.5, 0.75, 0.76, 1.0)) == [1.0, 2.0, 3.0, None, None]
    assert level_at(known[:0], 4, (0.5,)) == [None]


def test_the_longest_time_unseen_is_from_one_seen_moment_to_the_next() -> None:
    t = np.arange(6.0)
    assert longest_unseen(t, np.array([1, 0, 0, 1, 0, 1], dtype=bool)) == 3.0
    assert longest_unseen(t, np.zeros(6, dtype=bool)) == 5.0
    assert longest_unseen(t, np.ones(6, dtype=bool)) == longest_unseen(t[:0], np.ones(0, dtype=bool)) == 0.0
