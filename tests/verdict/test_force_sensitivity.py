"""The smallest force that would have alarmed, against a lever whose answer is known by hand."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from arms import LEVEL, dh_robot, dh_row
from synthetic import PERIOD, make_log

from collaudit.core.config.schema import Config
from collaudit.core.prepare.prepared import Prepared, prepare
from collaudit.core.robot import load_robot
from collaudit.core.verdict.force_sensitivity import directions, force_sensitivities


def prepared(*lengths: float) -> Prepared:
    rows = [dh_row(4.0, (0, 0, 0), (0, 0, 0.05), a=length) for length in lengths]
    cfg = Config.of({"robot": dh_robot(rows, **LEVEL)})
    t = PERIOD * np.arange(2000)
    q = np.column_stack([0.3 * np.sin(t + k) for k in range(len(lengths))])
    names = tuple(f"joint{k + 1}" for k in range(len(lengths)))
    log = make_log(t, q, np.gradient(q, PERIOD, axis=0), np.zeros_like(q), names)
    return prepare(log, load_robot(cfg.robot, Path(), names), cfg)


def levels(found: Any, share: float) -> tuple[float | None, float | None]:
    (level,) = [level for level in found.levels if level.share == share]
    return level.force_n, level.typical_n


def test_directions_are_spread_evenly() -> None:
    d = directions()
    assert np.allclose(np.linalg.norm(d, axis=0), 1.0)
    assert np.allclose(d @ d.T / d.shape[1], np.eye(3) / 3, atol=0.01)


def test_a_lever_feels_what_acts_across_it() -> None:
    """Torque a·f·|y| of a force f in a direction whose share |y| across the lever is evenly spread over 0 to 1."""
    log = prepared(0.4)
    samples = np.arange(100, 1900, 18)
    (tool,) = force_sensitivities(log, np.full((samples.size, 1), 4.0), samples, None)
    assert tool.joints == ("joint1",)
    most, half = levels(tool, 0.95)
    assert half == pytest.approx(4.0 / (0.4 * 0.5), rel=0.05)
    assert most == pytest.approx(4.0 / (0.4 * 0.05), rel=0.25)
    (own,) = force_sensitivities(log, np.full((samples.size, 1), 8.0), samples, None)
    assert levels(own, 0.5)[1] == pytest.approx(2 * half)


def test_the_best_joint_counts_and_none_beyond_the_place() -> None:
    log = prepared(0.4, 0.3)
    samples = np.arange(100, 1900, 18)
    blind_outer = np.tile([4.0, np.inf], (samples.size, 1))
    both = np.tile([4.0, 0.1], (samples.size, 1))
    (link, tool), (same, better) = (force_sensitivities(log, x, samples, None) for x in (blind_outer, both))
    assert (link.place, tool.place) == ("end of link1", "tool")
    assert link.joints == ("joint1",)
    assert levels(link, 0.95) == levels(same, 0.95), "joint 2 does not feel what acts at its axis"
    assert levels(link, 0.95)[1] == pytest.approx(20.0, rel=0.05)
    assert levels(better, 0.95)[1] < 0.2 * levels(tool, 0.95)[1]


def test_time_in_which_nothing_can_be_told_is_no_sensitivity() -> None:
    log = prepared(0.4)
    samples = np.arange(100, 1900, 18)
    level = np.full((samples.size, 1), 4.0)
    level[::5] = np.inf
    (tool,) = force_sensitivities(log, level, samples, None)
    assert levels(tool, 0.8)[1] == pytest.approx(20.0, rel=0.05)
    assert levels(tool, 0.95) == (None, None)
