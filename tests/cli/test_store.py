"""A store over nights from the command line: audits append to it, trend and query read it, two writers do not meet."""

from __future__ import annotations

import json
import shutil
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from histories import HIT, dark_row, history, night_row

from collaudit.cli.batch.log_jobs import LogJob, Outcome, night_rows
from collaudit.core.config import load_config
from collaudit.core.errors import NotJudgedError
from collaudit.core.history.night_row import joint_nights
from collaudit.reports.files.result_store import ResultStore
from collaudit.reports.values.entries import entry_of_error


def _audit(collaudit, arm, folder: Path, *logs: Path, **options: str):
    flags = [part for name, value in options.items() for part in (f"--{name}", value)]
    return collaudit("audit", *logs, "-c", arm.config, "--friction", arm.friction, "-o", folder / "out", *flags)


def test_an_audit_appends_what_it_found_and_query_reads_it(collaudit, arm, tmp_path: Path) -> None:
    store, bad = tmp_path / "store", tmp_path / "bad.csv"
    bad.write_text("t,q1\n0,broken\n")
    logs = (arm.clean, arm.pushed, bad)
    done = _audit(collaudit, arm, tmp_path, *logs, store=store, robot="cell-1", night="2026-11-01")
    assert done.code == 1 and "3 logs added to the store" in done.err
    asked = "SELECT parse_filename(log) AS l, verdict, joint, tested, len(contacts) FROM nights ORDER BY l, joint"
    rows = json.loads(collaudit("query", store, asked, "--json").out)["rows"]
    assert [row[:4] for row in rows] == [
        ["bad.csv", "not_judged", None, False],
        ["clean.csv", "pass", "joint1", True],
        ["clean.csv", "pass", "joint2", True],
        ["pushed.csv", "fail", "joint1", True],
        ["pushed.csv", "fail", "joint2", True],
    ]
    assert [row[4] for row in rows[:3]] == [0, 0, 0] and rows[3][4] + rows[4][4] >= 1
    joints = "SELECT level_nm, gamma_nm, friction_nm FROM nights WHERE log LIKE '%/clean.csv'"
    for level, gamma, friction in json.loads(collaudit("query", store, joints, "--json").out)["rows"]:
        assert 0.0 < level < gamma and friction > 1.0


def test_friction_that_the_residual_follows_is_recorded(collaudit, arm, tmp_path: Path) -> None:
    rows = np.loadtxt(arm.clean, delimiter=",", skiprows=1)
    speed = rows[:, 4]
    rows[:, 6] += 0.06 * (np.sign(speed) * (1.0 + 0.8 * np.exp(-np.abs(speed) / 0.08)) + 1.5 * speed)
    worn = tmp_path / "worn.csv"
    np.savetxt(worn, rows, delimiter=",", header="t,q1,q2,dq1,dq2,tau1,tau2", comments="", fmt="%.9g")
    assert (
        _audit(collaudit, arm, tmp_path, arm.clean, store=tmp_path / "store", robot="a", night="2026-11-01").code == 0
    )
    assert _audit(collaudit, arm, tmp_path, worn, store=tmp_path / "store", robot="a", night="2026-11-02").code == 0
    same, more = joint_nights(ResultStore(str(tmp_path / "store")).rows())
    assert same.nights[1].friction_nm == pytest.approx(same.nights[0].friction_nm, rel=0.01)
    assert more.nights[1].friction_nm == pytest.approx(1.06 * more.nights[0].friction_nm, rel=0.01)


def test_a_log_audited_again_counts_once(collaudit, arm, tmp_path: Path) -> None:
    store = tmp_path / "store"
    for _ in range(2):
        assert _audit(collaudit, arm, tmp_path, arm.clean, store=store, robot="cell-1").code == 0
    counted = json.loads(
        collaudit("query", store, "SELECT (SELECT count(*) FROM nights), count(*) FROM records", "--json").out
    )
    assert counted["rows"] == [[2, 4]]
    assert len(ResultStore(str(store)).rows()) == 2


def test_resumed_logs_are_recorded_as_if_judged_now(collaudit, arm, tmp_path: Path) -> None:
    first, second = tmp_path / "first", tmp_path / "second"
    assert _audit(collaudit, arm, tmp_path, arm.clean, store=first, robot="a").code == 0
    again = collaudit("audit", arm.clean, "-c", arm.config, "--friction", arm.friction, "-o", tmp_path / "out",
                      "--store", second, "--robot", "a", "--resume")  # fmt: skip
    assert again.code == 0 and "1 of 1 logs were finished earlier" in again.err
    one, other = (ResultStore(str(place)).rows() for place in (first, second))
    assert one == other


def test_logs_that_were_not_read_are_not_taken_for_one(tmp_path: Path) -> None:
    """One at a URL has no file here, and one may be gone: neither has a hash."""
    every = (("a", ()), ("b", ()), ("c", (tmp_path / "c",)))
    jobs = [LogJob(files, name, name, load_config(None), "cell-1") for name, files in every]
    outcomes = [Outcome(entry_of_error(name, NotJudgedError("gone")), None) for name, _ in every]
    rows = [row for own in night_rows(jobs, outcomes, None).values() for row in own]
    assert [row.log_sha256 for row in rows] == [None, None, None]
    assert len({row.identity for row in rows}) == 3


