"""Stores of earlier schemas stay readable: the files in ``store_schema_1`` were written by the version that had it."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
from histories import history

from collaudit.core.errors import CollauditError
from collaudit.core.history.robot_trend import robot_trends
from collaudit.core.history.stored_thresholds import stored_recommendation
from collaudit.reports.store.result_store import ResultStore
from collaudit.reports.store.store_query import query_store

KEPT = Path(__file__).parent / "store_schema_1"


@pytest.fixture
def older(tmp_path: Path) -> ResultStore:
    return ResultStore(str(shutil.copytree(KEPT, tmp_path / "store")))


def test_schema_1_is_read_with_null_for_what_it_did_not_hold() -> None:
    records = ResultStore(str(KEPT)).records(evidence=True)
    assert [(r.robot, r.night, r.verdict, r.decided_verdict) for r in records] == [
        ("cell-1", "2026-09-01", "pass", None),
        ("cell-1", "2026-09-02", "fail", None),
        ("cell-1", "2026-09-03", "pass", None),
    ]
    bad = records[1]
    assert (bad.contacts[0].link, bad.near_misses[0].ratio, bad.findings[0].code) == ("forearm", 0.9, "clock-jump")
    assert (bad.friction[0].parameter, bad.friction[0].ci95_high, bad.reasons) == ("A_nm", 5.1, ("1 collision",))
    assert records[2].joints[0].peaks_nm == (0.5, 0.25) and records[2].joints[0].peaks_count == 9
    assert all(j.law_nm == 8.0 and j.load_excess is not None for r in records for j in r.joints)
    light = ResultStore(str(KEPT)).records()
    assert [r.joints[0].law_nm for r in light] == [8.0] * 3 and light[0].joints[0].peaks_nm == ()


def test_friction_that_schema_1_left_out_is_not_taken_for_quiet() -> None:
    records = ResultStore(str(KEPT)).records()
    assert all(j.friction_excess is None and j.friction_level is None for r in records for j in r.joints)
    (trend,) = robot_trends(records)
    assert any("3 logs: recorded by an earlier version" in words for words in trend.untold)


def test_both_schemas_answer_together_and_nothing_old_is_touched(older: ResultStore) -> None:
    before = {path.relative_to(older.place): path.read_bytes() for path in Path(older.place).rglob("*.parquet")}
    newer = history("cell-1", 6, joints=("j1", "j2"))[3:]
    older.append(newer)
    assert older.records()[3:] == newer and len(older.records()) == 6
    counted = query_store(older, "SELECT count(*), count(friction_excess), count(load_excess) FROM joints").rows
    assert counted == ((12, 6, 12),)
    for path, content in before.items():
        assert (Path(older.place) / path).read_bytes() == content
    assert json.loads((Path(older.place) / "store.json").read_text())["schema"] == "collaudit/store/2"
    assert stored_recommendation(older.records(evidence=True), "cell-1", 0.1).logs == 6


def test_a_batch_of_a_later_schema_is_refused(older: ResultStore) -> None:
    later = Path(older.place) / "v3" / "2026-09" / "20260901T000000.000000-00.parquet"
    later.parent.mkdir(parents=True)
    later.write_bytes(b"unknown")
    with pytest.raises(CollauditError, match="later version"):
        older.records()
