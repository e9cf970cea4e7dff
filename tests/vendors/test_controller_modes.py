"""The modes of controllers: every state that a number or a word stands for says whether it is judged."""

from __future__ import annotations

from collaudit.core.vendors.vendor_words import FRANKA_MODE, MODE_WORDS, UR_ROBOT_MODE, UR_SAFETY_MODE, state_of


def test_every_state_is_one_of_a_kind() -> None:
    assert {state_of(state) for state in UR_SAFETY_MODE.values()} == {"stopped"}
    assert {number: state_of(state) for number, state in UR_ROBOT_MODE.items()} == {
        3: "off", 4: "off", 5: "off", 6: "guided"
    }  # fmt: skip
    assert {number: state_of(state) for number, state in FRANKA_MODE.items()} == {
        3: "guided", 4: "stopped", 5: "stopped"
    }  # fmt: skip
    assert all(state_of(state) is not None for state in MODE_WORDS.values())
