"""A push that nothing measured never passes: filled in, held, replayed, doubled or cut out, the log says so."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from unmeasured_faults import FAULTS, pushed, rows

from collaudit.core import api
from collaudit.core.audit import audit_log
from collaudit.core.config import load_config
from collaudit.core.data.audit_result import AuditResult, FrictionFile
from collaudit.core.data.joint_log import JointLog
from collaudit.core.prepare.calibration import Calibration
from collaudit.core.prepare.preparation import prepare
from collaudit.fixtures.simulation import SimulatedFiles

SECONDS = 12.0
Judge = Callable[[JointLog], AuditResult]


@pytest.fixture
def judged(
    made: Callable[..., SimulatedFiles], friction_of: Callable[[str], FrictionFile], robot: str, every: int
) -> tuple[JointLog, Judge]:
    files, friction = made("free-clean", robot, seed=31, duration_s=SECONDS), friction_of(robot)
    settings = load_config(files.config)
    log = api.open_log(files.log, settings)
    arm = api.load_robot(settings, log.joint_names)
    about = settings.provenance(None, arm.sha256)

    def judge(spoilt: JointLog) -> AuditResult:
        prepared = prepare(spoilt, arm, settings.config, Calibration.of(friction, settings.config))
        return audit_log(prepared, settings.config, friction, about, siblings=None).result

    return rows(log, np.arange(0, log.time_s.size, every)), judge


def some_pushes(log: JointLog, pushes: int) -> list[tuple[JointLog, int, int]]:
    """Logs with one push of 2.5 to 5 thresholds on a joint in motion, and rows that reach a little beyond it."""
    rng, out = np.random.default_rng(log.time_s.size), []
    assert log.velocity_rad_s is not None
    for length in np.geomspace(0.04, 0.5, pushes):
        j = int(rng.integers(0, len(log.joint_names) - 1))
        moving = np.flatnonzero((np.abs(log.velocity_rad_s[:, j]) > 0.1) & (np.abs(log.time_s - SECONDS / 2) < 4.0))
        onset = float(log.time_s[rng.choice(moving)])
        size = float(rng.uniform(2.5, 5.0) * 4.0 * rng.choice([-1.0, 1.0]))
        span = np.flatnonzero((log.time_s >= onset) & (log.time_s < onset + length))
        out.append((pushed(log, j, onset, length, size), int(span[0]) - 2, int(span[-1]) + 3))
    return out


@pytest.mark.parametrize(("robot", "every"), [("paper6", 1), ("seven", 4)], ids=["paper6-500 Hz", "seven-125 Hz"])
def test_a_push_that_nothing_measured_never_passes(judged: tuple[JointLog, Judge], every: int) -> None:
    """At 500 Hz the shortest and the longest push, at 125 Hz two between them."""
    log, judge = judged
    assert judge(log).verdict == "pass"
    passed = []
    for push, a, b in some_pushes(log, 2) if every == 1 else some_pushes(log, 4)[1:3]:
        assert judge(push).verdict == "fail", "it is seen where it was measured"
        for name, fault in FAULTS.items():
            result = judge(fault(push, a, b))
            if result.verdict == "pass":
                passed.append((name, a, b))
            elif result.verdict == "not_judged":
                assert any("contact then would not be seen" in text for text in result.reasons), result.reasons
    assert not passed
