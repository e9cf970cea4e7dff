"""The terminal: progress with an estimate, messages above it, colour, suggestions, errors as JSON."""

from __future__ import annotations

import json
import os
import pty
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest
import samples

from collaudit.cli import console
from collaudit.cli.console import note, say_result
from collaudit.cli.main import collaudit as group
from collaudit.core.findings import Finding
from collaudit.reports.sections.finding_sections import finding_lines
from collaudit.reports.terminal.screen_text import verdict_text
from collaudit.reports.values.visible_text import joint_lines

NO_SUFFIX = ["simulate", "friction", "-o", "x.xyz"]


def test_messages_stand_in_place_of_the_progress_bar(monkeypatch, capsys) -> None:
    monkeypatch.setattr(console, "_active", [object()])
    note("a word")
    assert capsys.readouterr().err == "\r\x1b[Ka word\n"


def test_nothing_is_drawn_where_no_terminal_is(capsys) -> None:
    with console.progress("judging") as report:
        report(1, 2)
    assert capsys.readouterr().err == ""


def _on_a_terminal(*args: object, **env: str) -> str:
    """What a command prints on a terminal, both streams."""
    main, side = pty.openpty()
    command = [sys.executable, "-c", "from collaudit.cli.main import main; main()", *map(str, args)]
    environment = {k: v for k, v in os.environ.items() if k != "NO_COLOR"} | {"TERM": "xterm", "COLUMNS": "90"} | env
    process = subprocess.Popen(command, stdout=side, stderr=side, env=environment)
    os.close(side)
    out = b""
    while True:
        try:
            got = os.read(main, 1 << 16)
        except OSError:
            break
        if not got:
            break
        out += got
    process.wait()
    os.close(main)
    return out.decode()


def test_colour_on_a_terminal_unless_refused(arm) -> None:
    command = ("detect", arm.pushed, "-c", arm.config, "--friction", arm.friction)
    coloured = _on_a_terminal(*command)
    assert "\x1b[31m\x1b[1mFAIL\x1b[0m" in coloured
    plain = _on_a_terminal(*command, NO_COLOR="1")
    assert "\x1b[31m" not in plain
    assert re.search(r"judging +\[#+-* *\] +\d+%", plain), "progress"
    shown = re.sub(r"\x1b\[1A\x1b\[2K", "", re.sub(r"[^\n]*\r(?!\n)", "", plain))
    lines = shown.replace("\r", "").splitlines()
    assert [line for line in lines if len(line) > 90] == []
    assert len(lines) <= 40, "one screen"


def test_the_verdict_is_coloured_at_the_beginning_of_a_line_only(capsys, monkeypatch) -> None:
    texts: list[str] = []
    monkeypatch.setattr("collaudit.cli.console.say", lambda text, **_: texts.append(text))
    say_result("PASS, WITH EXCLUSIONS  a FAIL  b\n  error   code: text\n")
    assert texts[0].count("\x1b[0m") == 2
    assert "a FAIL  b" in texts[0]


def test_every_long_command_tells_how_far_it_is(arm, collaudit, tmp_path: Path, monkeypatch) -> None:
    """Each reports shares between nothing and all, from which the time that is left follows."""
    told: dict[str, set[float]] = {}

    @contextmanager
    def listen(label: str) -> Iterator[Callable[[int, int], None]]:
        yield lambda done, total: told.setdefault(label, set()).add(done / total)

    for module in ("commands.friction", "commands.logs", "commands.recommend", "commands.report", "drafts.trial"):
        monkeypatch.setattr(f"collaudit.cli.{module}.progress", listen)
    settings, run = ("-c", arm.config, "--friction", arm.friction), tmp_path / "run"
    collaudit("fit", arm.clean, "-c", arm.config, "-o", tmp_path / "f.json")
    collaudit("detect", arm.pushed, *settings, "-o", run)
    collaudit("recommend", run)
    collaudit("report", run, "-o", tmp_path / "r.html", "--format", "html,csv,mcap")
    collaudit("init", arm.clean, "-c", arm.config, "-o", tmp_path / "new.toml")
    inside = {label: sorted(share for share in shares if 0 < share < 1) for label, shares in told.items()}
    for label, least in {"fitting": 3, "judging": 8, "recommending": 1, "trying the configuration": 4}.items():
        assert len(inside[label]) >= least, label
    assert all(told[f"writing {name}"] for name in ("html", "mcap"))
    assert len(inside["writing html"]) >= 2, "one step a joint"