def test_a_robot_is_never_guessed(collaudit, arm, tmp_path: Path) -> None:
    refused = _audit(collaudit, arm, tmp_path, arm.clean, store=tmp_path / "store")
    assert refused.code == 2 and "--robot NAME" in refused.err and not (tmp_path / "out").exists()
    log = tmp_path / "cell-9" / "night.csv"
    log.parent.mkdir()
    shutil.copyfile(arm.clean, log)
    assert _audit(collaudit, arm, tmp_path, log, store=tmp_path / "store", robot="line/{folder}").code == 0
    rows = ResultStore(str(tmp_path / "store")).rows()
    assert {(row.robot, row.night_from) for row in rows} == {("line/cell-9", "audit")}


def test_two_writers_do_not_meet(tmp_path: Path) -> None:
    store = ResultStore(str(tmp_path / "store"))
    batches = [history(f"robot-{k}", 3) for k in range(16)]
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(store.append, batches))
    assert len(store.batches()) == 16 and len(store.rows()) == 144
    assert not list((tmp_path / "store").rglob("*.part"))


def test_a_half_written_batch_is_never_seen(tmp_path: Path) -> None:
    store = ResultStore(str(tmp_path / "store"))
    store.append(history("a", 3))
    whole = next((tmp_path / "store").rglob("*.parquet"))
    whole.with_name(f".{whole.name}.0011.part").write_bytes(whole.read_bytes()[:100])
    assert len(store.rows()) == 9


def test_a_store_at_a_url() -> None:
    pytest.importorskip("fsspec")
    store = ResultStore("memory://somewhere/store")
    store.append(history("a", 3))
    store.append(history("b", 2))
    assert [(r.robot, r.night[-2:]) for r in store.rows() if r.joint == "j1"] == [
        ("a", "01"),
        ("a", "02"),
        ("a", "03"),
        ("b", "01"),
        ("b", "02"),
    ]


def test_rows_come_back_as_they_went(tmp_path: Path) -> None:
    store, rows = ResultStore(str(tmp_path / "store")), [night_row("a", 0, contacts=(HIT, HIT)), *history("b", 4)]
    store.append(rows)
    assert store.rows() == rows


def test_what_is_no_store_is_refused(collaudit, arm, tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.tex").write_text("x")
    assert _audit(collaudit, arm, tmp_path, arm.clean, store=tmp_path / "mine", robot="a").code == 2
    assert "no store" in collaudit("trend", tmp_path / "absent").err
    (tmp_path / "new").mkdir()
    (tmp_path / "new" / "store.json").write_text('{"schema": "collaudit/store/99"}')
    later = collaudit("query", tmp_path / "new", "SELECT 1")
    assert later.code == 2 and "another version" in later.err


def test_query_reads_no_other_file_and_says_what_is_wrong(collaudit, tmp_path: Path) -> None:
    ResultStore(str(tmp_path / "store")).append(history("a", 3))
    (tmp_path / "secret.csv").write_text("a\n1\n")
    for sql in (f"SELECT * FROM '{tmp_path}/secret.csv'", "SELECT nothing FROM nights", "COPY nights TO 'x.csv'"):
        refused = collaudit("query", tmp_path / "store", sql)
        assert refused.code == 2 and "tables: nights, contacts" in refused.err
    shown = collaudit(
        "query", tmp_path / "store", "SELECT robot, count(DISTINCT log) AS logs FROM nights GROUP BY robot"
    )
    assert shown.code == 0 and shown.out.split() == ["robot", "logs", "-----", "----", "a", "3"]


def test_trend_shows_each_joint_on_terminal_page_and_json(collaudit, tmp_path: Path) -> None:
    store = ResultStore(str(tmp_path / "store"))
    store.append(
        [*history("worn", 40, friction_nm=lambda k, j: 8.0 + 0.1 * k if j == "j2" else 8.0), dark_row("worn", 40)]
    )
    store.append([night_row("hit", 0, contacts=(HIT,))])
    done = collaudit("trend", store.place, "-o", tmp_path / "trend.html")
    assert done.code == 0 and "8.00 → 11.9" in done.out and "40 of 40" in done.out
    page = (tmp_path / "trend.html").read_text()
    assert page.count("<figure>") == 4 and 'class="onset"' in page and "<script" not in page and len(page) < 60_000
    found = json.loads(collaudit("trend", store.place, "--json").out)
    assert found["schema"] == "collaudit/trend/2" and len(found["joints"]) == 4
    assert found["joints"][0]["nights"][0]["contacts"] == 1
    only = collaudit("trend", store.place, "--robot", "wor")
    assert only.code == 2 and "worn" in only.err


def test_a_store_without_judged_logs_is_not_judged(collaudit, tmp_path: Path) -> None:
    ResultStore(str(tmp_path / "store")).append([dark_row("dark", number) for number in range(3)])
    assert collaudit("trend", tmp_path / "store").code == 3
