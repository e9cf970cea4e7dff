"""What is missing from a log is missing time: cells without a value never pass where rows that are gone would not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from missing_cells import Hole, holes, with_holes, without_their_rows
from unmeasured_faults import rows

from collaudit.core import api
from collaudit.core.audit import audit_log
from collaudit.core.config import load_config
from collaudit.core.data.audit_result import AuditResult, FrictionFile
from collaudit.core.data.joint_log import JointLog
from collaudit.core.errors import NotJudgedError
from collaudit.core.prepare.calibration import Calibration
from collaudit.core.prepare.preparation import prepare
from collaudit.fixtures.simulation import SimulatedFiles

SECONDS = 12.0
JOINTS = {"paper6": 6, "seven": 7}
Judge = Callable[[JointLog], AuditResult | None]
_KEPT: dict[str, tuple[JointLog, Judge]] = {}


@pytest.fixture(params=JOINTS)
def arm(
    request: pytest.FixtureRequest,
    made: Callable[..., SimulatedFiles],
    friction_of: Callable[[str], FrictionFile],
) -> tuple[JointLog, Judge]:
    """A log without contact, which passes, and what judges it; None where nothing can be judged."""
    robot = request.param
    if robot not in _KEPT:
        files, friction = made("free-clean", robot, seed=31, duration_s=SECONDS), friction_of(robot)
        loaded = load_config(files.config)
        log = api.open_log(files.log, loaded)
        model = api.load_robot(loaded, log.joint_names)
        about = loaded.provenance(None, model.sha256)

        def judge(spoilt: JointLog) -> AuditResult | None:
            try:
                ready = prepare(spoilt, model, loaded.config, Calibration.of(friction, loaded.config))
            except NotJudgedError:
                return None
            return audit_log(ready, loaded.config, friction, about, siblings=None).result

        _KEPT[robot] = rows(log, np.arange(0, log.time_s.size, 4)), judge
    return _KEPT[robot]


def verdict(result: AuditResult | None) -> str:
    return "not_judged" if result is None else result.verdict


@settings(max_examples=8, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_missing_cells_never_pass_where_missing_rows_do_not(arm: tuple[JointLog, Judge], data: st.DataObject) -> None:
    log, judge = arm
    spoilt = with_holes(log, data.draw(holes(len(log.joint_names))))
    if verdict(judge(spoilt)) == "pass":
        assert verdict(judge(without_their_rows(spoilt))) == "pass"


ALL = tuple(range(6))


@pytest.mark.parametrize(
    "hole",
    [
        Hole(("position_rad",), ALL, 0.05, 0.88, 1, 1),
        Hole(("position_rad",), (2,), 0.3, 0.3, 1, 1),
        Hole(("position_rad", "velocity_rad_s"), (4,), 0.0, 0.5, 1, 1),
        Hole(("effort",), (1,), 0.3, 0.3, 1, 1),
        Hole(("effort",), ALL, 0.6, 0.4, 1, 1),
        Hole(("effort",), (5,), 0.0, 1.0, 1, 1),
        Hole(("effort",), (3,), 0.0, 1.0, 2, 1),
        Hole(("position_rad",), (0,), 0.0, 1.0, 1, 1),
    ],
    ids=lambda hole: f"{'+'.join(hole.signals)} of {len(hole.joints)} in {hole.length:g}",
)
def test_much_missing_time_is_not_judged(arm: tuple[JointLog, Judge], hole: Hole) -> None:
    log, judge = arm
    assert verdict(judge(log)) == "pass"
    found = judge(with_holes(log, [hole]))
    assert verdict(found) == "not_judged"


@pytest.mark.parametrize("every", [1, 2, 30])
def test_missing_velocities_are_derived_and_said(arm: tuple[JointLog, Judge], every: int) -> None:
    """Whatever is missing of them, the log is judged as the positions alone let it."""
    log, judge = arm
    found = judge(with_holes(log, [Hole(("velocity_rad_s",), ALL, 0.0, 1.0, every, 1)]))
    alone = judge(replace(log, velocity_rad_s=None))
    assert found is not None and verdict(found) == verdict(alone) == "pass"
    assert "log-velocity" in {finding.code for finding in found.findings}
    assert found.coverage.lost_s == 0.0


def test_missing_positions_count_as_lost_rows(arm: tuple[JointLog, Judge]) -> None:
    log, judge = arm
    spoilt = with_holes(log, [Hole(("position_rad",), (1,), 0.4, 0.1, 1, 1)])
    missing, deleted = judge(spoilt), judge(without_their_rows(spoilt))
    assert missing is not None and deleted is not None
    assert missing.coverage == deleted.coverage and missing.sensitivity == deleted.sensitivity
    assert missing.coverage.gaps_s == pytest.approx(0.1 * SECONDS, rel=0.05)


def test_a_missing_effort_hides_no_contact_of_the_other_joints(arm: tuple[JointLog, Judge]) -> None:
    log, judge = arm
    assert log.effort is not None
    effort, span = np.array(log.effort), slice(700, 740)
    effort[span, 1] += 40.0
    effort[600:900, 4] = np.nan
    found = judge(replace(log, effort=effort))
    assert found is not None and found.verdict == "fail"
    assert found.coverage.missing_s == pytest.approx(300 * 0.008, rel=0.05)
