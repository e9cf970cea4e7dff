"""Which joint is which: every combination against the truth; what is not sure is asked with the line to add."""

from __future__ import annotations

import itertools
import random

import pytest

from collaudit.core.errors import LogError
from collaudit.core.logs.signals.joint_naming import guess_joints, map_names

UR = ["shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "wrist_2_joint", "wrist_3_joint"]
PANDA = [f"panda_joint{i}" for i in range(1, 8)]
ROBOTS = {
    "ur": UR,
    "panda": PANDA,
    "lbr": [f"A{i}" for i in range(1, 8)],
    "lwr": [f"lwr_arm_{i}_joint" for i in range(7)],
    "plain": [f"joint{i}" for i in range(1, 7)],
    "plain from 0": [f"joint_{i}" for i in range(7)],
    "two": ["swing", "lift"],
}
LOGS = ("fer_joint{}", "joint_{}", "q{}", "Joint {}", "left/a{}/x")


@pytest.mark.parametrize("robot", ROBOTS)
def test_numbered_joints_map_by_order_or_are_asked(robot: str) -> None:
    names = ROBOTS[robot]
    asked = 0
    for form, count, base, seed in itertools.product(LOGS, range(1, 9), (0, 1), range(3)):
        log = [form.format(base + k) for k in range(count)]
        shuffled = random.Random(seed).sample(log, count)
        guess = guess_joints(shuffled, names)
        truth = dict(zip(log, names, strict=False))
        if set(log) == set(names):
            assert guess.sure and not guess.mapping
        elif set(log) & set(names):  # equal names count for themselves unless another numbering explains them too
            assert guess.sure != bool(set(log) - set(names) and set(names) - set(log))
            assert not guess.mapping
        elif count == len(names):
            assert guess.sure and guess.mapping == truth
        else:
            asked += 1
            assert not guess.sure and not guess.mapping and truth in map(dict, guess.candidates.values())
    assert asked


@pytest.mark.parametrize("count", range(1, 9))
@pytest.mark.parametrize("robot", ROBOTS)
def test_numbered_columns_never_map_by_digits(robot: str, count: int) -> None:
    names = ROBOTS[robot]
    columns = [f"joint{k + 1}" for k in range(count)]
    if count == len(names):
        found = map_names(columns, {}, names, "x.csv", numbered=True, columns=True)
        assert (found.log, found.model) == (tuple(columns), tuple(names))
    else:
        with pytest.raises(LogError) as caught:
            map_names(columns, {}, names, "x.csv", numbered=True, columns=True)
        assert f'[log] joint_names = {{ "joint1" = "{names[0]}"' in caught.value.render()


def test_a_gripper_at_the_end_is_no_part_of_the_count() -> None:
    fingers = ["panda_finger_joint1"]
    guess = guess_joints([f"fer_joint{i}" for i in range(1, 8)], PANDA + fingers, fingers)
    assert guess.sure and list(guess.mapping.values()) == PANDA
    assert not guess_joints(["q1", "q2"], ["rail", "a", "b"], ["rail"]).sure


def test_a_gripper_beside_numbered_joints_is_no_part_of_the_count() -> None:
    arm = [f"joint{i}" for i in range(1, 7)]
    for robot in ([*arm, "jointGripper"], [f"z_{name}" for name in arm] + ["finger"]):
        found = map_names(arm, {}, robot, "x.csv", numbered=True, columns=True)
        assert (found.log, found.model) == (tuple(arm), tuple(robot[:6]))
    two_arms = [f"{side}_joint{i}" for side in ("left", "right") for i in range(1, 7)]
    assert not guess_joints(arm, two_arms, numbered=True).sure


def test_names_without_numbers_are_guessed_by_order_and_marked() -> None:
    log = ["Base", "Shoulder", "Elbow", "Wrist 1", "Wrist 2", "Wrist 3"]
    guess = guess_joints(log, UR)
    assert guess.mapping == dict(zip(log, UR, strict=True)) and not guess.sure
    with pytest.raises(LogError, match="none of the log's joints") as caught:
        map_names(log, {}, UR, "x.bag")
    assert '"Wrist 3" = "wrist_3_joint" }' in caught.value.render()
    assert map_names(log, dict(guess.mapping), UR, "x.bag").model == tuple(UR)


def test_whole_words_decide_and_digits_do_not() -> None:
    model = [f"seven_a{i}_joint" for i in range(1, 8)]
    log = ["A7 flange", "A1 base", "A4 elbow", "A2 shoulder", "A6 wrist", "A3 upper", "A5 fore"]
    assert guess_joints(log, model).mapping == {name: f"seven_a{name[1]}_joint" for name in log}
    turned = guess_joints(["elbow", "lift", "pan", "w1", "w2", "w3"], UR)
    assert not turned.mapping and "order" in turned.problem and turned.candidates
    assert guess_joints(["x 3", "y 2", "z 1"], ["wrist_1", "wrist_2", "wrist_3"]).mapping["x 3"] == "wrist_1"


def test_a_prefix_is_the_same_name() -> None:
    log = [f"left_{name}" for name in sorted(UR)]
    assert guess_joints(log, UR).mapping == {f"left_{name}": name for name in UR}
    assert guess_joints(sorted(UR), log).mapping == {name: f"left_{name}" for name in UR}


def test_numberings_that_overlap_are_asked() -> None:
    model = [f"joint_{i}" for i in range(1, 8)]
    guess = guess_joints([f"joint_{i}" for i in range(7)], model)
    assert not guess.sure and not guess.mapping and len(guess.candidates) == 2
    with pytest.raises(LogError) as caught:
        map_names([f"joint_{i}" for i in range(7)], {}, model, "x.mcap")
    assert '"joint_0" = "joint_1"' in caught.value.render()
    assert guess_joints([*model, "gripper_1"], model).sure
    assert guess_joints(model[:5], model).sure  # fewer joints under the robot's own names are simply missing


def test_order_of_a_message_is_asked_where_the_alphabet_differs() -> None:
    columns = [f"joint{i}" for i in range(1, 7)]
    asked = guess_joints(columns, UR, numbered=True, message_order=True)
    assert not asked.sure and asked.candidates["the order of the alphabet"]["joint1"] == "elbow_joint"
    assert guess_joints(columns, ROBOTS["plain"], numbered=True, message_order=True).sure


def test_robots_numbered_against_their_order_are_asked() -> None:
    guess = guess_joints(["q1", "q2", "q3"], ["j3", "j1", "j2"])
    assert not guess.sure and len(guess.candidates) == 2


def test_stated_names_that_the_log_lacks_are_said_where_a_joint_is_missing() -> None:
    log = ["Base", "Shoulder", "Elbow", "Wrist 1", "Wrist 2", "Wrist 3"]
    mapping = dict(zip(log, UR, strict=True))
    wrong = {"Wrist_3" if name == "Wrist 3" else name: joint for name, joint in mapping.items()}
    (missing,) = (f for f in map_names(log, wrong, UR, "x.bag").findings if f.code == "log-joints-missing")
    assert UR[-1] in missing.text and "Wrist_3" in missing.text
    both = {**mapping, "Wrist_3": UR[-1]}  # of another log that the configuration is for, too
    assert not any("Wrist_3" in finding.text for finding in map_names(log, both, UR, "x.bag").findings)
