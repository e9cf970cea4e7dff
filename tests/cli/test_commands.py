"""Every command on a small arm: what it writes, what it prints, how it exits."""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from collaudit.core.config import load_config
from collaudit.reports.files.run_files import read_friction, read_run


def test_fit_recovers_and_prints(arm, collaudit, tmp_path: Path) -> None:
    outcome = collaudit("fit", arm.clean, "-c", arm.config, "-o", tmp_path / "f.json")
    assert outcome.code == 0, outcome.err
    assert "static-lugre" in outcome.out or "coulomb-viscous" in outcome.out
    assert "friction written to" in outcome.err
    friction = read_friction(tmp_path / "f.json")
    assert set(friction.joints) == {"joint1", "joint2"}
    assert friction.joints["joint1"].parameters["D_nm_s_per_rad"] == pytest.approx(1.5, abs=0.1)


def test_fit_json_is_the_file(arm, collaudit, tmp_path: Path) -> None:
    outcome = collaudit("fit", arm.clean, "-c", arm.config, "-o", tmp_path / "f.json", "--json")
    assert outcome.out == (tmp_path / "f.json").read_text()


def test_fit_model_flag(arm, collaudit) -> None:
    outcome = collaudit("fit", arm.clean, "-c", arm.config, "--set", "friction.model=coulomb-viscous", "--json")
    assert {fit["model"] for fit in json.loads(outcome.out)["joints"].values()} == {"coulomb-viscous"}


def test_fit_of_nothing_that_moves_is_not_judged(arm, collaudit, tmp_path: Path) -> None:
    log = tmp_path / "still.csv"
    rows = "\n".join(f"{0.004 * k:.3f},0.1,0.2,0,0,1,2" for k in range(2000))
    log.write_text("t,q1,q2,dq1,dq2,tau1,tau2\n" + rows + "\n")
    outcome = collaudit("fit", log, "-c", arm.config)
    assert outcome.code == 3, outcome.out + outcome.err


@pytest.mark.parametrize("how", ["as logged", "as stated"])
def test_fit_of_efforts_that_are_all_inverted_is_not_judged(arm, collaudit, tmp_path: Path, how: str) -> None:
    """Its laws drive the joints: exit code 3 and one line, also where the configuration itself turns the signs."""
    log, config = tmp_path / "inverted.csv", tmp_path / "arm.toml"
    header, *rows = arm.clean.read_text().splitlines()
    cells = [row.split(",") for row in rows]
    turned = [",".join([*row[:5], str(-float(row[5])), str(-float(row[6]))]) for row in cells]
    log.write_text("\n".join([header, *(rows if how == "as stated" else turned)]) + "\n")
    signs = "\n[log.units.effort_sign]\njoint1 = -1\njoint2 = -1\n" if how == "as stated" else ""
    config.write_text(arm.config.read_text() + signs)
    outcome = collaudit("fit", log, "-c", config, "-o", tmp_path / "f.json")
    assert outcome.code == 3, outcome.out + outcome.err
    assert outcome.err.count("no joint has friction that a log could be judged with") == 1
    assert read_friction(tmp_path / "f.json").usable == ()


def test_fit_of_one_inverted_effort_leaves_the_other_joint(arm, collaudit, tmp_path: Path) -> None:
    log = tmp_path / "inverted.csv"
    header, *rows = arm.clean.read_text().splitlines()
    cells = [row.split(",") for row in rows]
    one = "\n".join([header, *(",".join([*row[:5], str(-float(row[5])), row[6]]) for row in cells)]) + "\n"
    log.write_text(one)
    assert collaudit("fit", log, "-c", arm.config, "-o", tmp_path / "f.json").code == 0
    assert read_friction(tmp_path / "f.json").usable == ("joint2",)


