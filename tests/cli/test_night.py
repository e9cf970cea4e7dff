"""A night's audit survives what single logs, workers and signals do to it, and leaves no verdict but its own."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from worker_deeds import descendants

# Runs collaudit with logs that do what their names say. Spawned workers import it too, and so behave the same.
SCRIPT = """
import os, signal, sys, time
import numpy as np
from collaudit.cli.batch import audit_one
from collaudit.cli.main import main

judge = audit_one.audit_files

def audit_files(files, *rest, **known):
    name = files[0].name
    if "killed" in name:
        os.kill(os.getpid(), signal.SIGKILL)
    if "hanging" in name:
        time.sleep(90)
    if "hungry" in name:
        np.ones(2 * 10**9)
    if "bug" in name:
        raise np.linalg.LinAlgError("singular")
    return judge(files, *rest, **known)

audit_one.audit_files = audit_files
if __name__ == "__main__":
    main()
"""


def _night(folder: Path, arm, *kinds: str) -> tuple[list[str], Path]:
    """A folder of logs of these kinds, the command that audits them, and its OUT."""
    logs = folder / "logs"
    logs.mkdir()
    for number, kind in enumerate(kinds):
        shutil.copyfile(arm.pushed if kind == "pushed" else arm.clean, logs / f"{number}-{kind}.csv")
    script = folder / "night.py"
    script.write_text(SCRIPT)
    command = [sys.executable, str(script), "audit", str(logs), "-c", str(arm.config), "--friction", str(arm.friction)]
    return [*command, "-o", str(folder / "out")], folder / "out"


def _verdicts(out: Path) -> dict[str, str]:
    return {entry["name"]: entry["verdict"] for entry in json.loads((out / "summary.json").read_text())["logs"]}


def _reason(out: Path, name: str) -> str:
    logs = json.loads((out / "summary.json").read_text())["logs"]
    return next(entry["reasons"][0] for entry in logs if entry["name"] == name)


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_bug_in_one_log_is_that_logs(jobs: int, arm, tmp_path: Path) -> None:
    command, out = _night(tmp_path, arm, "clean", "bug", "clean")
    run = subprocess.run([*command, "-j", str(jobs), "--format", "junit"], capture_output=True, text=True)
    assert run.returncode == 3, run.stderr
    assert _verdicts(out) == {"0-clean.csv": "pass", "1-bug.csv": "not_judged", "2-clean.csv": "pass"}
    assert "unexpected error" in run.stderr and "LinAlgError: singular" in run.stderr and "report" in run.stderr
    assert "Traceback" not in run.stderr
    assert (out / "summary.xml").exists() and (out / "index.html").exists()
    assert not (out / "1-bug").exists()


def test_a_dead_or_hanging_worker_costs_its_log_only(arm, tmp_path: Path) -> None:
    command, out = _night(tmp_path, arm, "killed", "clean", "hanging", "pushed", "killed")
    run = subprocess.run([*command, "-j", "2", "--timeout", "6"], capture_output=True, text=True)
    assert run.returncode == 1, run.stderr
    assert _verdicts(out) == {
        "0-killed.csv": "not_judged",
        "1-clean.csv": "pass",
        "2-hanging.csv": "not_judged",
        "3-pushed.csv": "fail",
        "4-killed.csv": "not_judged",
    }
    assert "SIGKILL" in _reason(out, "0-killed.csv")
    assert "6 s" in _reason(out, "2-hanging.csv")


def test_a_log_that_needs_too_much_memory(arm, tmp_path: Path) -> None:
    command, out = _night(tmp_path, arm, "hungry", "clean")
    run = subprocess.run([*command, "--memory-limit", "4"], capture_output=True, text=True)
    assert run.returncode == 3, run.stderr
    assert _verdicts(out) == {"0-hungry.csv": "not_judged", "1-clean.csv": "pass"}
    assert "memory" in _reason(out, "0-hungry.csv")


@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 143), (signal.SIGINT, 130), (signal.SIGKILL, -9)])
def test_an_ended_audit_leaves_no_verdict_no_part_and_no_worker(number: int, code: int, arm, tmp_path: Path) -> None:
    command, out = _night(tmp_path, arm, "clean", "hanging", "hanging", "hanging")
    out.mkdir()
    (out / "summary.json").write_text('{"schema": "collaudit/summary/1", "verdict": "pass"}')
    (out / "1-hanging").mkdir()
    (out / "1-hanging" / "audit.json").write_text("{}")
    heard = {"stderr": subprocess.PIPE, "text": True, "start_new_session": True}
    # A shell's background job ignores SIGINT, and so do its children: the audit is to hear it.
    process = subprocess.Popen(
        [*command, "-j", "2"], preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL), **heard
    )
    deadline = time.monotonic() + 60
    while not (out / "0-clean" / "report.html").exists() and time.monotonic() < deadline:
        time.sleep(0.1)
    children = descendants(process.pid)
    assert len(children) >= 3, "two that start processes, and one that hangs at least: the other may be about to begin"
    started = time.monotonic()
    process.send_signal(number)
    process.communicate(timeout=30)
    assert process.returncode == code
    assert time.monotonic() - started < 10
    assert not (out / "summary.json").exists() and not (out / "index.html").exists()
    assert (out / "AUDIT-UNDER-WAY.txt").exists()
    assert not (out / "1-hanging").exists()
    assert not list(out.rglob("*.part"))
    while any(map(_alive, children)) and time.monotonic() < started + 15:
        time.sleep(0.2)
    assert not any(map(_alive, children)), "workers live on"


def _alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().split(") ")[1][0] != "Z"
    except OSError:
        return False


def test_an_audit_after_a_killed_one_takes_its_place(arm, collaudit, tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / "AUDIT-UNDER-WAY.txt").write_text('{"host": "elsewhere", "process": 1}\n')
    arguments = ("audit", arm.clean, "-c", arm.config, "--friction", arm.friction, "-o", out)
    assert collaudit(*arguments).code == 0
    assert not (out / "AUDIT-UNDER-WAY.txt").exists()


def test_two_audits_do_not_share_a_folder(arm, collaudit, tmp_path: Path) -> None:
    import socket

    out = tmp_path / "out"
    out.mkdir()
    (out / "AUDIT-UNDER-WAY.txt").write_text(json.dumps({"host": socket.gethostname(), "process": os.getppid()}))
    refused = collaudit("audit", arm.clean, "-c", arm.config, "-o", out)
    assert refused.code == 2
    assert "another audit" in refused.err


def test_a_foreign_folder_is_refused(arm, collaudit, tmp_path: Path) -> None:
    out = tmp_path / "site"
    out.mkdir()
    (out / "index.html").write_text("mine")
    arguments = ("audit", arm.clean, "-c", arm.config, "--friction", arm.friction, "-o", out)
    refused = collaudit(*arguments)
    assert refused.code == 2
    assert "index.html" in refused.err and "another folder" in refused.err
    assert (out / "index.html").read_text() == "mine"


def test_nothing_is_written_through_a_link(arm, collaudit, tmp_path: Path) -> None:
    target = tmp_path / "mine.json"
    target.write_text("mine")
    out = tmp_path / "out"
    arguments = ("audit", arm.clean, "-c", arm.config, "--friction", arm.friction, "-o", out)
    assert collaudit(*arguments).code == 0
    run = arm.clean.stem
    for name in (f"{run}/audit.json", "summary.json"):
        (out / name).unlink()
        (out / name).symlink_to(target)
        collaudit(*arguments)
        assert target.read_text() == "mine"
    shutil.rmtree(out)  # without a summary of its own it is no audit's, and refused
    assert collaudit(*arguments).code == 0
    (tmp_path / "elsewhere").mkdir()
    shutil.rmtree(out / run)
    (out / run).symlink_to(tmp_path / "elsewhere")
    assert collaudit(*arguments).code == 3
    assert not list((tmp_path / "elsewhere").iterdir())
    link = tmp_path / "link.json"
    link.symlink_to(target)
    refused = collaudit("fit", arm.clean, "-c", arm.config, "-o", link)
    assert refused.code == 2 and "symbolic link" in refused.err
    assert target.read_text() == "mine"


def test_a_folder_with_a_log_that_leads_nowhere_is_not_judged(arm, collaudit, tmp_path: Path) -> None:
    logs = tmp_path / "logs"
    logs.mkdir()
    shutil.copyfile(arm.clean, logs / "clean.csv")
    shutil.copyfile(arm.clean, logs / "other.csv.part")
    (logs / "lost.csv").symlink_to(tmp_path / "not" / "mounted.csv")
    os.mkfifo(logs / "pipe.csv")
    told = collaudit("audit", logs, "-c", arm.config, "--friction", arm.friction, "-o", tmp_path / "out")
    assert told.code == 3
    assert "lost.csv: not judged" in told.err
    assert "pipe.csv" in told.err and "other.csv.part" in told.err


def test_copies_of_a_log_are_named(arm, collaudit, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    logs = tmp_path / "logs"
    logs.mkdir()
    for name in ("a.csv", "b.csv"):
        shutil.copyfile(arm.clean, logs / name)
    shutil.copyfile(arm.pushed, logs / "c.csv")
    outcome = collaudit("audit", logs, "-c", arm.config, "--friction", arm.friction, "-o", tmp_path / "night")
    assert "the same log 2 times, and judged as often: a.csv, b.csv" in outcome.err
    assert "c.csv" not in outcome.err.partition("the same log")[2]


def test_a_run_is_not_written_among_the_logs_through_a_link(arm, collaudit, tmp_path: Path) -> None:
    logs, link = tmp_path / "logs", tmp_path / "run"
    logs.mkdir()
    shutil.copyfile(arm.clean, logs / "clean.csv")
    (logs / "audit.json").write_text("mine")
    link.symlink_to(logs)
    refused = collaudit("detect", logs / "clean.csv", "-c", arm.config, "--friction", arm.friction, "-o", link)
    assert refused.code == 2 and "symbolic link" in refused.err
    assert sorted(path.name for path in logs.iterdir()) == ["audit.json", "clean.csv"]
    assert (logs / "audit.json").read_text() == "mine"
    refused = collaudit("audit", logs, "-c", arm.config, "--friction", arm.friction, "-o", link)
    assert refused.code == 2 and len(list(logs.iterdir())) == 2


def test_an_ended_audit_goes_on_where_it_was(arm, collaudit, tmp_path: Path) -> None:
    command, out = _night(tmp_path, arm, "clean", "killed", "pushed")
    assert subprocess.run([*command, "-j", "2"], capture_output=True).returncode == 1
    first = {path: path.stat().st_mtime_ns for path in sorted((out / "0-clean").iterdir())}
    assert _verdicts(out)["1-killed.csv"] == "not_judged"
    index = (out / "index.html").read_bytes()
    # the marker of a killed audit; this time nothing kills it
    (out / "AUDIT-UNDER-WAY.txt").write_text('{"host": "elsewhere", "process": 1}\n')
    again = [arm.config, "--friction", arm.friction, "-o", out, "--resume"]
    run = collaudit("audit", tmp_path / "logs", "-c", *again)
    assert run.code == 1 and "2 of 3 logs were finished earlier" in run.err
    assert {path: path.stat().st_mtime_ns for path in sorted((out / "0-clean").iterdir())} == first
    assert _verdicts(out) == {"0-clean.csv": "pass", "1-killed.csv": "pass", "2-pushed.csv": "fail"}
    assert (out / "index.html").read_bytes() != index
    whole = collaudit(
        "audit", tmp_path / "logs", "-c", arm.config, "--friction", arm.friction, "-o", tmp_path / "whole"
    )
    assert whole.code == 1
    assert _contents(out) == _contents(tmp_path / "whole"), "taken over and judged anew give the same bytes"


def _contents(out: Path) -> dict[str, bytes]:
    return {str(path.relative_to(out)): path.read_bytes() for path in sorted(out.rglob("*")) if path.is_file()}


def test_what_changed_is_judged_again(arm, collaudit, tmp_path: Path) -> None:
    from collaudit.cli.batch.audit_one import finished_outcomes
    from collaudit.cli.batch.log_jobs import LogJob
    from collaudit.cli.batch.precedents import with_precedents
    from collaudit.core.config import load_config
    from collaudit.core.config.accepted import Acceptance

    log, friction, out = tmp_path / "log.csv", tmp_path / "friction.json", tmp_path / "out"
    shutil.copyfile(arm.clean, log)
    shutil.copyfile(arm.friction, friction)
    assert collaudit("audit", log, "-c", arm.config, "--friction", friction, "-o", out).code == 0

    until = datetime.now(UTC).date() + timedelta(days=9)
    words = {"log": "log.csv", "peak_nm": {"joint1": 1.0}, "reason": "by hand", "owner": "A. Lee"}
    entry = Acceptance(**words, until=until)

    def kept(accepted: Sequence[object] = (), later_days: int = 0, **settings: object) -> bool:
        loaded = load_config(arm.config, {"friction.file": str(friction), **settings})
        job = LogJob((log,), f"{tmp_path.name}/log.csv", arm.run(log), loaded)
        today = datetime.now(UTC).date() + timedelta(days=later_days)
        return bool(finished_outcomes(with_precedents([job], [], accepted, today), out))

    assert kept() and kept(later_days=1), "another day changes nothing by itself"
    assert not kept([entry]), "what is accepted now was not when it was judged"
    assert not kept(**{"detect.gamma_nm": 4.1})
    run = out / arm.run(log)
    for file in (
        log,
        friction,
        run / "report.html",
        run / "audit.json",
        run / "signals.parquet",
        run / "finished.json",
    ):
        whole = file.read_bytes()
        file.write_bytes(whole[:-2])
        assert kept() == (file.name == "report.html"), f"{file.name} was changed"
        file.unlink()
        assert not kept(), f"{file.name} is gone"
        file.write_bytes(whole)
        assert kept()


def test_a_configuration_in_another_folder_names_its_friction_file(
    arm, collaudit, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Paths start from the configuration's folder, also where that is given relative to the working folder."""
    monkeypatch.chdir(tmp_path)
    settings = Path("settings")
    settings.mkdir()
    (settings / "friction.json").write_bytes(arm.friction.read_bytes())
    text = arm.config.read_text(encoding="utf-8")
    (settings / "arm.toml").write_text(f'{text}\n[friction]\nfile = "friction.json"\n', encoding="utf-8")
    done = collaudit("audit", arm.clean, "-c", settings / "arm.toml", "-o", "out", "--json")
    assert (done.code, json.loads(done.out)["logs"][0]["verdict"]) == (0, "pass"), done.err
