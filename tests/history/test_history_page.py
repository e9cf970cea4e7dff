"""docs/fleet.md: every question is answered by its SQL, and the answers are those of the planted truth."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from histories import HIT, dark_row, history, night

from collaudit.reports.files.result_store import ResultStore
from collaudit.reports.files.store_query import query_store

PAGE = Path(__file__).resolve().parents[2] / "docs" / "fleet.md"
QUESTIONS = re.findall(r"```sql\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> ResultStore:
    pytest.importorskip("duckdb")
    made = ResultStore(str(tmp_path_factory.mktemp("history") / "store"))
    worn = history("cell-1", 12, friction_nm=lambda k, j: 8.0 * (1 + 0.02 * k) if j == "j2" else 8.0)
    worn[-3:] = [replace(row, verdict="fail", contacts=(HIT,) if row.joint == "j1" else ()) for row in worn[-3:]]
    still = [row for row in history("cell-2", 12) if row.night != night(5)] + [dark_row("cell-2", 5)]
    made.append(worn[:18])
    made.append([*worn[18:], *still])
    return made


def answer(store: ResultStore, number: int) -> list[dict[str, Any]]:
    return query_store(store, QUESTIONS[number]).records


def test_every_answer(store: ResultStore) -> None:
    assert len(QUESTIONS) == 5
    assert answer(store, 0) == [{"robot": "cell-1", "failed": 1}]
    assert answer(store, 1) == [
        {"robot": "cell-2", "night": night(5), "log": "cell-2-5.mcap", "why": "the file ends early"}
    ]
    assert answer(store, 2) == [{"robot": "cell-1", "joint": "j1", "contacts": 1, "nights": 1}]
    friction = answer(store, 3)
    assert len(friction) == 12 and friction[11]["friction_nm"] == pytest.approx(8 * 1.22)
    assert [row["hours"] for row in answer(store, 4)] == pytest.approx([12 * 150 / 3600, 11 * 150 / 3600])