def test_detect_clean_and_pushed(arm, collaudit, tmp_path: Path) -> None:
    clean = collaudit("detect", arm.clean, "-c", arm.config, "--friction", arm.friction, "-o", tmp_path / "clean")
    assert clean.code == 0, clean.out
    pushed = collaudit("detect", arm.pushed, "-c", arm.config, "--friction", arm.friction, "-o", tmp_path / "pushed")
    assert pushed.code == 1, pushed.out
    assert "n = 7 samples = 28 ms (asked: 25 ms)" in pushed.out
    result = read_run(tmp_path / "pushed").result
    assert [c.joint for c in result.collisions] == ["joint1"]
    assert result.provenance.config_sha256 is not None
    assert result.provenance.friction_sha256 is not None
    assert (tmp_path / "pushed" / "friction.json").is_file()


def test_the_command_that_is_offered_runs_as_it_stands(arm, collaudit, tmp_path: Path) -> None:
    out = tmp_path / "night (1)"
    judged = collaudit("detect", arm.clean, "-c", arm.config, "--friction", arm.friction, "-o", out)
    said = judged.err.split("run written to ")[1].split(": ", 1)[1].split(" makes the page")[0]
    assert shlex.split(said) == ["collaudit", "report", str(out), "-o", "report.html"]


def test_a_log_is_no_run_and_is_not_offered_for_itself(arm, collaudit, tmp_path: Path) -> None:
    refused = collaudit("report", arm.clean, "-o", tmp_path / "r.html")
    assert refused.code == 2 and "did you mean" not in refused.err and "collaudit detect LOG" in refused.err


def test_detect_prints_a_screen_or_more(arm, collaudit) -> None:
    usual = ("detect", arm.pushed, "-c", arm.config, "--friction", arm.friction)
    screen, whole = (collaudit(*usual, *flags) for flags in ((), ("-v",)))
    assert {run.code for run in (screen, whole)} == {1}
    assert (
        "1 contact (policy: at most 0)" in screen.out
        and "Contacts (1)" not in screen.out
        and "Alarms of single joints" not in screen.out
    )
    assert "Alarms of single joints" in whole.out


def test_detect_json_is_the_file_and_the_same_twice(arm, collaudit, tmp_path: Path) -> None:
    first = collaudit("detect", arm.pushed, "-c", arm.config, "-o", tmp_path / "a", "--json")
    second = collaudit("detect", arm.pushed, "-c", arm.config, "-o", tmp_path / "b", "--json")
    assert first.out == second.out == (tmp_path / "a" / "audit.json").read_text()
    assert (tmp_path / "a" / "signals.parquet").read_bytes() == (tmp_path / "b" / "signals.parquet").read_bytes()


def test_flags_override_the_configuration(arm, collaudit) -> None:
    def rule(*flags: str) -> dict:
        args = ("detect", arm.pushed, "-c", arm.config, "--friction", arm.friction, "--json", *flags)
        return json.loads(collaudit(*args).out)["rule"]

    assert rule("--set", "detect.gamma_nm=30")["gamma_nm"] == {"joint1": 30.0, "joint2": 30.0}
    assert rule("--set", "detect.gamma_nm={joint1=5, joint2=6}")["gamma_nm"] == {"joint1": 5.0, "joint2": 6.0}
    sharpest = rule("--set", "detect.gamma_nm=sharpest")
    assert all(sharpest["gamma_nm"][joint] < level for joint, level in sharpest["motion_nm"].items())
    assert rule("--set", "detect.n=11")["n"] == 11
    assert rule("--set", "detect.persistence_ms=41")["n"] == 11
    assert rule("--set", 'detect.watch=["joint2"]')["watch"] == ["joint2"]
    assert rule("--set", "detect.gamma_nm=30", "--set", "near_miss.amplitude=0.5")["near_miss_nm"]["joint1"] == 15.0


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (r'"joint(\d)"', r'"axis\1"', "has a friction law but is not in this log"),
        ('"effort_unit": "N·m"', '"effort_unit": "raw"', "own unit"),
    ],
)
def test_friction_that_does_not_fit_the_log(arm, collaudit, tmp_path: Path, old: str, new: str, said: str) -> None:
    text = arm.friction.read_text()
    other = tmp_path / "other.json"
    other.write_text(re.sub(old, new, text))
    assert other.read_text() != text
    outcome = collaudit("detect", arm.pushed, "-c", arm.config, "--friction", other)
    assert outcome.code == 3, outcome.out
    assert said in outcome.out


