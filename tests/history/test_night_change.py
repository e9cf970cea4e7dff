"""Whether a value changed over nights: logs of a night are replicates, and what was not tested is no quiet night."""

from __future__ import annotations

import numpy as np
import pytest
from histories import dark_row, history, night, night_row

from collaudit.core.history.night_row import change_of, joint_nights
from collaudit.reports.sections.joint_sections import change_text


def nights(means: list[float], logs: int, seed: int = 0, spread: float = 0.01) -> list[tuple[str, list[float]]]:
    rng = np.random.default_rng(seed)
    return [(night(k), (mean + spread * rng.standard_normal(logs)).tolist()) for k, mean in enumerate(means)]


@pytest.mark.parametrize("means", [[0.426, 0.671], [0.426] * 3 + [0.671] * 2, [0.426] * 9 + [0.671]])
def test_intervals_that_do_not_meet_are_a_change(means: list[float]) -> None:
    found = change_of(nights(means, 9, seed=2), night(len(means) - 1))
    assert (found.state, found.since) == ("changed", night(means.index(0.671)))
    assert found.before and found.now
    assert found.before[1] < 0.426 < found.before[2] < found.now[1] < 0.671 < found.now[2]
    assert "+5" in change_text(found, means) and f"since {night(means.index(0.671))}" in change_text(found, means)


def test_equal_nights_are_called_changed_in_five_of_a_hundred_at_most() -> None:
    """Also where nights differ by themselves, more than their logs do."""
    rng = np.random.default_rng(7)
    called = 0
    for seed in range(300):
        means = (0.5 + 0.03 * rng.standard_normal(12)).tolist()
        called += change_of(nights(means, 5, seed), night(11)).state == "changed"
    assert called <= 0.05 * 300
    same = sum(change_of(nights([0.5, 0.5], 5, seed), night(1)).state == "changed" for seed in range(300))
    assert same <= 0.05 * 300


def test_what_cannot_be_told_is_said() -> None:
    assert change_of(nights([0.4, 0.6], 1), night(1)).state == "too few", "no replicate"
    assert change_of(nights([0.4], 9), night(0)).state == "too few"
    assert change_of(nights([0.4, 0.6], 9), night(2)).state == "not tested"
    assert change_of([], night(2)).state == "not tested"
    assert change_text(change_of([], night(2)), []) == "– (not tested in the last night)"


def test_a_joint_that_was_not_tested_in_the_last_night_says_so() -> None:
    silent = night_row("a", 6, "j2", tested=False, judged_s=0.0, level_nm=None, friction_nm=None, verdict="not_judged")
    found = joint_nights([*history("a", 6, ("j1", "j2")), night_row("a", 6, "j1"), silent, dark_row("a", 6)])
    assert [(one.joint, one.friction.state) for one in found] == [("j1", "no change shown"), ("j2", "not tested")]
