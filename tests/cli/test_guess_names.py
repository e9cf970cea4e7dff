"""Guessing which joint is which: by order, by number, by likeness, and not at all."""

from collaudit.cli.guess_names import guess_names

UR = ["shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "wrist_2_joint", "wrist_3_joint"]


def _pairs(log: list[str], model: list[str]) -> dict[str, str]:
    return {guess.log: guess.model for guess in guess_names(log, model)}


def test_order_wins_where_names_leave_it_open() -> None:
    log = ["Base", "Shoulder", "Elbow", "Wrist 1", "Wrist 2", "Wrist 3"]
    assert _pairs(log, UR) == dict(zip(log, UR, strict=True))


def test_numbers_win_over_order() -> None:
    model = [f"seven_a{i}_joint" for i in range(1, 8)]
    log = ["A7 flange", "A1 base", "A4 elbow", "A2 shoulder", "A6 wrist", "A3 upper", "A5 fore"]
    assert _pairs(log, model) == {name: f"seven_a{name[1]}_joint" for name in log}


def test_another_prefix() -> None:
    log, model = [f"fer_joint{i}" for i in range(1, 8)], [f"panda_joint{i}" for i in range(1, 8)]
    assert _pairs(log, model) == dict(zip(log, model, strict=True))


def test_equal_names_are_no_guess() -> None:
    assert guess_names(UR, UR) == []
    assert guess_names(list(reversed(UR)), UR) == []


def test_strangers_are_left_alone() -> None:
    assert guess_names([*UR, "gripper_finger_left"], UR) == []
    assert guess_names(["alpha", "beta"], ["wheel_left", "head_yaw", "torso"]) == []