@pytest.mark.parametrize(
    ("args", "said"),
    [
        (["simulate", "frction", "-o", "x.mcap"], "did you mean 'friction'?"),
        (["simulate", "stop-go", "--robot", "sevn", "-o", "x.mcap"], "did you mean 'seven'?"),
        (["simulate", "stop-go", "--with", "sprngs", "-o", "x.mcap"], "did you mean 'springs'?"),
        (["detekt", "x"], "Did you mean 'detect'?"),
        (["report", "x", "-o", "r.html", "--format", "htlm"], "did you mean 'html'?"),
        (NO_SUFFIX, "no log format has this suffix"),
        (["simulate", "friction", "-o", "x.mcp"], "did you mean '.mcap'?"),
    ],
)
def test_near_names_are_suggested(collaudit, tmp_path: Path, monkeypatch, args: list[str], said: str) -> None:
    monkeypatch.chdir(tmp_path)
    done = collaudit(*args)
    assert done.code == 2
    assert said in done.err
    assert list(tmp_path.iterdir()) == [], "refused before anything is made"


def test_an_option_is_suggested_only_where_it_is_alike(collaudit) -> None:
    assert "Did you mean '--friction'?" in collaudit("detect", "x", "--fricton", "f").err
    assert "Did you mean" not in collaudit("fit", "x", "--quiet").err


def test_names_in_a_log_are_suggested(arm, collaudit) -> None:
    common = ("detect", arm.clean, "-c", arm.config, "--friction", arm.friction)
    assert "did you mean 'joint1'?" in collaudit(*common, "--set", 'detect.watch=["jiont1"]').err
    assert "did you mean 'joint2'?" in collaudit(*common, "--set", "detect.gamma_nm={joint2_=4}").err
    assert f"did you mean '{arm.clean.name}'?" in collaudit("inspect", arm.clean.with_name("claen.csv")).err


def test_a_folder_offers_the_runs_inside(arm, collaudit, tmp_path: Path) -> None:
    for name in ("monday", "tuesday"):
        collaudit("detect", arm.clean, "-c", arm.config, "--friction", arm.friction, "-o", tmp_path / "week" / name)
    assert "2 run folders inside" in collaudit("report", tmp_path / "week").err
    done = collaudit("report", tmp_path / "week", "-o", tmp_path / "r.html")
    assert done.code == 2
    assert f"2 run folders inside: {tmp_path / 'week' / 'monday'}, {tmp_path / 'week' / 'tuesday'}" in done.err
    assert f"collaudit report {tmp_path / 'week' / 'monday'} {tmp_path / 'week' / 'tuesday'}" in done.err


@pytest.mark.parametrize(
    ("args", "code", "kind"),
    [
        (["detect", "absent.mcap", "--json"], 2, "ConfigError"),
        (["inspect", "--json"], 2, "UsageError"),
        (["report", "absent", "-o", "r.html", "--json"], 2, "CollauditError"),
        (["recommend", "absent", "--json"], 2, "ConfigError"),
        ([*NO_SUFFIX, "--json"], 2, "ConfigError"),
    ],
)
def test_errors_are_json_where_json_was_asked_for(collaudit, args: list[str], code: int, kind: str) -> None:
    done = collaudit(*args)
    error = json.loads(done.out)
    assert (done.code, error["exit_code"], error["kind"]) == (code, code, kind)
    assert error["schema"] == "collaudit/error/1"
    assert error["message"] and error["message"].splitlines()[0] in done.err


def test_a_log_that_cannot_be_judged_is_an_error_in_json(collaudit, tmp_path: Path) -> None:
    words = tmp_path / "words.csv"
    words.write_text("name,colour\nrobot,orange\n")
    done = collaudit("detect", words, "--json")
    assert (done.code, json.loads(done.out)["exit_code"]) == (3, 3)


def test_every_command_takes_json() -> None:
    without = [
        name
        for name in group.summaries
        if (command := group.get_command(None, name)) is None  # type: ignore[arg-type]
        or not any("--json" in param.opts for param in command.params)
    ]
    assert without == []


def test_init_as_json(arm, collaudit) -> None:
    done = collaudit("init", arm.clean, "-c", arm.config, "--json")
    content = json.loads(done.out)
    assert content["schema"] == "collaudit/init/1"
    assert content["judged"] is (done.code == 0)
    assert "[robot]" in content["toml"]


def test_what_a_verdict_leaves_out_on_several_joints_is_said_once() -> None:
    said = [Finding("effort-gain", "warning", f"joint '{j}' is {k} per N·m ({k} to {k}, {k})", joint=j) for k, j in
            enumerate("abcd", 2)]  # fmt: skip
    result = replace(samples.passed().result, findings=tuple(said), exclusions=(*(f.text for f in said), "Gaps: 3 s."))
    excluded = [line for line in verdict_text(result).splitlines() if "Not covered: " in line]
    assert len(excluded) == 3
    assert "joint 'a'" in excluded[0] and "b, c, d" in excluded[1] and "Gaps" in excluded[2]


