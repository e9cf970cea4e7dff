"""A store over nights from the command line: audits append to it, trend and query read it, two writers do not meet."""

from __future__ import annotations

import json
import shutil
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from histories import history

from collaudit.cli.batch.log_jobs import RecordWanted
from collaudit.reports.store.result_store import ResultStore


def _audit(collaudit, arm, folder: Path, *logs: Path, **options: str):
    flags = [part for name, value in options.items() for part in (f"--{name}", value)]
    return collaudit("audit", *logs, "-c", arm.config, "--friction", arm.friction, "-o", folder / "out", *flags)


def test_an_audit_appends_what_it_found_and_query_reads_it(collaudit, arm, tmp_path: Path) -> None:
    store, bad = tmp_path / "store", tmp_path / "bad.csv"
    bad.write_text("t,q1\n0,broken\n")
    logs = (arm.clean, arm.pushed, bad)
    done = _audit(collaudit, arm, tmp_path, *logs, store=store, robot="cell-1", night="2026-11-01")
    assert done.code == 1 and "3 logs added to the store" in done.err
    asked = "SELECT parse_filename(log) AS l, verdict, len(contacts), friction_sha256 IS NULL FROM logs ORDER BY l"
    rows = json.loads(collaudit("query", store, asked, "--json").out)["rows"]
    assert [row[:3] for row in rows] == [
        ["bad.csv", "not_judged", 0],
        ["clean.csv", "pass", 0],
        ["pushed.csv", "fail", 1],
    ]
    joints = "SELECT joint, friction_excess, friction_excess_se, law_nm FROM joints WHERE log LIKE '%/clean.csv'"
    for _, excess, error, law in json.loads(collaudit("query", store, joints, "--json").out)["rows"]:
        assert abs(excess) < 4 * error < 0.05 and law > 1.0


def test_friction_that_the_residual_follows_is_recorded_as_friction(collaudit, arm, tmp_path: Path) -> None:
    rows = np.loadtxt(arm.clean, delimiter=",", skiprows=1)
    speed = rows[:, 4]
    rows[:, 6] += 0.06 * (np.sign(speed) * (1.0 + 0.8 * np.exp(-np.abs(speed) / 0.08)) + 1.5 * speed)
    worn = tmp_path / "worn.csv"
    np.savetxt(worn, rows, delimiter=",", header="t,q1,q2,dq1,dq2,tau1,tau2", comments="", fmt="%.9g")
    assert _audit(collaudit, arm, tmp_path, worn, store=tmp_path / "store", robot="a").code == 0
    same, more = ResultStore(str(tmp_path / "store")).records()[0].joints
    assert abs(same.friction_excess) < 4 * same.friction_excess_se
    assert more.friction_level == pytest.approx(1.06, abs=0.01)
    assert abs(more.friction_excess - 0.06) < 4 * more.friction_excess_se < 0.01


def test_a_log_audited_again_counts_once(collaudit, arm, tmp_path: Path) -> None:
    store = tmp_path / "store"
    for _ in range(2):
        assert _audit(collaudit, arm, tmp_path, arm.clean, store=store, robot="cell-1").code == 0
    counted = json.loads(
        collaudit("query", store, "SELECT (SELECT count(*) FROM logs), count(*) FROM records", "--json").out
    )
    assert counted["rows"] == [[1, 2]]
    assert len(ResultStore(str(store)).records()) == 1


def test_resumed_logs_are_recorded_as_if_judged_now(collaudit, arm, tmp_path: Path) -> None:
    first, second = tmp_path / "first", tmp_path / "second"
    assert _audit(collaudit, arm, tmp_path, arm.clean, store=first, robot="a").code == 0
    again = collaudit("audit", arm.clean, "-c", arm.config, "--friction", arm.friction, "-o", tmp_path / "out",
                      "--store", second, "--robot", "a", "--resume")  # fmt: skip
    assert again.code == 0 and "1 of 1 logs were finished earlier" in again.err
    one, other = (ResultStore(str(place)).records(evidence=True)[0] for place in (first, second))
    assert replace(one, joints=()) == replace(other, joints=())
    for a, b in zip(one.joints, other.joints, strict=True):  # torques are kept in steps below a thousandth of gamma
        assert a.friction_excess == pytest.approx(b.friction_excess, abs=0.05 * a.friction_excess_se)
        assert a.clean_s == b.clean_s
        assert a.peaks_nm == pytest.approx(b.peaks_nm, abs=1e-3 * a.gamma_nm)
        assert a.peaks_count == pytest.approx(b.peaks_count, rel=0.02)  # a peak of one step more or less


