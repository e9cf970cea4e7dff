"""Time that is not judged is looked into: a push under missing positions, between lone rows or behind a mode flag."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from origins import NOBODY
from simulated_logs import Maker

from collaudit.core.api import load_robot, open_log
from collaudit.core.audit import audit_log
from collaudit.core.config import load_config
from collaudit.core.data.audit_result import AuditResult, FrictionFile
from collaudit.core.data.joint_log import Annotation, JointLog
from collaudit.core.prepare.preparation import prepare

AROUND_S = 0.2


@pytest.fixture(scope="module")
def clean(made: Maker) -> Path:
    return made("free-clean", "paper6", 2, duration_s=20.0).log[0]


#: When pushes begin, how long they last, s, and what they load joint 2 and 3 by, N·m: 10 thresholds and more.
TIMES_S, LASTS_S, LOADS_NM = (4.0, 9.0, 14.0), 0.2, (60.0, 45.0)


def around(log: JointLog, margin_s: float = AROUND_S) -> np.ndarray:
    """(n,) samples around the pushes."""
    since = log.time_s - log.time_s[0]
    return np.logical_or.reduce([(since > t - margin_s) & (since < t + LASTS_S + margin_s) for t in TIMES_S])


def pushed(log: JointLog, share: float = 1.0) -> JointLog:
    """The log with pushes against the motion, or so large a share of them."""
    assert log.effort is not None and log.velocity_rad_s is not None
    effort, since = log.effort.copy(), log.time_s - log.time_s[0]
    for t in TIMES_S:
        rows = (since >= t) & (since < t + LASTS_S)
        effort[rows, 1:3] += np.sign(log.velocity_rad_s[rows, 1:3].mean(axis=0)) * np.multiply(share, LOADS_NM)
    return replace(log, effort=effort)


def without_positions(log: JointLog, rows: np.ndarray) -> JointLog:
    position = log.position_rad.copy()
    position[rows] = np.nan
    return replace(log, position_rad=position)


def without_one_position(log: JointLog, rows: np.ndarray) -> JointLog:
    position = log.position_rad.copy()
    position[rows, 1] = np.nan
    return replace(log, position_rad=position)


def thinned(log: JointLog, rows: np.ndarray) -> JointLog:
    return log.samples(~rows | (np.arange(rows.size) % 24 == 0))


SPOILT = {"no position": without_positions, "one position": without_one_position, "thinned": thinned}


def judged(log: JointLog, path: Path, friction: FrictionFile) -> AuditResult:
    loaded = load_config(path.with_suffix(".toml"))
    robot = load_robot(loaded, log.joint_names)
    return audit_log(prepare(log, robot, loaded.config), loaded.config, friction, NOBODY, siblings=None).result


@pytest.mark.parametrize("how", SPOILT)
def test_pushes_in_time_that_is_not_judged_are_no_pass(clean: Path, friction: FrictionFile, how: str) -> None:
    log = open_log(clean, load_config(clean.with_suffix(".toml")))
    found = judged(SPOILT[how](pushed(log), around(log)), clean, friction)
    times = [f.start_s or 0.0 for f in found.findings if f.code == "event-cut"]
    assert found.verdict == "not_judged"
    assert [any(t - AROUND_S <= x <= t + LASTS_S for x in times) for t in TIMES_S] == [True] * 3
    same = judged(SPOILT[how](log, around(log)), clean, friction)
    assert "event-cut" not in {f.code for f in same.findings}, "said of clean motion"


@pytest.mark.parametrize("how", ["no position", "thinned"])
def test_rows_in_a_gap_are_held_against_their_own_motion(clean: Path, friction: FrictionFile, how: str) -> None:
    """A third of the push lies within what motion beside the gap might become; not within what the rows' motion is."""
    log = open_log(clean, load_config(clean.with_suffix(".toml")))
    found = judged(SPOILT[how](pushed(log, 0.33), around(log, 0.5)), clean, friction)
    times = [f.start_s or 0.0 for f in found.findings if f.code == "event-cut"]
    assert [any(t - AROUND_S <= x <= t + LASTS_S for x in times) for t in TIMES_S] == [True] * 3


def test_a_flag_that_the_drives_contradict_masks_nothing(clean: Path, friction: FrictionFile) -> None:
    log = open_log(clean, load_config(clean.with_suffix(".toml")))
    flag = Annotation("freedrive", "mode", tuple((t - AROUND_S, t + LASTS_S + AROUND_S) for t in TIMES_S))
    found = judged(replace(pushed(log), annotations=(flag,)), clean, friction)
    assert found.verdict == "fail"
    assert [any(abs(c.onset_s - t) < 0.1 for c in found.contacts) for t in TIMES_S] == [True] * 3
    same = judged(replace(log, annotations=(flag,)), clean, friction)
    assert same.contacts == ()
    assert {f.severity for f in same.findings if f.code == "arm-guided"} == {"info"}


def test_a_hand_on_idle_drives_stays_masked(clean: Path, friction: FrictionFile) -> None:
    """The drives hold gravity and no more: the flag is right, and what they hold is allowed."""
    loaded = load_config(clean.with_suffix(".toml"))
    log = open_log(clean, loaded)
    robot = load_robot(loaded, log.joint_names)
    assert log.effort is not None
    since = log.time_s - log.time_s[0]
    rows = (since >= 8.0) & (since <= 11.0)
    effort = log.effort.copy()
    effort[rows] = robot.gravity_torque(log.position_rad[rows])
    flagged = replace(log, effort=effort, annotations=(Annotation("freedrive", "mode", ((8.0, 11.0),)),))
    found = judged(flagged, clean, friction)
    assert found.contacts == ()
    assert not {"event-cut"} & {f.code for f in found.findings}
    assert found.coverage.joints["joint2"].not_judged_s["not-driven"] > 2.5
