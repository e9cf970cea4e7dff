"""A torque by one joint's angle: found where there is one, known with its interval, carried to the judged log."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from identified import identify
from three_joints import arm, log_of, settings

from collaudit.core.data.joint_log import JointLog
from collaudit.core.identification.estimate_choice import choose
from collaudit.core.prepare.calibration import Calibration, calibrated_series, spring_findings
from collaudit.core.prepare.preparation import prepare
from collaudit.core.prepare.prepared import Prepared

CONFIG = settings()
ASKED = CONFIG.changed({"fit": CONFIG.fit.changed({"estimate": ["friction", "rotor", "spring"]})})
#: A counterbalance of joint 2: a spring on a lever, 60 N·m at its strongest.
STIFF, LEVER = 60.0, 0.4


def counterbalance(angle: np.ndarray) -> np.ndarray:
    return np.asarray(STIFF * np.sin(angle + LEVER) / np.sqrt(1.25 + np.cos(angle + LEVER)))


def sprung(log: JointLog) -> JointLog:
    assert log.effort is not None
    effort = log.effort.copy()
    effort[:, 1] += counterbalance(log.position_rad[:, 1])
    return replace(log, effort=effort)


def of(log: JointLog) -> Prepared:
    return prepare(log, arm(CONFIG), CONFIG)


def test_a_spring_is_found_by_held_out_error_and_only_where_it_is() -> None:
    truth, config = arm(CONFIG), CONFIG.changed({"fit": CONFIG.fit.changed({"estimate": "auto"})})
    with_none, choice = choose([of(log_of(truth, np.ones(3), seed=3))], config)
    assert "spring" not in with_none.estimate and choice is not None
    log = of(sprung(log_of(truth, np.ones(3), seed=4)))
    taken, choice = choose([log], config)
    assert "spring" in taken.estimate and taken.springs == (1,) and "inertials" not in taken.estimate
    found = identify([log], config, taken)
    assert found is not None and found.joints["joint1"].angle_torque is None


def test_its_interval_holds_and_what_is_left_is_the_noise() -> None:
    """The torque between two angles, of twelve noises; the level itself is the offset's."""
    truth, config = arm(CONFIG), ASKED
    held, width = [], []
    for seed in range(12):
        log = log_of(truth, np.ones(3), seed=seed)
        found = identify([of(sprung(log))], config)
        assert found is not None
        spring = found.joints["joint2"].angle_torque
        assert spring is not None and spring.ci95_nm is not None
        angle = np.array(spring.angle_rad)
        wanted = counterbalance(angle)
        error = np.array(spring.torque_nm) - wanted
        error -= error[1:-1].mean()
        half = np.array([0.5 * (high - low) for low, high in spring.ci95_nm])
        held.append(np.abs(error[1:-1]) <= half[1:-1])
        width.append(half.max())
        if seed < 3:
            without = identify([of(log)], config)
            assert without is not None
            left, plain = (one.joints["joint2"].held_out_rms_nm for one in (found, without))
            assert left == pytest.approx(plain, rel=0.05)
    assert np.mean(held) >= 0.85 and max(width) < 0.1 * STIFF


def test_it_is_taken_out_of_another_log_and_unknown_beyond_its_angles() -> None:
    truth, config = arm(CONFIG), ASKED
    found = identify([of(sprung(log_of(truth, np.ones(3), seed=1)))], config)
    plain, other = of(log_of(truth, np.ones(3), seed=2)), of(sprung(log_of(truth, np.ones(3), seed=2)))
    series = calibrated_series(other.series, Calibration(identified=found))
    assert series.effort is not None and plain.series.effort is not None and found is not None
    rest = series.effort[:, 1] - plain.series.effort[:, 1]
    assert np.nanstd(rest) < 0.01 * STIFF
    spring = found.joints["joint2"].angle_torque
    assert spring is not None and np.isnan(spring.at(np.array([spring.angle_rad[-1] + 0.5])))[0]
    moved = other.series.position_rad.copy()
    moved[:100, 1] = spring.angle_rad[-1] + 0.5
    (told,) = spring_findings(replace(other.series, position_rad=moved), found)
    assert told.joint == "joint2" and f"for {100 * other.series.period_s:.3g} s" in told.text
    assert spring_findings(of(sprung(log_of(truth, np.ones(3), seed=1))).series, found) == []