def test_what_is_said_of_several_joints_is_said_once() -> None:
    said = [(f"a{k}", f"change with time: {10 + k} s of motion of joint 'a{k}' are too short.") for k in (1, 2, 3)]
    assert joint_lines(said, 3) == ["all 3 joints: change with time: 11 to 13 s of motion of the joint are too short."]
    assert joint_lines([("a", "x is 1"), ("b", "y is 1")]) == ["a: x is 1", "b: y is 1"]
    ranges = [("a", "from 1 to 2 rad"), ("b", "from 1 to 3 rad")]
    assert joint_lines(ranges) == ["a: from 1 to 2 rad", "b: from 1 to 3 rad"], "a range of ranges would be a riddle"
    several = [*ranges, ("c", "from 1 to 4 rad")]
    assert len(joint_lines(several)) == 3
    assert joint_lines(several, brief=True) == [
        "a: from 1 to 2 rad",
        "the same, instead of 2: b 3; c 4",
    ]
    many = [(name, f"{k} {k} {k} {k} to") for k, name in enumerate("abc")]
    assert joint_lines(many, brief=True)[1] == "b, c: the same, with other numbers (--json has them)"


def test_findings_of_several_joints_are_one_line_with_the_numbers_of_each() -> None:
    text = "The effort of joint '{}' is {} per N·m of model torque (95 %: {} to {})."
    said = (("a", -1.5, -1.6, -1.4), ("b", -1.7, -1.8, -1.6), ("c", -5.1, -5.5, -4.6))
    found = [Finding("effort-sign-inverted", "error", text.format(*one), joint=one[0]) for one in said]
    assert finding_lines(found, brief=True) == [
        ("error", f"effort-sign-inverted: {text.format(*said[0])}"),
        (
            "error",
            "effort-sign-inverted: the same, instead of -1.5, -1.6, -1.4: b -1.7, -1.8, -1.6; c -5.1, -5.5, -4.6",
        ),
    ]


def test_messages_are_folded_at_words_on_a_terminal_and_paths_stay_whole(capsys, monkeypatch) -> None:
    monkeypatch.setattr("shutil.get_terminal_size", lambda: os.terminal_size((50, 24)))
    path = "/a-very/long/path/that/must-be-copied/in-one/piece/" + "x" * 20
    message = f"{path}: nothing was recognised\n  found:    {'column ' * 12}\n- {'word ' * 12}"
    note(message)
    assert capsys.readouterr().err == message + "\n", "no terminal: as it is"
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    note(message)
    lines = capsys.readouterr().err.splitlines()
    assert lines[0] == f"{path}:"
    assert all(len(line) <= 50 for line in lines[1:])
    assert lines[3].startswith(12 * " " + "column")
    assert lines[-1].startswith("  word")


def test_findings_of_several_logs_name_them_once() -> None:
    found = [Finding("phases-unknown", "info", "No phases.", where=name) for name in ("a.mcap", "b.mcap")]
    assert finding_lines(found) == [("info", "phases-unknown: No phases. [a.mcap; b.mcap]")]


def test_a_fit_of_several_logs_says_whose_a_finding_is(arm, collaudit, tmp_path: Path) -> None:
    out = tmp_path / "f.json"
    assert collaudit("fit", arm.clean, arm.pushed, "-c", arm.config, "-o", out).code == 0
    places = {f["where"] for f in json.loads(out.read_text())["findings"] if "free motion" in f["text"]}
    assert places == {"clean.csv", "pushed.csv"}


def test_a_report_does_not_say_that_it_uses_settings_it_does_not_read(arm, collaudit, tmp_path, monkeypatch) -> None:
    shutil.copyfile(arm.config, tmp_path / "collaudit.toml")
    monkeypatch.chdir(tmp_path)
    judged = collaudit("detect", arm.pushed, "--friction", arm.friction, "-o", "run")
    assert judged.code == 1 and judged.err.count("settings of collaudit.toml in this folder are used") == 1
    assert "settings of" not in collaudit("report", "run", "-o", "report.html").err


def test_detect_shows_near_misses(arm, collaudit) -> None:
    said = collaudit(
        "detect", arm.pushed, "-c", arm.config, "--friction", arm.friction, "--set", "detect.gamma_nm=13.5"
    )
    assert "\nNear misses (1)\n" in said.out and "% of γ" in said.out and said.out.count("joint1") >= 2


def test_fit_prints_a_table_and_what_to_do(arm, collaudit) -> None:
    short = collaudit("fit", arm.clean, "-c", arm.config)
    whole = collaudit("fit", arm.clean, "-c", arm.config, "-v")
    assert "auto γ" in short.out.splitlines()[0] and len(short.out.split()) < 150
    assert "parameters [95" in whole.out.splitlines()[0] and "parameters [95" not in short.out
    assert "Ways to fit" in whole.out and "Ways to fit" not in short.out and len(whole.out) > 1.5 * len(short.out)
