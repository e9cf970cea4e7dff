"""The nights of a store as a baseline: earlier nights of the same robot only, and friction with its interval."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from histories import history, joint_record, log_record, night

from collaudit.cli.fleet.baseline_files import is_store, read_baseline
from collaudit.core.errors import ConfigError
from collaudit.core.history.log_record import ContactRecord, FindingRecord, LogRecord
from collaudit.core.policy.baseline import baseline_of_records, change_over_nights, known_rate, new_contacts
from collaudit.reports.store.result_store import ResultStore

TONIGHT = 60


def _tonight(friction: float, seed: int = 7, **besides: object) -> LogRecord:
    rng = np.random.default_rng(seed)
    joints = tuple(joint_record(joint, friction, 0.0, rng, **besides) for joint in ("j1", "j2", "j3"))
    return log_record("a", TONIGHT, joints)


def test_only_earlier_nights_of_the_same_robot_count() -> None:
    contact = (ContactRecord(1.0, 1.5, ("j1",), "link1", "undecided", None),)
    first = replace(history("a", 1)[0], contacts=contact, verdict="fail")
    again = replace(first, night=night(TONIGHT))
    unread = replace(history("a", 3)[2], verdict="not_judged")
    known = baseline_of_records("s", [first, *history("b", 2), again, unread])
    before = known.before(None, log_record("a", TONIGHT, ()))
    assert [log.night for log in before] == [night(0)], "its own night, the other arm, and what was not judged are none"
    assert new_contacts([(1.1, 1.4, ("j1",))], first.log_sha256 or "", before) == 0
    assert known.before(None, log_record("a", 0, ())) == (), "a log that is judged again does not meet its own result"


def test_a_log_that_was_judged_in_two_nights_counts_once() -> None:
    one = history("a", 1)[0]
    known = baseline_of_records("s", [one, replace(one, night=night(3))])
    (log,) = known.before(None, log_record("a", TONIGHT, ()))
    assert log.recorded_s == 60.0


@pytest.mark.parametrize(("friction", "beyond"), [(0.0, False), (0.12, True), (-0.12, True)])
def test_a_change_of_friction_over_nights_has_an_interval(friction: float, beyond: bool) -> None:
    before = baseline_of_records("s", history("a", 40)).before(None, log_record("a", TONIGHT, ()))
    change = change_over_nights("j1", _tonight(friction), before)
    assert not isinstance(change, str)
    assert change.low <= friction <= change.high and change.high - change.low < 0.12
    assert (change.low > 0.05 or change.high < -0.05) == beyond


def test_the_interval_over_nights_holds_as_often_as_it_says() -> None:
    held = 0
    for seed in range(200):
        before = baseline_of_records("s", history("a", 5, ("j1",), seed=seed)).before(
            None, log_record("a", TONIGHT, ())
        )
        change = change_over_nights("j1", _tonight(0.03, seed=seed + 1000), before)
        held += change.low <= 0.03 <= change.high  # type: ignore[union-attr]
    assert held >= 0.92 * 200


def test_wear_is_not_hidden_by_a_mean_that_moves_along() -> None:
    wearing = history("a", 60, friction=lambda number, _: 0.005 * number)
    change = change_over_nights("j1", _tonight(0.30), baseline_of_records("s", wearing).before(None, _tonight(0.0)))
    assert not isinstance(change, str) and change.low > 0.2


def test_another_friction_file_adds_its_error_and_another_speed_is_no_baseline() -> None:
    before = baseline_of_records("s", history("a", 10)).before(None, _tonight(0.0))
    same = change_over_nights("j1", _tonight(0.0), before)
    other = change_over_nights("j1", replace(_tonight(0.0), friction_sha256="g"), before)
    assert other.high - other.low > same.high - same.low + 0.04  # type: ignore[union-attr]
    assert "speed" in str(change_over_nights("j1", _tonight(0.0, law_speed_rad_s=0.5), before))
    assert "does not tell" in str(change_over_nights("j1", _tonight(0.0, friction_excess=None), before))
    few = change_over_nights("j1", _tonight(0.0), before[:1])
    assert not isinstance(few, str) and few.low < 0 < few.high


def test_findings_rates_and_levels_come_from_the_store(tmp_path: Path) -> None:
    store = ResultStore(str(tmp_path / "store"))
    found = (FindingRecord("effort-scale", "warning", "j1", "so"),)
    store.append([replace(record, findings=found) for record in history("a", 4)])
    assert is_store(str(tmp_path / "store")) and is_store("s3://nights/store") and not is_store(str(tmp_path))
    before = read_baseline(str(tmp_path / "store")).before(None, _tonight(0.0))
    assert {one for log in before for one in log.findings} == {("effort-scale", "j1")}
    assert [log.rms_nm["j2"] for log in before] == [0.3] * 4 and sum(log.recorded_s for log in before) == 240.0
    assert known_rate(3, 1 / 60, 1.0, before) is None, "a history without near misses excuses none"


def test_what_is_no_store_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="no audit to compare with"):
        read_baseline(str(tmp_path))
    (tmp_path / "store.json").write_text(json.dumps({"schema": "else"}))
    with pytest.raises(Exception, match="no store of results"):
        read_baseline(str(tmp_path))
