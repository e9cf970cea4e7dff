"""``collaudit recommend`` from the shell: the answer, what it is pasted into, and what a person confirms."""

from __future__ import annotations

import json
import re
import shutil
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from residual_audits import audit_of, coloured

from collaudit.core.detection.rule import persistence_samples
from collaudit.reports.files.run_files import write_run
from collaudit.reports.files.written_files import json_text
from collaudit.reports.page.index import summarise
from collaudit.reports.values.entries import entry_of


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Ten minutes of two joints, with one push that is not stated."""
    x = coloured(1, 600.0, joints=2)
    x[100_000:100_100] += np.array([8.0, 0.0])
    folder = tmp_path_factory.mktemp("recommend") / "run"
    write_run(folder, audit_of(x, gamma_nm=[100.0, 1.0]), None)
    return folder


def test_one_screen_with_the_answer_first(collaudit, run: Path) -> None:
    found = collaudit("recommend", run, "-v")
    lines = found.out.splitlines()
    assert found.code == 0 and len(lines) < 45
    assert lines[:3] == collaudit("recommend", run).out.splitlines(), "the three lines, then what is behind them"
    assert "9 min 59 s of clean motion: at most 18 per hour" in lines[1]
    assert "too loose" in found.out and "too tight" in found.out
    assert re.search(r"made\.mcap\s+199\.\d to 200\.\d s\s+suspicious\s+joint1\s+[\d.]+", found.out)
    assert "joint1 " in next(line for line in lines if "If nothing touched" in line)
    assert re.search(r"1 stretch \([\d.]+ s\) left out as possible contact; please confirm", found.out)
    assert "left out" not in found.err, "said once"


def test_confirmed_by_a_person(collaudit, run: Path) -> None:
    found = json.loads(collaudit("recommend", run, "--set", "fit.contact=none", "--json").out)
    assert found["to_confirm"] == [] and found["counted"][0]["joints"] == ["joint1"]
    assert found["joints"]["joint1"]["largest_clean_nm"] > 6.0
    assert found["logs"][0]["contact_known"] is True


def test_the_folder_of_an_audit_stands_for_its_runs(collaudit, run: Path, tmp_path: Path) -> None:
    shutil.copytree(run, tmp_path / "out" / "run")
    (tmp_path / "out" / "summary.json").write_text("{}")
    whole = collaudit("recommend", tmp_path / "out", "--json")
    assert (whole.code, json.loads(whole.out)["joints"]) == (
        0,
        json.loads(collaudit("recommend", run, "--json").out)["joints"],
    )
    (tmp_path / "out" / "summary.json").unlink()
    assert "the folder holds no logs" in collaudit("recommend", tmp_path / "out").err, "a folder that is no audit's"


def test_a_shorter_persistence_has_higher_thresholds(collaudit, run: Path) -> None:
    seldom = json.loads(collaudit("recommend", run, "--json").out)
    quick = json.loads(collaudit("recommend", run, "--set", "detect.n=9", "--json").out)
    assert quick["joints"]["joint1"]["n"] == 9
    assert quick["joints"]["joint2"]["gamma_nm"] >= seldom["joints"]["joint2"]["gamma_nm"]


def test_a_stated_persistence_counts(collaudit, run: Path) -> None:
    stated = json.loads(collaudit("recommend", run, "--set", "detect.n=20", "--json").out)
    assert stated["persistence_by"] == "stated" and stated["joints"]["joint1"]["n"] == 20


def test_too_little_is_refused(collaudit, tmp_path: Path) -> None:
    write_run(tmp_path / "short", audit_of(coloured(1, 100.0)), None)
    found = collaudit("recommend", tmp_path / "short")
    assert found.code == 3
    assert "supports no threshold" in found.out and "at least 3 min are needed" in found.out


def test_three_lines_say_what_to_set(collaudit, run: Path) -> None:
    found = collaudit("recommend", run)
    lines = found.out.splitlines()
    assert [line.split()[0] for line in lines] == ["Set", "Rests", "Notices"] and len(found.out.split()) < 80
    assert re.fullmatch(r"Set +γ joint1 \S+ N·m; joint2 \S+ N·m, n 13 \(26 ms, as set\)", lines[0])
    assert re.search(
        r"9 min 59 s of clean motion: at most 18 per hour .* \(95 %\); 29 h .* more .* would show", lines[1]
    )
    assert re.search(r"torques of joint1 \S+ N·m; joint2 \S+ N·m .*; in newtons not known$", lines[2])
    assert "1 stretch was left out as possible contact" in found.err


CONFIG = """\
# who set this, and when
[detect]
gamma_nm = 4.0  # by hand
persistence_ms = 25  # agreed with the lab
[policy]
max_collisions = 0  # none
"""


def test_written_into_the_configuration_with_its_comments(collaudit, run: Path, tmp_path: Path) -> None:
    config = tmp_path / "collaudit.toml"
    config.write_text(CONFIG, encoding="utf-8")
    for _ in range(2):  # the second time tables are there to be changed
        assert collaudit("recommend", run, "--write", config).code == 0
        text = config.read_text(encoding="utf-8")
        made = tomllib.loads(text)["detect"]
        assert set(made["gamma_nm"]) == {"joint1", "joint2"} and made["persistence_ms"] == 25
        for comment in ("# who set this, and when", "# agreed with the lab", "# none"):
            assert comment in text
        assert collaudit("check", config).code == 0
    config.write_text(config.read_text().replace('"joint1" = ', '"joint1" = 1', 1) + "# mine\n")
    assert collaudit("recommend", run, "--write", config, "--set", "detect.n=20").code == 0
    assert tomllib.loads(config.read_text())["detect"]["persistence_ms"] == 40.0 and "# mine" in config.read_text()


def test_a_round_of_recommending_and_judging_keeps_the_persistence(collaudit, tmp_path: Path) -> None:
    """25 ms are 13 samples of 2 ms, and 26 ms; whoever took these for what was asked climbed from round to round."""
    config = tmp_path / "collaudit.toml"
    config.write_text("[detect]\n", encoding="utf-8")
    asked = 25.0
    for _ in range(3):
        runs = []
        for k, period_s in enumerate((0.002, 0.008)):
            made = audit_of(coloured(k, 400.0), gamma_nm=100.0, name=f"{k}.mcap", period_s=period_s)
            n = persistence_samples(asked / 1e3, period_s)
            rule = replace(made.result.rule, n=n, persistence_s=n * period_s, persistence_requested_ms=asked)
            runs.append(tmp_path / str(k))
            shutil.rmtree(runs[-1], ignore_errors=True)
            write_run(runs[-1], replace(made, result=replace(made.result, rule=rule)), None)
        assert collaudit("recommend", *runs, "--write", config).code == 0
        asked = tomllib.loads(config.read_text())["detect"]["persistence_ms"]
        assert asked == 25.0


def test_a_fleet_gets_one_answer_for_each_robot(collaudit, tmp_path: Path) -> None:
    out, config = tmp_path / "out", tmp_path / "collaudit.toml"
    entries = []
    for robot, level, joints in (("A", 1.0, 1), ("B", 3.0, 2)):
        made = audit_of(level * coloured(1, 600.0, joints=joints), gamma_nm=100.0, name=f"{robot}/cell/run.mcap")
        write_run(out / f"{robot}_run", made, None)
        entries.append(replace(entry_of(made.result, f"{robot}_run/report.html"), robot=robot))
    (out / "summary.json").write_text(json_text(summarise(entries)))
    found = collaudit("recommend", out)
    assert found.code == 0 and [line for line in found.out.splitlines() if "Robot" in line] == ["Robot A", "Robot B"]
    several = collaudit("recommend", out, "--json")
    assert several.code == 2 and "--robot" in several.err and "A, B" in several.err
    gammas = [json.loads(collaudit("recommend", out, "--robot", r, "--json").out)["joints"] for r in "AB"]
    assert set(gammas[0]) == {"joint1"} and set(gammas[1]) == {"joint1", "joint2"}
    assert gammas[1]["joint1"]["gamma_nm"] > 2 * gammas[0]["joint1"]["gamma_nm"]
    config.write_text(
        "[fleet.robots.A]\npaths = ['A/*']  # hall 1\n[fleet.robots.B]\npaths = ['B/*']\ngamma_nm = 50.0\n"
    )
    assert collaudit("recommend", out, "--write", config).code == 0
    robots = tomllib.loads(config.read_text())["fleet"]["robots"]
    assert robots["A"]["gamma_nm"]["joint1"] == gammas[0]["joint1"]["gamma_nm"]
    assert robots["B"]["gamma_nm"]["joint2"] == gammas[1]["joint2"]["gamma_nm"] and "# hall 1" in config.read_text()
    before = config.read_text().replace("robots.B", "robots.C")
    config.write_text(before)
    refused = collaudit("recommend", out, "--write", config)
    assert refused.code == 2 and "fleet.robots.B" in refused.err and config.read_text() == before


def test_arms_without_a_name_are_told_apart_by_their_joints(collaudit, tmp_path: Path) -> None:
    """Two logs of one name, of arms with other joints: no answer over both of them."""
    for k, joints in ((1, 1), (2, 2)):
        write_run(tmp_path / str(k), audit_of(coloured(k, 600.0, joints=joints), gamma_nm=100.0), None)
    found = collaudit("recommend", tmp_path / "1", tmp_path / "2")
    assert found.code == 0 and "Robot joint1, joint2\n" in found.out and "Robot joint1\n" in found.out


def test_what_is_refused_is_not_written(collaudit, tmp_path: Path) -> None:
    config = tmp_path / "collaudit.toml"
    config.write_text(CONFIG, encoding="utf-8")
    write_run(tmp_path / "short", audit_of(coloured(1, 100.0)), None)
    found = collaudit("recommend", tmp_path / "short", "--write", config)
    assert found.code == 3 and config.read_text(encoding="utf-8") == CONFIG and "nothing was written" in found.err
    assert [line.split()[0] for line in found.out.splitlines()] == ["Set", "Rests", "Missing"]
    assert "nothing: the evidence supports no threshold" in found.out and "at least 3 min are needed" in found.out


def test_logs_of_which_no_joint_is_judged_say_what_is_missing(collaudit, tmp_path: Path) -> None:
    made = audit_of(coloured(1, 600.0))
    rule = replace(made.result.rule, gamma_nm={}, watch=())
    write_run(tmp_path / "run", replace(made, result=replace(made.result, rule=rule)), None)
    found = collaudit("recommend", tmp_path / "run")
    assert found.code == 3 and "Missing  a joint that is judged" in found.out and "collaudit detect" in found.out