def test_policy_of_the_configuration(arm, collaudit) -> None:
    args = ("detect", arm.pushed, "-c", arm.config, "--friction", arm.friction)
    assert collaudit(*args, "--set", "policy.max_collisions=1").code == 0


def test_one_log_only(arm, collaudit) -> None:
    outcome = collaudit("detect", arm.clean, arm.pushed, "-c", arm.config)
    assert outcome.code == 2
    assert "collaudit audit takes any number" in outcome.err


def test_recommend_on_runs_and_logs(arm, collaudit, tmp_path: Path) -> None:
    collaudit("detect", arm.clean, "-c", arm.config, "--friction", arm.friction, "-o", tmp_path / "run")
    on_run = json.loads(collaudit("recommend", tmp_path / "run", "--json").out)
    on_log = collaudit("recommend", arm.clean, "-c", arm.config, "--friction", arm.friction, "--json")
    assert on_log.code == 3, "less than three minutes support no threshold"
    assert on_run["joints"] == json.loads(on_log.out)["joints"]
    assert on_run["schema"] == "collaudit/recommend/1"
    assert {"arm", "set", "ranges", "to_confirm", "assumptions"} <= set(on_run)
    screen = collaudit("recommend", tmp_path / "run", "-v").out
    assert "clean motion" in screen and "supports no threshold" in screen


def test_report_formats(arm, collaudit, tmp_path: Path) -> None:
    collaudit("detect", arm.pushed, "-c", arm.config, "--friction", arm.friction, "-o", tmp_path / "run")
    page = tmp_path / "r.html"
    outcome = collaudit("report", tmp_path / "run", "-o", page, "--format", "html,json,junit,sarif,markdown")
    assert outcome.code == 0, outcome.err
    assert outcome.out == ""
    assert page.read_text().startswith("<!")
    assert (tmp_path / "r.json").read_text() == (tmp_path / "run" / "audit.json").read_text()
    for suffix in ("xml", "sarif", "md"):
        assert (tmp_path / f"r.{suffix}").stat().st_size > 0


def test_report_points_out_other_settings(arm, collaudit, tmp_path: Path) -> None:
    collaudit("detect", arm.clean, "-c", arm.config, "-o", tmp_path / "run", "--set", "detect.gamma_nm=7")
    outcome = collaudit("report", tmp_path / "run", "-o", tmp_path / "r.html", "-c", arm.config)
    assert outcome.code == 0
    assert "other settings" in outcome.err


def _audit(collaudit, arm, out: Path, *args: object):
    return collaudit("audit", *args, "-c", arm.config, "--friction", arm.friction, "-o", out)


def test_audit_of_many_goes_on_after_a_bad_one(arm, collaudit, tmp_path: Path) -> None:
    logs = tmp_path / "logs"
    logs.mkdir()
    (logs / "a-clean.csv").write_bytes(arm.clean.read_bytes())
    (logs / "b-words.csv").write_text("name,colour\nrobot,orange\n")
    (logs / "c-pushed.csv").write_bytes(arm.pushed.read_bytes())
    outcome = _audit(collaudit, arm, tmp_path / "out", logs, "--format", "junit,markdown")
    assert outcome.code == 1, outcome.err
    assert "b-words.csv" in outcome.err
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    verdicts = {entry["name"]: entry["verdict"] for entry in summary["logs"]}
    assert verdicts == {"a-clean.csv": "pass", "b-words.csv": "not_judged", "c-pushed.csv": "fail"}
    for name in ("index.html", "summary.xml", "summary.md", "a-clean/audit.json", "c-pushed/report.html"):
        assert (tmp_path / "out" / name).stat().st_size > 0
    assert not (tmp_path / "out" / "b-words").exists()


def test_audit_exit_codes(arm, collaudit, tmp_path: Path) -> None:
    bad = tmp_path / "words.csv"
    bad.write_text("name,colour\nrobot,orange\n")
    assert _audit(collaudit, arm, tmp_path / "o1", arm.clean).code == 0
    assert _audit(collaudit, arm, tmp_path / "o2", arm.clean, bad).code == 3
    assert _audit(collaudit, arm, tmp_path / "o3", bad, arm.pushed).code == 1


