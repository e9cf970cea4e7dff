"""Runs and friction files: exact round trips, the same bytes, clear words about damage."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import samples

from collaudit.core.data.audit_result import Audit, ResidualStats
from collaudit.core.data.signals import State
from collaudit.core.errors import CollauditError
from collaudit.reports.files import written_files
from collaudit.reports.files.run_files import (
    open_run,
    read_friction,
    read_run,
    result_json,
    write_friction,
    write_run,
)
from collaudit.reports.files.written_files import atomic_write

EXACT = ("time_s", "state", "gamma_nm")
#: Quantities that are stored in steps, and the largest step (torques: below a thousandth of gamma, which is 4 N·m).
IN_STEPS = {"position_rad": 2e-6, "velocity_rad_s": 2e-5, "measured_nm": 4e-3, "model_nm": 4e-3, "residual_nm": 4e-3}


@pytest.fixture(scope="module")
def audit() -> Audit:
    return samples.failed(5000)


@pytest.fixture
def run(tmp_path: Path, audit: Audit) -> Path:
    write_run(tmp_path / "run", audit, samples.friction_file())
    return tmp_path / "run"


def test_a_run_comes_back_as_it_was(run: Path, audit: Audit) -> None:
    back = read_run(run)
    assert back.result == audit.result
    assert back.signals.joint_names == audit.signals.joint_names
    for name in EXACT:
        np.testing.assert_array_equal(getattr(back.signals, name), getattr(audit.signals, name))
    for name, step in IN_STEPS.items():
        np.testing.assert_allclose(getattr(back.signals, name), getattr(audit.signals, name), rtol=1e-6, atol=step)
    assert read_friction(run / "friction.json") == samples.friction_file()


@pytest.mark.parametrize("make", [samples.not_judged, samples.hostile])
def test_awkward_runs_come_back_too(tmp_path: Path, make) -> None:
    audit = make()
    write_run(tmp_path, audit, None)
    back = read_run(tmp_path)
    assert back.result == audit.result
    assert back.signals.joint_names == audit.signals.joint_names


def test_the_same_run_gives_the_same_bytes(tmp_path: Path, audit: Audit) -> None:
    for name in ("a", "b"):
        write_run(tmp_path / name, audit, samples.friction_file())
    files = sorted(path.name for path in (tmp_path / "a").iterdir())
    assert files == ["audit.json", "friction.json", "signals.parquet"]
    for name in files:
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()


def test_writing_what_was_read_changes_nothing(run: Path, tmp_path: Path) -> None:
    write_run(tmp_path / "again", read_run(run), read_friction(run / "friction.json"))
    for name in ("audit.json", "friction.json", "signals.parquet"):
        assert (run / name).read_bytes() == (tmp_path / "again" / name).read_bytes()


def test_a_stale_friction_file_is_removed(run: Path, audit: Audit) -> None:
    write_run(run, audit, None)
    assert not (run / "friction.json").exists()


def test_numbers_that_are_not_finite_become_null(audit: Audit) -> None:
    odd = replace(audit.result, residual={"elbow": ResidualStats(float("nan"), float("inf"), None, 1.0, 2.0)})
    stats = json.loads(result_json(odd))["residual"]["elbow"]
    assert stats["mean_abs_nm"] is None
    assert stats["rms_nm"] is None
    assert stats["max_abs_nm"] == 1.0


def test_a_required_number_that_is_not_finite_is_a_bug_and_says_where(audit: Audit) -> None:
    odd = replace(audit.result, collisions=(replace(audit.result.collisions[0], peak_nm=float("nan")),))
    with pytest.raises(ValueError, match=r"\$\.collisions\[0\]\.peak_nm"):
        result_json(odd)


def test_numpy_numbers_are_written_in_full(audit: Audit) -> None:
    third = np.float64(1) / 3
    odd = replace(audit.result, residual={"elbow": ResidualStats(third, None, None, None, np.float64(2))})
    assert json.loads(result_json(odd))["residual"]["elbow"]["mean_abs_nm"] == 1 / 3


def test_file_names_that_are_not_text_survive(audit: Audit, tmp_path: Path) -> None:
    name = b"log\xff.bag".decode("utf-8", "surrogateescape")
    odd = replace(audit, result=replace(audit.result, log=replace(audit.result.log, name=name)))
    write_run(tmp_path, odd, None)
    assert read_run(tmp_path).result.log.name == "log\\udcff.bag"


@pytest.mark.parametrize(
    ("damage", "message", "found"),
    [
        (lambda text: text[: len(text) // 2], "the JSON is damaged", ""),
        (lambda _: "", "the JSON is damaged", "an empty file"),
        (lambda text: text.replace("audit/1", "audit/2"), "version this collaudit does not know", "audit/2"),
        (lambda text: text.replace("collaudit/audit/1", "collaudit/friction/1"), "another kind of file", "friction/1"),
        (lambda _: "[]", "another kind of file", "no schema"),
        (lambda text: text.replace('"fail"', '"maybe"'), "content its schema promises", "$.verdict"),
        (lambda text: text.replace("9.21734", '"9.21734"'), "content its schema promises", "$.collisions[0].peak_nm"),
        (lambda text: text.replace("9.21734", "NaN"), "the JSON is damaged", "byte"),
        (lambda text: text.replace("9.21734", "1e999"), "content its schema promises", "out of range"),
        (lambda text: text.replace("time-gap", "time-warp"), "content its schema promises", "time-warp"),
        (lambda text: text.replace('"reasons": [', '"reasons": ["\\udcff", '), "the JSON is damaged", "surrogate"),
        (lambda text: text.replace('"rms_nm"', '"rms"', 1), "content its schema promises", "$.residual[...]"),
        (lambda _: '{"a": ' + "[" * 100_000, "nested too deeply", ""),
    ],
)  # fmt: skip
def test_damage_is_named(run: Path, damage, message: str, found: str) -> None:
    path = run / "audit.json"
    path.write_text(damage(path.read_text()))
    with pytest.raises(CollauditError) as caught:
        read_run(run)
    assert message in caught.value.message
    assert found in (caught.value.found or "")
    assert str(path) in (caught.value.where or "")


def test_bytes_that_are_not_text_are_named(run: Path) -> None:
    (run / "audit.json").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(CollauditError, match="not a JSON file"):
        read_run(run)


def test_a_folder_without_a_run_is_named(tmp_path: Path) -> None:
    with pytest.raises(CollauditError, match="not a run folder"):
        read_run(tmp_path / "nowhere")


@pytest.mark.parametrize("content", [b"", b"PAR1 is not enough", b"PAR1" + bytes(100) + b"PAR1"])
def test_damaged_signals_are_named(run: Path, content: bytes) -> None:
    (run / "signals.parquet").write_bytes(content)
    with pytest.raises(CollauditError, match="cannot read the signals"):
        read_run(run)


def test_truncated_signals_are_named(run: Path) -> None:
    path = run / "signals.parquet"
    path.write_bytes(path.read_bytes()[:-1000])
    with pytest.raises(CollauditError, match="cannot read the signals"):
        read_run(run)


def test_signals_of_another_log_are_refused(run: Path, audit: Audit, tmp_path: Path) -> None:
    other = replace(audit, result=replace(audit.result, log=replace(audit.result.log, sha256="f" * 64)))
    write_run(tmp_path / "other", other, None)
    (tmp_path / "other" / "signals.parquet").replace(run / "signals.parquet")
    with pytest.raises(CollauditError, match="another log"):
        read_run(run)


def test_a_parquet_file_of_other_origin_is_refused(run: Path) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    pq.write_table(pa.table({"time_s": [0.0]}), run / "signals.parquet")
    with pytest.raises(CollauditError, match="not a signals file"):
        read_run(run)


def test_a_state_code_of_another_version_is_refused(audit: Audit, tmp_path: Path) -> None:
    state = audit.signals.state.copy()
    state[7, 2] = max(State) + 1
    write_run(tmp_path, replace(audit, signals=replace(audit.signals, state=state)), None)
    with pytest.raises(CollauditError, match="state code"):
        read_run(tmp_path)
    with pytest.raises(CollauditError, match="state code"):
        open_run(tmp_path).signals.trace(2)


def test_a_column_that_is_missing_is_named(run: Path) -> None:
    import pyarrow.parquet as pq

    table = pq.read_table(run / "signals.parquet")
    name = next(name for name in table.column_names if name.startswith("residual_nm:"))
    pq.write_table(table.drop_columns([name]), run / "signals.parquet")
    with pytest.raises(CollauditError) as refused:
        read_run(run)
    assert name in str(refused.value.expected)
    with pytest.raises(CollauditError, match="a column is missing"):
        open_run(run).signals.trace(0)


def test_a_failed_write_leaves_the_old_file_and_no_parts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "report.html"
    atomic_write(path, "old")

    def broken(target: Path, content: bytes) -> None:
        target.write_bytes(content[:1])
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(written_files, "write_synced", broken)
    with pytest.raises(CollauditError) as caught:
        atomic_write(path, "new")
    assert caught.value.found == "No space left on device"
    assert path.read_text() == "old"
    assert [item.name for item in tmp_path.iterdir()] == ["report.html"]


def test_the_disk_has_a_file_before_it_gets_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, kept = tmp_path / "audit.json", []

    def fsync(file: int) -> None:
        kept.append((Path(f"/proc/self/fd/{file}").read_text(), path.exists()))

    monkeypatch.setattr(os, "fsync", fsync)
    atomic_write(path, "whole")
    assert kept == [("whole", False)]
    assert path.read_text() == "whole"


def test_a_run_that_cannot_be_finished_leaves_nothing(tmp_path: Path, audit: Audit, monkeypatch) -> None:
    from collaudit.reports.files import signals_file

    def broken(*_: object) -> None:
        raise OSError(5, "Input/output error")

    monkeypatch.setattr(signals_file, "write_signals", broken)
    with pytest.raises(CollauditError):
        write_run(tmp_path / "run", audit, samples.friction_file())
    assert list((tmp_path / "run").iterdir()) == []


def test_a_run_that_cannot_be_finished_leaves_an_earlier_one_as_it_was(tmp_path: Path, audit: Audit) -> None:
    write_run(tmp_path, audit, None)
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    with pytest.raises(IndexError):
        write_run(tmp_path, replace(audit, signals=replace(audit.signals, gamma_nm=np.ones(6))), None)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_a_folder_in_the_way_is_named(tmp_path: Path) -> None:
    with pytest.raises(CollauditError, match="a folder of that name"):
        atomic_write(tmp_path, "text")
    with pytest.raises(CollauditError, match="cannot write the file"):
        (tmp_path / "file").write_text("")
        atomic_write(tmp_path / "file" / "below", "text")


def test_devices_are_written_to_and_not_replaced() -> None:
    atomic_write(Path("/dev/null"), "text")
    assert Path("/dev/null").is_char_device()


def test_new_files_follow_the_umask(tmp_path: Path) -> None:
    atomic_write(tmp_path / "a", "text")
    (tmp_path / "b").write_text("text")
    assert (tmp_path / "a").stat().st_mode == (tmp_path / "b").stat().st_mode


def test_nothing_is_written_through_a_link(tmp_path: Path) -> None:
    (tmp_path / "real").write_text("old")
    (tmp_path / "link").symlink_to(tmp_path / "real")
    with pytest.raises(CollauditError, match="symbolic link"):
        atomic_write(tmp_path / "link", "new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "real").read_text() == "old"


def test_friction_files_come_back(tmp_path: Path) -> None:
    path = tmp_path / "deep" / "friction.json"
    write_friction(path, samples.friction_file())
    assert read_friction(path) == samples.friction_file()
    assert path.read_text() == result_json(samples.friction_file())
    with pytest.raises(CollauditError, match="no such file"):
        read_friction(tmp_path / "absent.json")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda file: file["joints"]["shoulder_pan"]["parameters"].popitem(), "without its parameter"),
        (lambda file: file["joints"]["shoulder_pan"]["parameters"].update(A_nm=1e308), "A_nm is 1e\\+308"),
        (lambda file: file["thresholds"]["joints"]["joint1"]["levels"][0].update(gamma_nm=0.0), "a threshold of 0"),
        (lambda file: file["thresholds"]["joints"]["joint1"]["levels"][0].update(gamma_nm=1e308), "a threshold of 1e"),
    ],
)
def test_friction_that_no_fit_gives_is_refused(
    tmp_path: Path, change: Callable[[dict[str, Any]], object], said: str
) -> None:
    level = {"n": 13, "persistence_s": 0.026, "gamma_nm": 4.0}
    level |= {"false_alarms_per_hour": 0.01, "false_alarms_ci95": [0.0, 1.0]}
    known = {
        "levels": [level],
        "scale": None,
        "noise_nm": 0.1,
        "rms_nm": 0.1,
        "hours": 1.0,
        "held_out": 1.0,
        "fastest_rad_s": 1.0,
    }
    file = json.loads(result_json(samples.friction_file()))
    file["thresholds"] = {"detector": "direct", "causal": False, "joints": {"joint1": known}}
    path = tmp_path / "friction.json"
    path.write_text(json.dumps(file))
    read_friction(path)
    change(file)
    path.write_text(json.dumps(file))
    with pytest.raises(CollauditError, match=said):
        read_friction(path)


def test_the_package_hands_on_what_a_script_needs(tmp_path: Path, audit: Audit) -> None:
    from collaudit import reports

    reports.write_run(tmp_path / "run", audit, samples.friction_file())
    assert reports.read_run(tmp_path / "run").result == audit.result
    assert reports.read_friction(tmp_path / "run/friction.json") == samples.friction_file()
    reports.write_friction(tmp_path / "f.json", samples.friction_file())
    reports.write_report(tmp_path / "page", [audit])
    assert (tmp_path / "page").read_text().startswith("<!doctype html>")
    assert sorted(reports.__all__) == reports.__all__
    with pytest.raises(AttributeError):
        _ = reports.write_nothing


def test_range_and_wrench_come_back_and_are_absent_where_there_are_none(tmp_path: Path) -> None:
    audit = samples.failed(2000)
    shape = audit.signals.residual_nm.shape
    open_ = audit.signals.state == State.FRICTION_INTERVAL
    least = np.where(open_, -3.0, np.nan).astype(np.float32)
    wrench = np.arange(6.0 * shape[0]).reshape(-1, 6)
    write_run(
        tmp_path, replace(audit, signals=replace(audit.signals, least_nm=least, most_nm=-least, wrench=wrench)), None
    )
    read = read_run(tmp_path).signals
    np.testing.assert_array_equal(read.least_nm, least)
    np.testing.assert_array_equal(read.most_nm, -least)
    np.testing.assert_array_equal(read.wrench, wrench)
    write_run(tmp_path, audit, None)
    without = read_run(tmp_path).signals
    assert without.least_nm is without.most_nm is without.wrench is None
