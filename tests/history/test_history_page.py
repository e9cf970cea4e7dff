"""docs/history.md: every question is answered by its SQL, and the answers are those of the planted truth."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from histories import history, night

from collaudit.core.history.log_record import ContactRecord, FindingRecord, NearMissRecord
from collaudit.reports.store.result_store import ResultStore
from collaudit.reports.store.store_query import query_store

PAGE = Path(__file__).resolve().parents[2] / "docs" / "history.md"
QUESTIONS = re.findall(r"```sql\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> ResultStore:
    pytest.importorskip("duckdb")
    made = ResultStore(str(tmp_path_factory.mktemp("history") / "store"))
    worn = history("cell-1", 12, friction=lambda k, j: 0.02 * k if j == "j2" else 0.0)
    hit = ContactRecord(3.0, 3.2, ("j1",), "link1", "accidental", 20.0)
    new = FindingRecord("new-one", "info", None, "")
    worn[-1] = replace(worn[-1], verdict="fail", contacts=(hit, hit), findings=(new,))
    worn[3] = replace(worn[3], near_misses=(NearMissRecord("j1", 1.0, 0.01, 3.5, 0.9, "amplitude"),))
    still = history("cell-2", 12, seed=1)
    still[5] = replace(still[5], verdict="not_judged", judged_h=0.0, joints=(), error="the file ends early")
    tight = [replace(j, gamma_margin=1.2) if j.joint == "j3" else j for j in still[7].joints]
    still[7] = replace(still[7], joints=tuple(tight))
    made.append(worn[:6])
    made.append([*worn[6:], *still])
    return made


def answer(store: ResultStore, number: int) -> list[dict[str, Any]]:
    return query_store(store, QUESTIONS[number]).records


def test_there_are_ten() -> None:
    assert len(QUESTIONS) == 10


def test_every_answer(store: ResultStore) -> None:
    assert answer(store, 0) == [{"robot": "cell-1", "failed": 1}]
    assert answer(store, 1) == [
        {"robot": "cell-2", "night": night(5), "log": "cell-2-5.mcap", "why": "the file ends early"}
    ]
    hours = answer(store, 2)
    assert [row["hours"] for row in hours] == pytest.approx([0.2, 11 / 60])
    assert [row["detectable"] for row in hours] == pytest.approx([2 / 3, 2 / 3])
    assert answer(store, 3) == [{"robot": "cell-1", "link": "link1", "contacts": 2}]
    rates = [(row["robot"], row["per_hour"]) for row in answer(store, 4)]
    assert rates == [("cell-1", pytest.approx(5)), ("cell-2", 0)]
    friction = answer(store, 5)
    assert len(friction) == 12 and friction[11]["friction_nm"] == pytest.approx(8 * 1.22, abs=0.4)
    assert friction[0]["se_nm"] == pytest.approx(0.08)
    assert [(row["robot"], row["joint"]) for row in answer(store, 6)] == [("cell-1", "j2")]
    assert answer(store, 7) == [{"robot": "cell-2", "joint": "j3", "margin": 1.2}]
    assert [row["logs"] for row in answer(store, 8)] == [12, 12] and answer(store, 8)[0]["since"] == night(0)
    assert answer(store, 9) == [{"robot": "cell-1", "code": "new-one"}]