def test_audit_in_processes_gives_the_same_files(arm, collaudit, tmp_path: Path) -> None:
    settings = ("-c", arm.config, "--friction", arm.friction, "--json")
    one = collaudit("audit", arm.clean, arm.pushed, *settings, "-o", tmp_path / "one")
    two = _run("audit", arm.clean, arm.pushed, *settings, "-o", tmp_path / "two", "-j", "2")
    assert (one.code, two.returncode) == (1, 1), one.err + two.stderr
    assert one.out == two.stdout
    for path in (p for p in (tmp_path / "one").rglob("*") if p.is_file()):
        assert path.read_bytes() == (tmp_path / "two" / path.relative_to(tmp_path / "one")).read_bytes(), path


def test_audit_leaves_no_older_result_of_a_log_it_could_not_judge(arm, collaudit, tmp_path: Path) -> None:
    log = tmp_path / "run.csv"
    log.write_bytes(arm.clean.read_bytes())
    assert _audit(collaudit, arm, tmp_path / "out", log).code == 0
    log.write_text("name,colour\nrobot,orange\n")
    assert _audit(collaudit, arm, tmp_path / "out", log).code == 3
    assert not [path for path in (tmp_path / "out").glob("*run/*") if path.is_file()]


def test_logs_of_one_name_are_told_apart(arm, collaudit, tmp_path: Path) -> None:
    for day in ("monday", "tuesday"):
        (tmp_path / day).mkdir()
        (tmp_path / day / "run.csv").write_bytes(arm.clean.read_bytes())
    outcome = _audit(collaudit, arm, tmp_path / "out", tmp_path / "monday", tmp_path / "tuesday", "--json")
    names = [entry["name"] for entry in json.loads(outcome.out)["logs"]]
    assert len(set(names)) == 2
    assert {path.name for path in (tmp_path / "out").iterdir() if path.is_dir()} == {
        "monday_run",
        "tuesday_run",
        "assets",
        "friction",
    }


def test_inspect(arm, collaudit) -> None:
    outcome = collaudit("inspect", arm.clean, "-c", arm.config)
    assert outcome.code == 0, outcome.err
    assert "clean.csv" in outcome.out
    content = json.loads(collaudit("inspect", arm.clean, "-c", arm.config, "--json").out)
    assert content["schema"] == "collaudit/inspect/1"
    assert content["logs"][0]["csv_columns"][:2] == ["t", "q1"]


def test_inspect_shows_a_log_whose_joints_the_robot_does_not_have(arm, collaudit, tmp_path: Path) -> None:
    config, log = tmp_path / "c.toml", tmp_path / "other.csv"
    config.write_text(arm.config.read_text().replace("{i}", "_{joint}"))
    _, rows = arm.clean.read_text().split("\n", 1)
    log.write_text("t,q_hip,q_knee,dq_hip,dq_knee,tau_hip,tau_knee\n" + rows)
    outcome = collaudit("inspect", log, "-c", config)
    assert outcome.code == 3
    assert "hip, knee" in outcome.out
    assert "expected: joint1, joint2" in outcome.err


def test_inspect_shows_an_inverted_effort(arm, collaudit, tmp_path: Path) -> None:
    log = tmp_path / "inverted.csv"
    header, *rows = arm.clean.read_text().splitlines()
    cells = [row.split(",") for row in rows]
    turned = [",".join([*row[:5], str(-float(row[5])), row[6]]) for row in cells]
    log.write_text("\n".join([header, *turned]) + "\n")
    outcome = collaudit("inspect", log, "-c", arm.config)
    assert outcome.code == 3
    assert "effort-sign-inverted" in outcome.out
    started = collaudit("init", log, "-c", arm.config, "-o", tmp_path / "c.toml")
    assert started.code == 3, "init judges findings as inspect does"
    assert "see effort-sign-inverted above" in started.err
    assert "uncomment it" in started.err, "the way out is said"
    text = (tmp_path / "c.toml").read_text()
    assert "# effort_sign = { joint1 = -1 }" in text
    assert '# effort_kind = "motor-torque"' in text
    mended = tmp_path / "mended.toml"
    mended.write_text(text.replace("# effort_sign", "effort_sign"))
    assert collaudit("inspect", log, "-c", mended).code == 0
    assert collaudit("init", log, "-c", mended, "-o", tmp_path / "again.toml").code == 0