def test_logs_that_were_not_read_are_not_taken_for_one(tmp_path: Path) -> None:
    """One at a URL has no file here, and one may be gone: neither has a hash."""
    wanted = RecordWanted("cell-1", None, "2026-11-22")
    records = [
        wanted.of_unread(files, name, "gone") for name, files in (("a", ()), ("b", ()), ("c", (tmp_path / "c",)))
    ]
    assert [record.log_sha256 for record in records] == [None, None, None]
    assert len({record.identity for record in records}) == 3


def test_a_robot_is_never_guessed(collaudit, arm, tmp_path: Path) -> None:
    refused = _audit(collaudit, arm, tmp_path, arm.clean, store=tmp_path / "store")
    assert refused.code == 2 and "--robot NAME" in refused.err and not (tmp_path / "out").exists()
    log = tmp_path / "cell-9" / "night.csv"
    log.parent.mkdir()
    shutil.copyfile(arm.clean, log)
    assert _audit(collaudit, arm, tmp_path, log, store=tmp_path / "store", robot="line/{folder}").code == 0
    (record,) = ResultStore(str(tmp_path / "store")).records()
    assert record.robot == "line/cell-9" and record.night_from == "audit"


def test_two_writers_do_not_meet(tmp_path: Path) -> None:
    store = ResultStore(str(tmp_path / "store"))
    batches = [history(f"robot-{k}", 3) for k in range(16)]
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(store.append, batches))
    assert len(store.batches()) == 16 and len(store.records()) == 48
    assert not list((tmp_path / "store").rglob("*.part"))


def test_a_half_written_batch_is_never_seen(tmp_path: Path) -> None:
    store = ResultStore(str(tmp_path / "store"))
    store.append(history("a", 3))
    whole = next((tmp_path / "store").rglob("*.parquet"))
    whole.with_name(f".{whole.name}.0011.part").write_bytes(whole.read_bytes()[:100])
    assert len(store.records()) == 3


def test_a_store_at_a_url() -> None:
    pytest.importorskip("fsspec")
    store = ResultStore("memory://somewhere/store")
    store.append(history("a", 3))
    store.append(history("b", 2))
    assert [(r.robot, r.night[-2:]) for r in store.records()] == [
        ("a", "01"),
        ("a", "02"),
        ("a", "03"),
        ("b", "01"),
        ("b", "02"),
    ]


def test_records_come_back_as_they_went(tmp_path: Path) -> None:
    store, records = ResultStore(str(tmp_path / "store")), history("a", 4)
    store.append(records)
    assert store.records(evidence=True) == records


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
    for sql in (f"SELECT * FROM '{tmp_path}/secret.csv'", "SELECT nothing FROM logs", "COPY logs TO 'x.csv'"):
        refused = collaudit("query", tmp_path / "store", sql)
        assert refused.code == 2 and "tables: logs, joints" in refused.err
    shown = collaudit("query", tmp_path / "store", "SELECT robot, count(*) AS logs FROM logs GROUP BY robot")
    assert shown.code == 0 and shown.out.split() == ["robot", "logs", "-----", "----", "a", "3"]


def test_trend_names_the_wearing_joint_on_terminal_page_and_json(collaudit, tmp_path: Path) -> None:
    store = ResultStore(str(tmp_path / "store"))
    store.append(history("worn", 40, friction=lambda k, j: 0.006 * max(0, k - 12) if j == "j2" else 0.0))
    store.append(history("steady", 40, seed=1))
    done = collaudit("trend", store.place, "-o", tmp_path / "trend.html")
    assert done.code == 0 and "wear-like growth of friction" in done.out and "Friction of j2 grows since" in done.out
    assert "2 robots, 1 without a significant change" in done.out
    page = (tmp_path / "trend.html").read_text()
    assert "wear-like growth" in page and "<script" not in page and len(page) < 120_000
    found = json.loads(collaudit("trend", store.place, "--json").out)
    assert found["schema"] == "collaudit/trend/1" and [len(r["events"]) for r in found["robots"]] == [0, 1]
    only = collaudit("trend", store.place, "--robot", "stead")
    assert only.code == 2 and "steady" in only.err


def test_a_store_without_judged_logs_is_not_judged(collaudit, tmp_path: Path) -> None:
    dark = [replace(r, verdict="not_judged", judged_h=0.0, joints=()) for r in history("dark", 3)]
    ResultStore(str(tmp_path / "store")).append(dark)
    assert collaudit("trend", tmp_path / "store").code == 3