def _without_effort(arm, path: Path) -> Path:
    """The clean log with an effort of zero on joint 1, which moves."""
    header, *rows = arm.clean.read_text().splitlines()
    cells = [row.split(",") for row in rows]
    path.write_text("\n".join([header, *(",".join([*row[:5], "0", row[6]]) for row in cells)]) + "\n")
    return path


def test_a_log_with_an_error_is_judged_alike_by_every_command(arm, collaudit, tmp_path: Path) -> None:
    log = _without_effort(arm, tmp_path / "dead.csv")
    judged = ("-c", arm.config)
    assert collaudit("inspect", log, *judged).code == 3
    assert collaudit("init", log, *judged, "-o", tmp_path / "c.toml").code == 3
    audited = collaudit("detect", log, *judged, "--friction", arm.friction)
    assert audited.code == 3
    assert "The effort of joint 'joint1' is 0 all the time" in audited.out


@pytest.mark.parametrize("left_out", ['detect.watch=["joint2"]', 'robot.joints=["joint2"]'])
def test_an_error_of_a_joint_that_nobody_asked_for_forbids_nothing(arm, collaudit, tmp_path, left_out: str) -> None:
    log = _without_effort(arm, tmp_path / "dead.csv")
    judged = ("-c", arm.config, "--set", left_out)
    shown = collaudit("inspect", log, *judged)
    assert shown.code == 0, shown.err
    assert "log-effort-missing" in shown.out
    assert collaudit("init", log, *judged, "-o", tmp_path / "c.toml").code == 0
    audited = collaudit("detect", log, *judged, "--friction", arm.friction)
    assert audited.code == 0, audited.out


def test_init_writes_what_loads_and_works(arm, collaudit, tmp_path: Path) -> None:
    outcome = collaudit("init", arm.clean, "-o", tmp_path / "c.toml")
    assert outcome.code == 3, "without a robot nothing is judged"
    assert '[robot] urdf = "arm.urdf"' in outcome.err
    loaded = load_config(tmp_path / "c.toml")
    assert loaded.config.log.csv.position == "q{i}"
    assert "GUESS" in (tmp_path / "c.toml").read_text()
    printed = collaudit("init", arm.clean)
    assert printed.out == (tmp_path / "c.toml").read_text()
    assert collaudit("fit", arm.clean, "-c", tmp_path / "c.toml").code == 0


def test_init_keeps_what_was_given(arm, collaudit, tmp_path: Path) -> None:
    collaudit("init", arm.clean, "-c", arm.config, "--set", 'robot.joints=["joint1"]', "-o", tmp_path / "c.toml")
    given = load_config(tmp_path / "c.toml").config
    assert given.robot.dh == load_config(arm.config).config.robot.dh
    assert given.robot.joints == ["joint1"]


def _run(*args: object, **env: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", "from collaudit.cli.main import main; main()", *map(str, args)]
    return subprocess.run(command, capture_output=True, text=True, env={**os.environ, **env}, check=False)


def test_a_bug_is_no_verdict(tmp_path: Path, arm) -> None:
    code = (
        "import collaudit.core.api as api\n"
        "def broken(*_): raise ZeroDivisionError('x')\n"
        "api.find_logs = broken\n"
        f"from collaudit.cli.main import main\nmain(DEBUG + ['inspect', {str(arm.clean)!r}])"
    )
    for debug in ([], ["--debug"]):
        done = subprocess.run(
            [sys.executable, "-c", code.replace("DEBUG", repr(debug))], capture_output=True, text=True, check=False
        )
        assert done.returncode == 2
        assert "This is a bug" in done.stderr
        assert ("Traceback" in done.stderr) == bool(debug)


def test_interrupt(arm) -> None:
    code = (
        "import collaudit.core.api as api\n"
        "def stop(*_): raise KeyboardInterrupt\n"
        "api.find_logs = stop\n"
        f"from collaudit.cli.main import main\nmain(['inspect', {str(arm.clean)!r}])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 130
    assert "Traceback" not in done.stderr


def test_a_reader_that_goes_away() -> None:
    code = (
        "import subprocess, sys\n"
        "p = subprocess.Popen([sys.executable, '-c', 'from collaudit.cli.main import main; main()', '--help'],"
        " stdout=subprocess.PIPE, stderr=subprocess.PIPE)\n"
        "p.stdout.close()\n"
        "err = p.stderr.read().decode()\n"
        "sys.exit(1 if 'Traceback' in err or 'Exception' in err else 0)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_no_colour_and_no_bars_when_piped(arm) -> None:
    """Not even where a terminal's colours are not refused."""
    done = _run("inspect", arm.clean, "-c", arm.config)
    assert done.returncode == 0
    assert "\x1b" not in done.stdout + done.stderr


def test_version(collaudit) -> None:
    outcome = collaudit("--version")
    assert outcome.code == 0
    assert outcome.out.startswith("collaudit 0.")


def test_a_report_on_stdout(arm, collaudit, tmp_path: Path) -> None:
    run = tmp_path / "run"
    collaudit("detect", arm.pushed, "-c", arm.config, "--friction", arm.friction, "-o", run)
    assert collaudit("report", run, "-o", "-", "--format", "json").out == (run / "audit.json").read_text()
    assert collaudit("report", run, "-o", "-", "--format", "json,html").code == 2


@pytest.mark.parametrize("out", [".", "..", "/"])
def test_a_folder_is_no_name_for_a_simulated_log(collaudit, out: str) -> None:
    done = collaudit("simulate", "friction", "-o", out)
    assert done.code == 2
    assert "names a folder" in done.err


def test_a_simulation_says_what_it_wrote_and_spares_the_files_of_others(collaudit, tmp_path: Path) -> None:
    log = tmp_path / "log.mcap"
    args = ("simulate", "free-clean", "--duration", "5", "-o", log)
    (tmp_path / "log.toml").write_text("mine")
    refused = collaudit(*args)
    assert refused.code == 2
    assert "log.toml" in refused.err
    assert (tmp_path / "log.toml").read_text() == "mine"
    assert not log.exists()
    (tmp_path / "log.toml").unlink()
    for _ in range(2):
        written = json.loads(collaudit(*args, "--json").out)
    assert written["log"] == [str(log)]
    assert all(Path(written[key]).exists() for key in ("config", "truth"))


def test_joints_of_the_arm_that_are_not_judged_are_no_part_of_the_verdict(arm, collaudit, tmp_path: Path) -> None:
    config = tmp_path / "one.toml"
    config.write_text(arm.config.read_text().replace("[robot]", '[robot]\njoints = ["joint2"]', 1))
    log = collaudit("detect", arm.clean, "-c", config, "--friction", arm.friction, "-o", tmp_path / "run", "--json")
    (said,) = [text for text in json.loads(log.out)["exclusions"] if "not watched" in text]
    assert said == "Joints not watched: joint1."


def test_a_joint_to_judge_that_the_log_lacks(arm, collaudit, tmp_path: Path) -> None:
    lines = [line.split(",") for line in arm.clean.read_text().splitlines()]
    pick = [k for k, name in enumerate(lines[0]) if not name.endswith("2")]
    lacking = tmp_path / "lacking.csv"
    lacking.write_text("\n".join(",".join(line[k] for k in pick) for line in lines))
    config = tmp_path / "both.toml"
    config.write_text(arm.config.read_text().replace("[robot]", '[robot]\njoints = ["joint1", "joint2"]', 1))
    outcome = collaudit("detect", lacking, "-c", config, "--friction", arm.friction)
    assert outcome.code == 3
    assert "joint2" in outcome.err
